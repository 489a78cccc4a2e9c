"""A tire of the Magic Formula from a property file (.tir), and the file of a fitted one.

A written file is of version 6.1 and holds every coefficient of it, those that were not fitted with
the value that changes nothing: other programs differ in what they take an absent one to be. SI
units, axes ISO 8855 (TYDEX W); errors and range of the fit are comments.
"""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.parameters.tir import TirEntry, TirFile, TirLine, TirSection
from tirelib.core.quantities import QUANTITIES
from tirelib.core.version import __version__
from tirelib.inference.magic.fit import MagicFit
from tirelib.physics.brush.mf_tire import LIMITS, NAME, Coefficients, MagicTire, impossible

REQUIRED = ("PCX1", "PDX1", "PKX1", "PCY1", "PDY1", "PKY1", "PKY2")
"""Without these there is no curve at all; every other absent coefficient is neutral."""
SECTIONS = (
    "SCALING_COEFFICIENTS",
    "LONGITUDINAL_COEFFICIENTS",
    "LATERAL_COEFFICIENTS",
    "ALIGNING_COEFFICIENTS",
    "OVERTURNING_COEFFICIENTS",
    "ROLLING_COEFFICIENTS",
    "TURNSLIP_COEFFICIENTS",
    "VERTICAL",
    "STRUCTURAL",
)
"""Sections whose coefficients are the tire's; all others are the vendor's own."""
UNITS = {
    "LENGTH": "meter",
    "FORCE": "newton",
    "ANGLE": "radians",
    "MASS": "kg",
    "TIME": "second",
    "PRESSURE": "Pa",
}
RANGES = {
    "load": "VERTICAL_FORCE_RANGE",
    "slip_ratio": "LONG_SLIP_RANGE",
    "slip_angle": "SLIP_ANGLE_RANGE",
    "camber": "INCLINATION_ANGLE_RANGE",
    "pressure": "INFLATION_PRESSURE_RANGE",
}
COEFFICIENTS = {
    "SCALING_COEFFICIENTS": "LFZO LCX LMUX LEX LKX LHX LVX LXAL LCY LMUY LEY LKY LKYC LHY LVY LYKA "
    "LVYKA LTR LRES LS LKZC",
    "LONGITUDINAL_COEFFICIENTS": "PCX1 PDX1 PDX2 PDX3 PEX1 PEX2 PEX3 PEX4 PKX1 PKX2 PKX3 PHX1 PHX2 "
    "PVX1 PVX2 PPX1 PPX2 PPX3 PPX4 RBX1 RBX2 RBX3 RCX1 REX1 REX2 RHX1",
    "LATERAL_COEFFICIENTS": "PCY1 PDY1 PDY2 PDY3 PEY1 PEY2 PEY3 PEY4 PEY5 PKY1 PKY2 PKY3 PKY4 PKY5 "
    "PKY6 PKY7 PHY1 PHY2 PVY1 PVY2 PVY3 PVY4 PPY1 PPY2 PPY3 PPY4 PPY5 RBY1 RBY2 RBY3 RBY4 RCY1 "
    "REY1 REY2 RHY1 RHY2 RVY1 RVY2 RVY3 RVY4 RVY5 RVY6",
    "ALIGNING_COEFFICIENTS": "QBZ1 QBZ2 QBZ3 QBZ4 QBZ5 QBZ9 QBZ10 QCZ1 QDZ1 QDZ2 QDZ3 QDZ4 QDZ6 "
    "QDZ7 QDZ8 QDZ9 QDZ10 QDZ11 QEZ1 QEZ2 QEZ3 QEZ4 QEZ5 QHZ1 QHZ2 QHZ3 QHZ4 SSZ1 SSZ2 SSZ3 SSZ4 "
    "PPZ1 PPZ2",
}


def magic_tire(tire: TirFile) -> MagicTire:
    """Return the Magic Formula tire of a property file.

    Coefficients come from `SECTIONS` only.

    Raises
    ------
    FormatError
        Naming every missing, contradictory or impossible entry.
    """
    problems: list[str] = []
    values = _coefficients(tire, problems)
    for name in (name for name in REQUIRED if name not in values):
        elsewhere = ", ".join(f"[{section}]" for section, _ in tire.places(name))
        hint = f"; what {elsewhere} has is not read, [..._COEFFICIENTS] is" if elsewhere else ""
        problems.append(f"{name} is missing; the Magic Formula needs it{hint}")
    problems += impossible(values)

    def number(key: str) -> float | None:
        try:
            return tire.number(key)
        except ParameterError as error:
            problems.append(str(error))
            return None

    found = {key: number(key) for key in ("UNLOADED_RADIUS", "FNOMIN", "NOMPRES", "INFLPRES")}
    for key in ("UNLOADED_RADIUS", "FNOMIN", "NOMPRES"):
        value = found[key]
        if (value is None and key != "NOMPRES") or (value is not None and not value > 0.0):
            problems.append(f"{key} = {value}; it must be given and > 0")
    if found["NOMPRES"] is None and any(v != 0.0 for n, v in values.items() if n[:2] == "PP"):
        problems.append("NOMPRES is missing; the pressure coefficients PP.. refer to it")
    limits = {}
    for name, keys in LIMITS.items():
        low, high = (number(key) for key in keys)
        if (low, high) != (None, None):
            limits[name] = (-np.inf if low is None else low, np.inf if high is None else high)
    if problems:
        raise FormatError([f"{tire.where}: {problem}" for problem in problems])
    return MagicTire(
        tire.fit_type,
        Coefficients(values),
        float(found["UNLOADED_RADIUS"] or 0.0),
        float(found["FNOMIN"] or 0.0),
        found["NOMPRES"],
        found["INFLPRES"],
        MappingProxyType(limits),
    )


def _coefficients(tire: TirFile, problems: list[str]) -> dict[str, float]:
    """Return the coefficients of the sections that hold the tire's."""
    found: dict[str, tuple[str, float]] = {}
    for section in tire.sections:
        if section.name.upper() not in SECTIONS:
            continue
        for entry in section.entries:
            key = entry.key.upper()
            if not isinstance(entry.value, float) or not NAME.fullmatch(key):
                continue
            place, value = found.setdefault(key, (section.name, entry.value))
            if value != entry.value:
                problems.append(
                    f"{key} = {value:g} in [{place}] but {entry.value:g} in [{section.name}]; one "
                    "value is needed; remove the other"
                )
    return {key: value for key, (_, value) in found.items()}


def tir_of(fit: MagicFit, source: str) -> TirFile:
    """Return the property file of a fit.

    Parameters
    ----------
    fit : MagicFit
    source : str
        What was fitted, in words.
    """
    tire = fit.tire
    sections = [
        TirSection("UNITS", tuple(TirEntry(key, word) for key, word in UNITS.items())),
        _numbers("MODEL", [("FITTYP", 61.0)]),
        _numbers("DIMENSION", [("UNLOADED_RADIUS", tire.radius)]),
    ]
    if tire.nominal_pressure is not None:
        pressures = [("INFLPRES", tire.nominal_pressure), ("NOMPRES", tire.nominal_pressure)]
        sections.append(_numbers("OPERATING_CONDITIONS", pressures))
    sections.append(_numbers("VERTICAL", [("FNOMIN", tire.nominal_load)]))
    for name, ends in tire.limits.items():
        sections.append(_numbers(RANGES[name], list(zip(LIMITS[name], ends, strict=True))))
    for section, names in COEFFICIENTS.items():
        sections.append(
            TirSection(
                section,
                tuple(
                    TirEntry(name, float(getattr(tire.coefficients, name)), _note(fit, name))
                    for name in names.split()
                ),
            )
        )
    return TirFile(
        tuple(sections), tuple(TirLine(f"! {line}".rstrip()) for line in words(fit, source)), 61
    )


def words(fit: MagicFit, source: str) -> list[str]:
    """Return what the file says of the fit, a line each."""
    lines = [
        f"Magic Formula 6.1, fitted by tirelib {__version__} to {source}.",
        "SI units; axes ISO 8855 (TYDEX W): a positive slip angle gives a negative Fy.",
        "",
        "Error of the formula against what it was fitted to:",
    ]
    for name, error in fit.errors.items():
        unit = "N m" if name == "Mz" else "N"
        share = f"{100.0 * error.rms / error.peak:.2g} % of" if error.peak else "against"
        lines.append(
            f"  {name}: rms {error.rms:.3g} {unit}, {share} the largest ({error.peak:.4g} {unit}); "
            f"at most {error.largest:.3g} {unit}; {error.points} points"
        )
    lines += ["", "Range of these points; outside of it the formula extrapolates:"]
    for name, ends in fit.tire.limits.items():
        quantity = QUANTITIES[name]
        low, high = map(quantity.told, ends)
        lines.append(f"  {quantity.title}: {low:.4g} .. {high:.4g} {quantity.words}".rstrip())
    for name in ("Fx", "Mz"):
        if name not in fit.errors:
            lines.append(f"No point has {name}: the file does not describe it.")
    if fit.assumed:
        lines.append(
            "The formula needs numbers of Fx, which no point informs; they are assumed: "
            + ", ".join(f"{name} from {origin}" for name, origin in fit.assumed.items())
            + "."
        )
    if fit.at_limit:
        lines.append(
            f"These coefficients ended at a limit of the fit: {', '.join(fit.at_limit)}; the "
            "points do not determine them."
        )
    return lines


def _numbers(name: str, entries: Sequence[tuple[str, float]]) -> TirSection:
    return TirSection(name, tuple(TirEntry(key, float(value)) for key, value in entries))


def _note(fit: MagicFit, name: str) -> str:
    if name in fit.assumed:
        return f" assumed: {fit.assumed[name]}"
    return " fitted" if name in fit.fitted else ""
