"""What ``StrainTire.fmu`` consists of: a calibration, the slave, reference signals, its page."""

import math
from collections.abc import Mapping
from typing import Any

from tirelib.core.errors import ParameterError
from tirelib.core.flags import INVALIDATING, TurnFlag
from tirelib.core.rates import check_rate
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.core_table import VALUES
from tirelib.fmu.describe3 import CLOCK, JOINED, joined
from tirelib.fmu.handbook import html_table, page
from tirelib.fmu.parts import source_file
from tirelib.fmu.reference import FOLDER
from tirelib.fmu.remarks import lines
from tirelib.fmu.spec import SlaveSpec
from tirelib.fmu.strain_reference import strain_reference
from tirelib.fmu.strain_variables import MISSING, inputs, outputs, parameters
from tirelib.fmu.variables import Variable
from tirelib.fmu.wheel import check_missing

MODEL = "StrainTire"
CALIBRATION = "calibration.toml"
"""Name of the calibration among the resources."""
DESCRIPTION = "Load, slip angle, slip ratio and lateral force from innerliner strain"
MOST_SAMPLES = 256
"""Largest frame: a turn must be longer than a frame, or its estimate would be overwritten."""
_SHOWN = {
    "Fz": ("N", 1.0),
    "alpha": ("deg", 180.0 / math.pi),
    "kappa": ("%", 100.0),
    "Fy": ("N", 1.0),
}


def strain_tire(
    loaded: Calibration,
    text: str,
    document: Mapping[str, Any],
    *,
    samples_per_step: int,
    sample_rate: float,
    buffered: bool,
    missing: float = math.nan,
    python: bool = False,
    sealed: bool = False,
    fmi: int = 2,
) -> SlaveSpec:
    """Return what the FMU of a calibration consists of; see `tirelib.fmu.build.build_fmu`.

    Parameters
    ----------
    loaded : Calibration
    text : str
        The calibration's file.
    document : mapping
        What stands in it.

    Raises
    ------
    ParameterError
        If a number is out of range.
    """
    if not 1 <= samples_per_step <= MOST_SAMPLES:
        raise ParameterError(
            f"samples per step = {samples_per_step}; allowed are 1 .. {MOST_SAMPLES}; a frame must "
            "be shorter than a turn of the wheel"
        )
    check_rate(sample_rate)
    check_missing(missing)
    table = [
        *parameters(sample_rate, missing),
        *inputs(loaded.lateral, samples_per_step, buffered=buffered, road=loaded.chains[-1].road),
        *outputs(loaded.lateral),
    ]
    reference: dict[str, bytes] = {}
    if not sealed:
        signals = strain_reference(
            loaded, sample_rate, samples_per_step, buffered=buffered, lose=fmi == 2
        )
        reference = (signals.joined(JOINED) if fmi == 3 else signals).files(MODEL)
    told = {name: part for name, part in document.items() if name != "data" or not sealed}
    settings: dict[str, int | float | str | bool] = {
        "samples_per_step": samples_per_step,
        "sample_rate": sample_rate,
        "buffered": buffered,
        "missing": str(missing),
        "python": python,
        "sealed": sealed,
        "fmi": fmi,
    }
    shown = [one.variable for one in joined(table)] if fmi == 3 else table
    return SlaveSpec(
        model=MODEL,
        script="strain_tire.py",
        description=DESCRIPTION,
        table=table,
        step_size=samples_per_step / sample_rate,
        settings=settings,
        resources={
            **({} if sealed else {CALIBRATION: text.encode()}),
            **{f"{FOLDER}/{name}": data for name, data in reference.items()},
        },
        documentation={"index.html": _page(loaded, told, shown, settings).encode()},
        icon=source_file("strain_tire.png").read_bytes(),
        start_depends_on=(MISSING,),
        fmi=fmi,
        texts=(*lines(), *VALUES),
    )


def _page(
    calibration: Calibration,
    document: Mapping[str, Any],
    table: list[Variable],
    settings: Mapping[str, Any],
) -> str:
    samples, rate, python = (settings[k] for k in ("samples_per_step", "sample_rate", "python"))
    lead = (
        "Estimates of one wheel, after every turn, from the strain of gages on the innerliner: "
        "vertical load, slip angle, slip ratio and lateral force, each with its standard deviation."
    )
    facts = {
        "tire": calibration.tire,
        "gages": ", ".join(f"{1e3 * y:+g}" for y in calibration.lateral) + " mm, ISO 8855",
        "samples per step": f"up to {samples} (input samples)"
        if settings["buffered"]
        else str(samples),
        "sample rate": f"{rate:g} Hz (parameter sample_rate)",
        "communication step": f"{1e3 * samples / rate:g} ms",
        "low-pass": f"{calibration.order:g} cycles per turn"
        if calibration.cut_off is None
        else f"{calibration.cut_off:g} Hz",
        "axis systems": "iso (default), sae, adapted_sae (parameter axes)",
        "needs": "CPython 3.11 or newer with numpy and scipy; linux64 or win64"
        if python
        else "nothing else; Linux (x86-64, AArch64), Windows (x86-64), macOS 11",
        "version": "{version}",
        "licences": f"documentation/licenses: MIT, tirelib{' and pythonfmu' if python else ''}",
    }
    drawing = source_file("conventions.svg").read_text(encoding="utf-8")
    sections = {
        "Conventions": f"{drawing}\n{_CONVENTIONS}",
        "Steps and frames": _BUFFERED if settings["buffered"] else _FRAMES,
        "Accuracy": _accuracy(document),
        "Calibrated range": _ranges(calibration),
        "Flags": _flags(),
        **({"Arrays and events": _ARRAYS} if settings["fmi"] == 3 else {}),
        "Limits": _LIMITS.replace("</ul>", _PATHS) if python else _LIMITS,
        "Check": _CHECK_SEALED if settings["sealed"] else _CHECK,
    }
    return page(MODEL, lead, facts, table, sections)


def _accuracy(document: Mapping[str, Any]) -> str:
    rows = []
    for quantity, known in document.get("statistics", {}).items():
        error, unit = known.get("cross_validated_rmse"), str(known.get("unit", "")).strip("1")
        if error is None:
            continue
        fit = known.get("r2")
        rows.append(
            (
                quantity,
                f"{error:.3g} {unit}",
                "" if fit is None else f"{fit:.5f}",
                f"{known.get('n', '')}",
                f"{known.get('conditions', '')}",
            )
        )
    data = ", ".join(str(part.get("name", "")) for part in document.get("data", []))
    if not rows:
        return "<p>The calibration holds no statistics.</p>"
    head = ("quantity", "cross-validated error (rms)", "R2", "runs", "conditions")
    made = f", made on: {_plain(data)}" if data else ""
    return (
        f"{html_table(head, rows)}\n<p>These are the errors of the calibration{made}. In "
        "use every estimate carries its own standard deviation. They hold for "
        "steady parts of a manoeuvre, because an estimate covers one turn of the wheel.</p>"
    )


def _plain(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


def _ranges(calibration: Calibration) -> str:
    rows = []
    for quantity, guards in calibration.chains[-1].guards.items():
        for known in guards:
            if known.name == quantity:
                unit, factor = _SHOWN[quantity]
                rows.append(
                    (quantity, f"{factor * known.low:.4g}", f"{factor * known.high:.4g}", unit)
                )
    head = ("quantity", "from", "to", "unit")
    return (
        f"{html_table(head, rows)}\n<p>Outside these ranges the quantity is not valid "
        "(out_of_range).</p>"
    )


def _flags() -> str:
    rows = [
        (str(int(flag)), (flag.name or "").lower(), "no" if flag & INVALIDATING else "with care")
        for flag in TurnFlag
    ]
    return html_table(("bit", "name in status", "estimate usable"), rows)


_CONVENTIONS = """<p>All values are SI. Positive slip angle gives negative lateral force (ISO 8855).
With <code>axes</code> = sae the signs of Fz, alpha and Fy turn, with adapted_sae that of Fy; in
both, y points to the right, so <code>strain_1</code> is the gage on the other side.</p>"""
_FRAMES = """<p>A communication step brings one frame of samples, oldest first. A shorter step uses
the first samples of the frame only; after a longer step the samples beyond the frame count as
missing. A step that is not a whole number of samples is refused. The frame length does not change
the estimates.</p>"""
_BUFFERED = """<p>The input <code>samples</code> gives the number of new samples in the frame,
oldest first; the step may have any length, because time is counted in samples. In a step without
samples the estimate ages, and after the time of two turns it is no longer valid. The packing of the
samples does not change the estimates.</p>"""
_ARRAYS = f"""<p><code>strain</code> holds a frame: a row for each sample, oldest first, a column
for each gage (one dimension where a step brings one sample). In Event Mode the clock
<code>{CLOCK}</code> ticks where <code>turn</code> has counted on; importers without Event Mode read
<code>turn</code> after each step.</p>"""
_LIMITS = """<ul> <li>An estimate is made once per turn, 20 degrees of wheel angle and half the
filter after the trailing edge; <code>age</code> counts from there.</li> <li>The first turn after a
start or a gap is never valid.</li> <li>Without an estimate a Real output shows the parameter
<code>missing</code>, NaN by default; only <code>valid</code> states whether there is an
estimate.</li> <li>Forward rolling on a flat road; a turn shorter than 3 s.</li> <li>The slip ratio
needs <code>speed</code>; a calibration with pressure or camber needs those.</li> <li>Without
contacts for two turns <code>valid</code> drops and the last values are held.</li> </ul>"""
_PATHS = """<li>The path of the unpacked FMU may hold spaces, but no other character that a URI
encodes with a percent sign.</li> </ul>"""
_CHECK = """<p><code>resources/reference</code> holds input and expected output in the FMI
cross-check layout; <code>tirelib fmu check X.fmu</code> plays and compares them.</p>"""
_CHECK_SEALED = """<p>This FMU is sealed, so it holds no reference signals;
<code>tirelib fmu check X.fmu --reference DIR</code> plays those that its supplier gives.</p>"""
