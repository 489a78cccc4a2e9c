"""Units of a tire property file: what its [UNITS] words mean and which keys they rule.

Magic Formula coefficients have no unit (their angles are radians whatever [UNITS] says); only
dimensions, loads, pressures, speeds, ranges and structural data have.
"""

from collections.abc import Mapping
from types import MappingProxyType

from tirelib.core.units import to_si

BASES = ("length", "force", "angle", "mass", "time", "pressure")

_WORDS: Mapping[str, Mapping[str, str]] = {
    "length": {
        "meter": "m",
        "meters": "m",
        "metre": "m",
        "m": "m",
        "mm": "mm",
        "millimeter": "mm",
        "cm": "cm",
        "centimeter": "cm",
        "inch": "in",
        "in": "in",
        "foot": "ft",
        "feet": "ft",
        "ft": "ft",
    },
    "force": {
        "newton": "N",
        "newtons": "N",
        "n": "N",
        "kilonewton": "kN",
        "kilo_newton": "kN",
        "kn": "kN",
        "pound": "lbf",
        "pound_force": "lbf",
        "lbf": "lbf",
        "lb": "lbf",
        "kilogram_force": "kgf",
        "kg_force": "kgf",
        "kgf": "kgf",
    },
    "angle": {
        "radian": "rad",
        "radians": "rad",
        "rad": "rad",
        "degree": "deg",
        "degrees": "deg",
        "deg": "deg",
    },
    "time": {
        "second": "s",
        "seconds": "s",
        "sec": "s",
        "s": "s",
        "millisecond": "ms",
        "ms": "ms",
        "minute": "min",
        "min": "min",
        "hour": "h",
        "h": "h",
    },
    "pressure": {
        "pascal": "Pa",
        "pa": "Pa",
        "n/m2": "Pa",
        "n/m^2": "Pa",
        "hpa": "hPa",
        "mbar": "mbar",
        "kilopascal": "kPa",
        "kpascal": "kPa",
        "kpa": "kPa",
        "bar": "bar",
        "mpa": "MPa",
        "psi": "psi",
    },
    "mass": {
        "kg": "kg",
        "kilogram": "kg",
        "gram": "g",
        "g": "g",
        "tonne": "tonne",
        "lb": "lb",
        "pound_mass": "lb",
        "lbm": "lb",
        "slug": "slug",
    },
}

Powers = tuple[int, int, int, int, int, int]


def _powers(**exponents: int) -> Powers:
    length, force, angle, mass, time, pressure = (exponents.get(base, 0) for base in BASES)
    return length, force, angle, mass, time, pressure


_KEYS: Mapping[Powers, str] = {
    _powers(length=1): "UNLOADED_RADIUS WIDTH RIM_RADIUS RIM_WIDTH BOTTOM_OFFST ROAD_INCREMENT "
    "EFFECTIVE_RADIUS",
    _powers(force=1): "FNOMIN FZMIN FZMAX",
    _powers(pressure=1): "INFLPRES NOMPRES PRESMIN PRESMAX IP IP_NOM",
    _powers(length=1, time=-1): "LONGVL VXLOW VXMIN VXMAX",
    _powers(angle=1): "ALPMIN ALPMAX CAMMIN CAMMAX",
    _powers(mass=1): "MASS BELT_MASS",
    _powers(mass=1, length=2): "IXX IYY BELT_IXX BELT_IYY",
    _powers(length=1, time=-2): "GRAVITY",
    _powers(force=1, length=-1): "VERTICAL_STIFFNESS BOTTOM_STIFF LONGITUDINAL_STIFFNESS "
    "LATERAL_STIFFNESS",
    _powers(force=1, length=-1, time=1): "VERTICAL_DAMPING",
    _powers(force=1, length=1, angle=-1): "YAW_STIFFNESS",
}

POWERS: Mapping[str, Powers] = MappingProxyType(
    {key: powers for powers, keys in _KEYS.items() for key in keys.split()}
)
"""Exponents of (length, force, angle, mass, time, pressure) for every key that has a unit."""


def words(base: str) -> tuple[str, ...]:
    """Return the words that a file may write for a base unit."""
    return tuple(_WORDS[base])


def factor(base: str, word: str) -> float | None:
    """Return SI per unit of a base, or None for an unknown word."""
    unit = _WORDS[base].get(word.strip().lower().replace(" ", "_"))
    return None if unit is None else to_si(1.0, unit, base)


def scale_of(key: str, factors: Mapping[str, float]) -> float:
    """Return SI per file unit of a key, 1 for a key without unit."""
    powers = POWERS.get(key)
    scale = 1.0
    if powers is not None:
        for base, power in zip(BASES, powers, strict=True):
            scale *= factors[base] ** power
    return scale
