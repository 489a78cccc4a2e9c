"""What ``VirtualTire.fmu`` consists of: a surface, the slave, reference signals, its page."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters.tire_file import models_folder
from tirelib.core.rates import check_rate
from tirelib.fmu.export import export
from tirelib.fmu.handbook import html_table, page
from tirelib.fmu.native import pack
from tirelib.fmu.parts import DEFAULT_RATE, source_file
from tirelib.fmu.reference import FOLDER, Reference
from tirelib.fmu.spec import SlaveSpec
from tirelib.fmu.virtual.coordinates import FRICTION
from tirelib.fmu.virtual.core_table import flat_table
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.remarks import lines
from tirelib.fmu.virtual.surface import Surface, read_surface
from tirelib.fmu.virtual.table import START, inputs, outputs, parameters
from tirelib.fmu.virtual.wheel import VirtualWheel

MODEL = "VirtualTire"
DESCRIPTION = "Tire with strain gages: strain frames from load, slip, camber, speed and pressure"
MOST_SAMPLES = 256
STEPS = 120
"""Communication steps of the reference signals."""


def build_virtual(
    out: str | Path,
    *,
    samples_per_step: int = 10,
    sample_rate: float = DEFAULT_RATE,
    surface: str | Path | None = None,
    python: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write ``VirtualTire.fmu``: an FMI 2.0 co-simulation unit, the mirror of ``StrainTire.fmu``.

    Parameters
    ----------
    out : path
        The FMU to write.
    samples_per_step : int
        Most samples of every gage that one communication step brings.
    sample_rate : float, [Hz]
        Start value of the parameter of that name.
    surface : path, optional
        By default the numerical rig's reference tire; `friction_surface` has friction as an input.
    python : bool
        Whether Python computes in the FMU, where it runs, instead of the compiled core.
    progress : callable, optional
        Called with what was done.

    Raises
    ------
    ParameterError
        If a number is out of range.
    FormatError
        If the surface cannot be read, or the FMU cannot be written.
    """
    path = Path(surface or default_surface())
    spec = virtual_tire(path, samples_per_step, sample_rate, python=python)
    if python:
        return export(spec, out, progress)
    known = read_surface(path)
    starts = [float(v.start) for v in spec.table if v.causality != "output"]
    title = str(known.about.get("tire", "")) or MODEL
    return pack(spec, title, np.concatenate((flat_table(known), starts)), out, progress)


def default_surface() -> Path:
    """Return the file of the reference tire's surface."""
    return models_folder() / "virtual_tire" / "reference.npz"


def friction_surface() -> Path:
    """Return the file of the reference tire's surface that has friction as an input."""
    return models_folder() / "virtual_tire" / "friction.npz"


def virtual_tire(
    surface: str | Path, samples_per_step: int, sample_rate: float, *, python: bool = False
) -> SlaveSpec:
    """Return what the FMU consists of; see `build_virtual`."""
    if not 1 <= samples_per_step <= MOST_SAMPLES:
        raise ParameterError(
            f"samples per step = {samples_per_step}; allowed are 1 .. {MOST_SAMPLES}; take a "
            "shorter communication step"
        )
    check_rate(sample_rate)
    known = read_surface(Path(surface))
    table = [*parameters(sample_rate), *inputs(known), *outputs(known, samples_per_step)]
    reference = virtual_reference(known, sample_rate, samples_per_step)
    return SlaveSpec(
        model=MODEL,
        script="virtual_tire.py",
        description=DESCRIPTION,
        table=table,
        step_size=samples_per_step / sample_rate,
        settings={"samples_per_step": samples_per_step, "sample_rate": sample_rate},
        resources={
            **({"surface.npz": Path(surface).read_bytes()} if python else {}),
            **{f"{FOLDER}/{name}": data for name, data in reference.files(MODEL).items()},
        },
        documentation={
            "index.html": _page(known, table, samples_per_step, sample_rate, python).encode()
        },
        icon=source_file("strain_tire.png").read_bytes(),
        texts=lines(),
    )


def virtual_reference(surface: Surface, rate: float, samples: int) -> Reference:
    """Return input and expected output: load, slip and pressure change, one input leaves the range.

    What is expected is what the library says, not what an FMU said.
    """
    step = samples / rate
    phase: FloatArray = np.linspace(0.0, 2.0 * np.pi, STEPS, dtype=np.float64)
    given: dict[str, FloatArray] = {name: np.full(STEPS, START[name]) for name in surface.inputs}
    given["Fz"] = np.round(4000.0 + 1500.0 * np.sin(phase), 1)
    given["alpha"] = np.where(phase > 2.0, 0.05, 0.0)
    given["kappa"] = np.where(phase > 4.0, -0.03, 0.0)
    given["pressure"] = np.round(2.3e5 + 1e4 * np.sin(phase))
    given["camber"] = np.where((phase > 5.0) & (phase < 5.3), 0.5, 0.0)
    if FRICTION in given:
        given[FRICTION] = np.where(phase > 3.0, 0.5, START[FRICTION])
    wheel = VirtualWheel(surface, Options(rate=rate), samples)
    wheel.begin([float(given[name][0]) for name in surface.inputs])
    rows = [_row(wheel)]
    for at in range(STEPS - 1):
        wheel.step(step, [float(given[name][at]) for name in surface.inputs])
        rows.append(_row(wheel))
    names = [v.name for v in outputs(surface, samples) if v.kind != "String"]
    table = np.array(rows)
    return Reference(step, given, {name: table[:, i] for i, name in enumerate(names)})


def _row(wheel: VirtualWheel) -> list[float]:
    values, others = wheel.outputs()
    return [*values, *(float(value) for value in others if not isinstance(value, str))]


def _page(surface: Surface, table: list[Any], samples: int, rate: float, python: bool) -> str:
    lead = (
        "A virtual tire: the signals that five gages on its innerliner would show, sample by "
        "sample, at the load, slip, camber, speed and pressure that a vehicle model gives."
    )
    facts = {
        "tire": str(surface.about.get("tire", "")),
        "gages": ", ".join(f"{1e3 * y:+g}" for y in surface.lateral) + " mm, ISO 8855",
        "samples per step": f"up to {samples} (the output samples gives the number of new ones)",
        "sample rate": f"{rate:g} Hz (parameter sample_rate)",
        "communication step": f"up to {1e3 * samples / rate:g} ms",
        "needs": "CPython 3.11 or newer with numpy and scipy; linux64 or win64"
        if python
        else "nothing else; Linux (x86-64, AArch64), Windows (x86-64), macOS 11",
        "version": "{version}",
        "licences": f"documentation/licenses: MIT, tirelib{' and pythonfmu' if python else ''}",
    }
    drawing = source_file("conventions.svg").read_text(encoding="utf-8")
    sections = {
        "Conventions": f"{drawing}\n{_CONVENTIONS}",
        "Range": _ranges(surface),
        "Interpolation error": _errors(surface.about),
        "Steps and frames": _FRAMES,
        "Transients": _TRANSIENTS,
        "Limits": _LIMITS,
    }
    return page(MODEL, lead, facts, table, sections)


_SHOWN = {
    "Fz": (1e-3, "kN"),
    "alpha": (180.0 / math.pi, "deg"),
    "kappa": (100.0, "%"),
    "camber": (180.0 / math.pi, "deg"),
    "speed": (3.6, "km/h"),
    "pressure": (1e-5, "bar"),
    "friction": (1.0, ""),
}


def _ranges(surface: Surface) -> str:
    rows = [
        (name, f"{factor * low:.4g}", f"{factor * high:.4g}", unit)
        for name, low, high in zip(surface.inputs, surface.low, surface.high, strict=True)
        for factor, unit in (_SHOWN[name],)
    ]
    return html_table(("input", "from", "to", "unit"), rows) + (
        "<p>Outside these ranges nothing is extrapolated: <code>frame_valid</code> is false, the "
        "last frame is held, and <code>status</code> names the inputs that are out of range.</p>"
    )


def _errors(about: Mapping[str, Any]) -> str:
    rows = [
        (
            name,
            f"{part['points']}",
            f"{part['strain_ustrain_rms']:.0f}",
            f"{part['strain_ustrain_median_of_largest']:.0f}",
            f"{part['strain_ustrain_largest']:.0f}",
        )
        for name, part in about.get("left_out", {}).items()
    ]
    head = (
        "part of the range",
        "points",
        "rms [ustrain]",
        "largest of a waveform, median",
        "largest of all",
    )
    spread = float(about.get("strain_spread_ustrain", math.nan))
    return (
        f"{html_table(head, rows)}\n<p>Against {about.get('solutions', 0)} solutions of the "
        "numerical rig, each held out together with its mirror image. The strain itself spreads "
        f"by {spread:.0f} ustrain (rms); the largest errors are at the edges of the contact.</p>"
    )


_CONVENTIONS = """<p>All values are SI, ISO 8855: a positive slip angle gives a negative lateral
force. <code>wheel_angle</code> is 0 where the gages are over the road. The slip ratio refers to the
travel speed: a wheel that rolls freely at a slip angle has cos(alpha) - 1.</p>"""
_FRAMES = """<p>Samples are taken at whole multiples of the sample period. After a step the frame
holds the samples that were due in it, oldest first, the last one repeated to the frame's end; a
step may have any length up to a full frame. The frame length does not change the samples.</p>"""
_TRANSIENTS = """<p>Slip angle and slip ratio act after first-order relaxation over the distance
travelled; load, camber, pressure and friction act at once. Everything else is the steady rolling
state
of the numerical rig.</p>"""
_LIMITS = """<ul> <li>Steady rolling only, apart from the relaxation: no vibration, no uneven
road.</li> <li>All gages are equal and exact, apart from the noise and the faults that the
parameters set.</li> <li>Without a finite speed the wheel continues at its last turn rate, and its
frames are not valid.</li> </ul>"""
