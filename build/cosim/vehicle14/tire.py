"""Tires of the vehicle: the brush of the library, with constants that change with the load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from tirelib.core.arrays import FloatArray

NOMINAL = 4000.0
"""Load that the constants refer to [N]."""
NAMES = (
    "mu",
    "mu_load",
    "C_y",
    "C_y_top",
    "C_x",
    "C_x_power",
    "a",
    "camber",
    "camber_load",
    "rolling",
)
FORMAT = "tirelib-vehicle-tire/1"
LEAST_LOAD = 1.0
"""Load below which a tire has no force [N]."""


@dataclass(frozen=True)
class BrushTires:
    """The brush under a parabola, with friction and stiffness that change with the load.

    With n = Fz / 4 kN: mu = mu_0 + mu_load (n - 1), C_y = C_y0 sin(2 atan(n / top)) /
    sin(2 atan(1 / top)), C_x = C_x0 n^power, a = a_0 sqrt(n); the bristles have C / (2 a^2).

    Attributes
    ----------
    constants : mapping
        By `NAMES`; SI.
    law : module
        `tirelib.physics.brush.predict`, or the copy of it that an FMU carries.
    """

    constants: Mapping[str, float]
    law: Any

    def forces(
        self,
        load: FloatArray,
        alpha: FloatArray,
        kappa: FloatArray,
        camber: FloatArray,
        friction: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return Fx, Fy [N] and Mz [N m]; a wheel without load has none.

        Parameters
        ----------
        load : array, [N]
        alpha, camber : array, [rad]
        kappa : array
            (Omega R_e - v_x) / v_x with the speed in the wheel's plane.
        friction : array
            Scale of the road's friction, 1: as the constants say.
        """
        c = self.constants
        n = np.maximum(load, LEAST_LOAD) / NOMINAL
        a = c["a"] * np.sqrt(n)
        top = c["C_y_top"]
        shape = 2.0 / (1.0 / top + top)  # sin(2 atan(1 / top))
        across = c["C_y"] * (2.0 / (n / top + top / n)) / shape
        bristle = 0.5 / a**2
        brush = self.law.PointParameters(
            lateral_stiffness=across * bristle,
            friction=friction * (c["mu"] + c["mu_load"] * (n - 1.0)),
            half_length=a,
            longitudinal_stiffness=c["C_x"] * n ** c["C_x_power"] * bristle,
            camber_thrust=c["camber"] + c["camber_load"] * (n - 1.0),
            Fx_offset=c["rolling"] * n * NOMINAL,
        )
        found = self.law.predict_forces(
            brush, self.law.PointConditions(n * NOMINAL, alpha, kappa, camber)
        )
        on = load > LEAST_LOAD
        return found.Fx * on, found.Fy * on, found.Mz * on


def tires_of(document: Mapping[str, Any], law: Any) -> BrushTires:
    """Return the tires of a file's content.

    Raises
    ------
    ValueError
        If it is no such file, or a number is missing.
    """
    if document.get("format") != FORMAT:
        raise ValueError(
            f"format = {document.get('format')!r}; allowed is {FORMAT!r}; make the file with "
            "build/cosim/vehicle14/fit_tire.py"
        )
    constants = document.get("constants", {})
    missing = [name for name in NAMES if not isinstance(constants.get(name), float)]
    if missing:
        raise ValueError(f"constants: {', '.join(missing)} missing; give every one as a number")
    return BrushTires({name: constants[name] for name in NAMES}, law)
