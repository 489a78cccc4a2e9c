"""What an FMU says in SI of a turn out of range, in the units of the bench's options."""

import re

from tirelib.core.units import from_si

_UNITS = {
    "Pa": ("bar", "pressure", "pascal"),
    "m/s": ("km/h", "speed", "metres per second"),
    "rad": ("deg", "angle", "radians"),
    "m": ("mm", "length", "metres"),
    "K": ("degC", "temperature", "kelvin"),
}
"""By the unit in the FMU's text: that of the options, its dimension, and the word for the first."""
_RANGE = re.compile(
    r"\[(?P<unit>[^\]]+)\] = (?P<value>\S+); (?P<words>[a-z ]+) (?P<low>\S+) \.\. (?P<high>[^;]+);"
)


def in_options_units(text: str) -> str:
    """Return a remark with values and unit as the options have them; other texts as they are.

    Examples
    --------
    >>> in_options_units("camber [rad] = 0.1; allowed are 0 .. 0.01; give it in radians")
    'camber [deg] = 5.73; allowed are 0 .. 0.573; give it in deg'
    """
    found = _RANGE.search(text)
    if found is None or found["unit"] not in _UNITS:
        return text
    unit, dimension, word = _UNITS[found["unit"]]
    numbers = (found[name] for name in ("value", "low", "high"))
    try:
        value, low, high = (f"{from_si(float(x), unit, dimension):.3g}" for x in numbers)
    except ValueError:
        return text
    said = f"[{unit}] = {value}; {found['words']} {low} .. {high};"
    return text[: found.start()] + said + text[found.end() :].replace(f"in {word}", f"in {unit}")
