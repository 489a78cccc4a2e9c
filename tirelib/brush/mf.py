"""The Magic Formula of whatever version a property file has."""

import numpy.typing as npt

from tirelib.brush.mf6 import magic_forces_6
from tirelib.brush.mf52 import magic_forces_5
from tirelib.brush.mf_tire import MagicForces, MagicTire
from tirelib.errors import ParameterError


def magic_forces(
    tire: MagicTire,
    load: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike = 0.0,
    camber: npt.ArrayLike = 0.0,
    pressure: npt.ArrayLike | None = None,
    *,
    combined: bool = True,
) -> MagicForces:
    """Return steady-state Fx, Fy, Mz; arguments as `magic_forces_6`.

    Raises
    ------
    ParameterError
        If a pressure is given to a tire of version 5, or an input is out of range.
    """
    if tire.fit_type in (60, 61, 62):
        return magic_forces_6(
            tire, load, slip_angle, slip_ratio, camber, pressure, combined=combined
        )
    if pressure is not None:
        raise ParameterError(
            f"fit type {tire.fit_type} has no pressure terms; leave the pressure out or use an MF "
            "6.1 file"
        )
    return magic_forces_5(tire, load, slip_angle, slip_ratio, camber, combined=combined)
