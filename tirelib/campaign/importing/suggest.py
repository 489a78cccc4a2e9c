"""Content of a file, and a first draft of its map for known names.

The names are those of the tire test consortium (FX, SA, IA, ...), of TYDEX (FYW, SLIPANGL, ...),
of German rigs (Radlast, Schlupf, ...), English words (wheel load, SG1, ...) and those of a
campaign itself. What the file does not say, the draft leaves open.
"""

import json
import re
from collections.abc import Container, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tirelib.campaign.importing.columns import Column, FloatArray, Table
from tirelib.campaign.importing.delimited import CsvOptions
from tirelib.campaign.importing.formats import read_table
from tirelib.campaign.importing.mapheader import is_gage, strain_number
from tirelib.campaign.importing.mapreader import FORMAT
from tirelib.core.units import QUANTITIES, dimension_of, dimensions_of_unit, to_si

KNOWN_NAMES: Mapping[str, str] = {
    "ET": "time",
    "V": "speed",
    "N": "omega",
    "SA": "slip_angle",
    "IA": "camber",
    "RL": "loaded_radius",
    "RSTAT": "loaded_radius",
    "RE": "effective_radius",
    "P": "pressure",
    "FX": "Fx",
    "FY": "Fy",
    "FZ": "Fz",
    "MX": "Mx",
    "MY": "My",
    "MZ": "Mz",
    "SL": "slip_ratio",
    "RST": "road_temperature",
    "TSTI": "tread_inner_temperature",
    "TSTC": "tread_temperature",
    "TSTO": "tread_outer_temperature",
    "AMBTMP": "ambient_temperature",
    "RUNTIME": "time",
    "FXW": "Fx",
    "FYW": "Fy",
    "FZW": "Fz",
    "MXW": "Mx",
    "MYW": "My",
    "MZW": "Mz",
    "SLIPANGL": "slip_angle",
    "INCLANGL": "camber",
    "LONGSLIP": "slip_ratio",
    "INFLPRES": "pressure",
    "WHROTSPD": "omega",
    "TRAJVELW": "speed",
    "TRAJVELH": "speed",
    "DSTGRWHC": "loaded_radius",
    "T": "time",
    "TIMESTAMP": "time",
    "ZEIT": "time",
    "LAST": "Fz",
    "RADLAST": "Fz",
    "AUFSTANDSKRAFT": "Fz",
    "SEITENKRAFT": "Fy",
    "QUERKRAFT": "Fy",
    "LAENGSKRAFT": "Fx",
    "UMFANGSKRAFT": "Fx",
    "KIPPMOMENT": "Mx",
    "RUECKSTELLMOMENT": "Mz",
    "SCHRAEGLAUF": "slip_angle",
    "SCHRAEGLAUFWINKEL": "slip_angle",
    "STURZ": "camber",
    "STURZWINKEL": "camber",
    "SCHLUPF": "slip_ratio",
    "LAENGSSCHLUPF": "slip_ratio",
    "FUELLDRUCK": "pressure",
    "LUFTDRUCK": "pressure",
    "DRUCK": "pressure",
    "REIFENDRUCK": "pressure",
    "REIFENFUELLDRUCK": "pressure",
    "GESCHWINDIGKEIT": "speed",
    "LAUFFLAECHENTEMPERATUR": "tread_temperature",
    "REIFENTEMPERATUR": "tire_temperature",
    "FAHRBAHNTEMPERATUR": "road_temperature",
    "UMGEBUNGSTEMPERATUR": "ambient_temperature",
    "DREHZAHL": "omega",
    "RADDREHZAHL": "omega",
    "WHEELLOAD": "Fz",
    "VERTICALLOAD": "Fz",
    "VERTICALFORCE": "Fz",
    "NORMALFORCE": "Fz",
    "LATERALFORCE": "Fy",
    "SIDEFORCE": "Fy",
    "LONGITUDINALFORCE": "Fx",
    "OVERTURNINGMOMENT": "Mx",
    "ALIGNINGTORQUE": "Mz",
    "ALIGNINGMOMENT": "Mz",
    "SELFALIGNINGTORQUE": "Mz",
    "CAMBERANGLE": "camber",
    "INCLINATIONANGLE": "camber",
    "LONGITUDINALSLIP": "slip_ratio",
    "INFLATIONPRESSURE": "pressure",
    "INFLPRESSURE": "pressure",
    "TIREPRESSURE": "pressure",
    "TYREPRESSURE": "pressure",
    "BELTSPEED": "speed",
    "ROADSPEED": "speed",
    "DRUMSPEED": "speed",
    "VELOCITY": "speed",
    "INDEXPULSE": "trigger",
}
"""Column names of the field in capitals, without blanks and lines, and their quantities; umlauts as
two letters."""
GAGE_NAME = re.compile(r"(?:SG|DMS|GAGE|GAUGE|STRAIN|STRAINGAGE|STRAINGAUGE)0*([1-9]\d?)")
"""Names of strain gages, of which each has a number."""
RUN_NAMES = ("RUN", "RUNNO", "RUNNUMBER", "TEST", "TESTNO", "TESTNUMBER", "MESSUNG", "VERSUCH")
"""Names of a column that numbers the runs, written as those of `KNOWN_NAMES`."""
SET_POINTS: Mapping[str, tuple[str, float]] = {
    "load_N": ("Fz", 100.0),
    "pressure_bar": ("pressure", 0.1),
    "speed_kmh": ("speed", 1.0),
    "slip_angle_deg": ("slip_angle", 0.5),
    "camber_deg": ("camber", 0.5),
    "slip_ratio": ("slip_ratio", 0.005),
}
"""Set points of steady runs: the quantity whose mean they are, and the step of rounding."""
LENGTHS = ("ring_radius_m", "tread_thickness_m", "belt_width_m", "innerliner_offset_m")
"""Lengths of a tire that a ring is fitted with."""
CONSTANT = ("pressure", "speed")
"""Quantities that a rig may hold; anything else that never changes was not connected."""
HELD = ("time", "slip_angle", "camber")
"""Quantities that are mapped whatever they hold: other files may have them at other values."""
ROLLING = (0.05, 3.0)
"""Radius at which any wheel rolls, m: that of a kart's wheel is .13, of an earth mover's 1.9."""
_UMLAUTS = str.maketrans({"\u00c4": "AE", "\u00d6": "OE", "\u00dc": "UE"})


@dataclass(frozen=True, slots=True)
class ColumnSummary:
    """A column at a glance.

    Attributes
    ----------
    name, unit : str
        As the file has them.
    rows : int
    low, high : float
        Extremes of the finite values, in the file's own unit; NaN when there are none.
    middle : float
        Median of their magnitudes.
    missing : int
        Values that are NaN or infinite.
    quantity : str
        What the name is taken for; empty when it is not known.
    """

    name: str
    unit: str
    rows: int
    low: float
    high: float
    middle: float
    missing: int
    quantity: str


def list_columns(
    path: str | Path, options: CsvOptions | None = None
) -> tuple[Table, list[ColumnSummary]]:
    """Return the table of a file and a summary of each column.

    Parameters
    ----------
    path : str or Path
    options : CsvOptions, optional
        For text tables that do not show their layout.

    Raises
    ------
    FormatError
        If the file cannot be read.
    """
    table = read_table(Path(path), options)
    return table, [_summary(column) for column in table.columns.values()]


def _summary(column: Column) -> ColumnSummary:
    finite = column.values[np.isfinite(column.values)]
    ends = (finite.min(), finite.max(), np.median(np.abs(finite))) if finite.size else [np.nan] * 3
    low, high, middle = map(float, ends)
    missing, quantity = column.values.size - finite.size, quantity_of(column.name)
    rows = column.values.size
    return ColumnSummary(column.name, column.unit, rows, low, high, middle, missing, quantity)


def quantity_of(name: str) -> str:
    """Return the quantity that a column name is known to mean, empty when it is not.

    Examples
    --------
    >>> quantity_of("SA"), quantity_of("speed [km/h]"), quantity_of("strain_2"), quantity_of("X7")
    ('slip_angle', 'speed', 'strain_2', '')
    >>> quantity_of("Slip angle [deg]"), quantity_of("SG1 [um/m]"), quantity_of("Wheel load [kN]")
    ('slip_angle', 'strain_1', 'Fz')
    >>> quantity_of("Fz_N"), quantity_of("slip_angle_deg"), quantity_of("t_s")
    ('Fz', 'slip_angle', 'time')
    """
    bare = _bare(name)
    own = {quantity.casefold(): quantity for quantity in QUANTITIES if quantity != "load"}
    if bare.casefold() in own:
        return own[bare.casefold()]
    if strain_number(bare.casefold()) is not None or bare.endswith("_temperature"):
        return bare.casefold()
    plain = _plain(bare)
    if gage := GAGE_NAME.fullmatch(plain):
        return f"strain_{gage[1]}"
    joined = {_plain(quantity): quantity for quantity in own.values()}
    found = KNOWN_NAMES.get(plain, joined.get(plain, ""))
    head, _, unit = bare.rpartition("_")
    return quantity_of(head) if not found and head and dimensions_of_unit(unit) else found


def _bare(name: str) -> str:
    """Return a name without its unit and the groups that it stands in."""
    return re.sub(r"\s*[\[(].*[\])]$", "", name).rpartition(".")[2].rpartition("/")[2].strip()


def _plain(bare: str) -> str:
    """Return a name in capitals, umlauts as two letters, without blanks, lines and dots."""
    return re.sub(r"[\s_.-]", "", bare.upper().translate(_UMLAUTS))


def _numbers_runs(item: ColumnSummary, values: FloatArray) -> bool:
    """Whether a column numbers runs: by its name, and by whole numbers that never go back."""
    steps = np.diff(values)
    return bool(
        _plain(_bare(item.name)) in RUN_NAMES
        and np.all(values == np.round(values))
        and (steps >= 0.0).all()
        and (steps > 0.0).any()
    )


def suggest_map(path: str | Path, options: CsvOptions | None = None) -> str:
    """Return the draft of a map for a file, as TOML.

    Axes are guessed from the sign of Fz and of Fy against the slip angle, and marked as a guess; a
    unit that the file does not state stays empty, and the import then asks for it.

    Parameters
    ----------
    path : str or Path
    options : CsvOptions, optional
        For text tables that do not show their layout.

    Raises
    ------
    FormatError
        If the file cannot be read.
    """
    table, summaries = list_columns(path, options)
    known: dict[str, ColumnSummary] = {}
    others: list[tuple[ColumnSummary, str]] = []
    for item in summaries:
        steady = item.quantity in HELD or (item.quantity in CONSTANT and item.low != 0.0)
        useless = item.low == item.high and not steady and item.rows > 1
        if not item.quantity:
            others.append((item, ""))
        elif useless:
            others.append((item, "it never changes, as a channel that was not connected"))
        elif item.quantity in known:
            others.append((item, f"{_quoted(known[item.quantity].name)} is mapped"))
        else:
            known[item.quantity] = item
    others += [(known.pop(name), "no wheel rolls at this speed") for name in _impossible(known)]
    axes, reason = _guessed_axes(table, known)
    strains = [quantity for quantity in known if strain_number(quantity) is not None]
    lines = [
        f'format = "{FORMAT}"',
        f'axes = "{axes}"  # {reason}',
        f"name = {_quoted(Path(path).stem)}",
        'kind = "free"  # steady straight runs; others: corner, camber, brake, drive, combined'
        if strains
        else 'kind = "sweep"  # or the kind of steady runs, with [set_points]',
        *[
            f"run_column = {_quoted(item.name)}  # a guess: each of its numbers is a run"
            for item, _ in others
            if _numbers_runs(item, table.columns[item.name].values)
        ][:1],
        "",
        "[tire]",
        "# free_radius_m = ...  # required",
    ]
    if strains:
        lines += [
            *(f"# {name} = ...  # required by identify" for name in LENGTHS),
            "",
            "[gages]",
            f"# lateral_m = [...]  # required: {len(strains)} positions",
            "",
            "[set_points]",
            *(_set_point_line(name, known) for name in SET_POINTS),
        ]
    lines.append("")
    lines.append("[channels]")
    lines += [
        _channel_line(quantity, item)
        for quantity, item in known.items()
        if strains or not is_gage(quantity)
    ]
    for item, reason in others:
        said = f"# {_quoted(item.name)}: {item.low:g} .. {item.high:g} {item.unit}".rstrip()
        lines.append(said + (f"; known as {item.quantity}, but {reason}" if reason else ""))
    lines += [f"# {_quoted(name)} is left out: {why}" for name, why in table.left_out.items()]
    return "\n".join([*lines, ""])


def _impossible(known: Mapping[str, ColumnSummary]) -> list[str]:
    """Return quantities at which no wheel rolls: an encoder that is broken or was not connected."""
    names = ("speed", "omega", "effective_radius")
    speed, omega, radius = (_middle(known[name]) if name in known else np.nan for name in names)
    rolls = {"omega": speed / omega if omega else np.inf, "effective_radius": radius}
    return [name for name, at in rolls.items() if name in known and not _wheel(at) and speed > 0.0]


def _wheel(radius: float) -> bool:
    return bool(np.isnan(radius) or ROLLING[0] < radius < ROLLING[1])


def _middle(item: ColumnSummary) -> float:
    """Return the median of the magnitudes in SI; NaN where the file does not state the unit."""
    dimension = dimension_of(item.quantity) or ""
    stated = dimension in dimensions_of_unit(item.unit)
    return to_si(item.middle, item.unit, dimension) if stated else np.nan


def _set_point_line(name: str, known: Container[str]) -> str:
    quantity, step = SET_POINTS[name]
    if quantity in known:
        return f"{name} = {{ mean_to = {step:g} }}  # the run's mean of {quantity}, rounded"
    if name in ("load_N", "pressure_bar", "speed_kmh"):
        return f"# {name} = ...  # required, or a channel {quantity} and {{ mean_to = {step:g} }}"
    return f"{name} = 0.0  # the file has no {quantity}"


def _channel_line(quantity: str, item: ColumnSummary) -> str:
    dimension = dimension_of(quantity) or ""
    stated = item.unit or ("1" if quantity == "trigger" else "")  # a pulse has no unit
    fits = dimension in dimensions_of_unit(stated)
    unit = stated if fits else ""
    hint = "" if fits else f"state the unit of this {dimension}, "
    return (
        f"{quantity} = {{ column = {_quoted(item.name)}, unit = {_quoted(unit)} }}"
        f"  # {hint}{item.low:g} .. {item.high:g}"
    )


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _guessed_axes(table: Table, known: Mapping[str, ColumnSummary]) -> tuple[str, str]:
    """Return the axis system that the signs fit (empty if not exactly one), and the reason."""
    load, force, angle = (_values(table, known, name) for name in ("Fz", "Fy", "slip_angle"))
    if load is None:
        return (
            "",
            "required: iso, sae or adapted_sae; no column is known as Fz, whose sign would show it",
        )
    if float(np.nanmedian(load)) < 0.0:
        return "sae", "a guess: Fz is negative; check it"
    if force is None or angle is None or force.size != angle.size:
        return "", "required: iso or adapted_sae; Fz is positive, Fy or slip angle is missing"
    agreement = float(np.nansum(np.sign(force) * np.sign(angle)))
    if abs(agreement) < 0.5 * force.size:
        return (
            "",
            "required: iso or adapted_sae; the signs of Fy and slip angle do not agree on one",
        )
    if agreement < 0.0:
        return "iso", "a guess: Fz > 0, Fy and slip angle have opposite signs; check it"
    return "adapted_sae", "a guess: Fz > 0, Fy and slip angle have the same sign; check it"


def _values(table: Table, known: Mapping[str, ColumnSummary], quantity: str) -> FloatArray | None:
    item = known.get(quantity)
    return None if item is None else table.columns[item.name].values
