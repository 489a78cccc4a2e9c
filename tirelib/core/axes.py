"""Axis systems and the named converters between them.

Inside the library everything is ISO 8855 (TYDEX W): x forward, y left, z up, Fz > 0, a positive
slip angle gives a negative Fy, a braked wheel has kappa < 0.

- ``iso``: the inside.
- ``sae``: SAE J670, z down: flips Fy, Mz, slip angle, lateral position and the sign of Fz.
- ``adapted_sae``: Pacejka's: flips Fy, Mz and lateral position; a positive slip angle gives a
  positive Fy and Fz stays positive.

Every conversion is its own inverse.
"""

from collections.abc import Mapping
from types import MappingProxyType

from tirelib.core.errors import ParameterError

FLIPPED: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "iso": frozenset(),
        "sae": frozenset({"Fy", "Mz", "slip_angle", "lateral", "Fz"}),
        "adapted_sae": frozenset({"Fy", "Mz", "lateral"}),
    }
)
"""Quantities whose sign differs from ISO, for each axis system."""


def sign(quantity: str, axes: str) -> float:
    """Return the factor, +1 or -1, between `axes` and ISO for a quantity.

    Parameters
    ----------
    quantity : str
        Name as in a campaign: ``Fy``, ``Fz``, ``Mz``, ``slip_angle``, ``lateral``, ...
    axes : str
        ``iso``, ``sae`` or ``adapted_sae``.

    Raises
    ------
    ParameterError
        If the axis system is unknown.

    Examples
    --------
    >>> sign("Fy", "adapted_sae"), sign("slip_angle", "adapted_sae"), sign("Fz", "sae")
    (-1.0, 1.0, -1.0)
    """
    try:
        flipped = FLIPPED[axes]
    except KeyError:
        raise ParameterError(
            f"axes = {axes!r}; allowed are {', '.join(sorted(FLIPPED))}; "
            "name the axis system of the data"
        ) from None
    return -1.0 if quantity in flipped else 1.0
