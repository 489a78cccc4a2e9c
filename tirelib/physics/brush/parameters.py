"""Parameters of the brush; every number may be one per operating point."""

from dataclasses import dataclass, field, fields

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError


@dataclass(frozen=True, slots=True, eq=False)
class Carcass:
    r"""Stiffness of the belt's lateral line in the contact; infinite is rigid.

    .. math:: y_b(x) = -\frac{F_y}{2 C_{bend}} x^2 + \frac{M_z}{C_{yaw}} x + \frac{F_y}{C_{lat}}

    This is Eq. (2) with the bending term's sign turned: a belt that is pushed sideways in the
    contact bulges in the direction of the push, most in the middle. With the printed sign and a
    positive stiffness, a softer belt would raise the cornering stiffness.

    Attributes
    ----------
    lateral : array_like, [N/m]
        Lateral shift of the contact under Fy; it gives the longitudinal force an arm.
    yaw : array_like, [N m/rad]
        Turn of the contact under the aligning moment; it lowers the effective slip angle.
    bend : array_like, [N m]
        Curvature of the contact under Fy; it lowers the slip at the leading edge.
    """

    lateral: npt.ArrayLike = np.inf
    yaw: npt.ArrayLike = np.inf
    bend: npt.ArrayLike = np.inf

    def __post_init__(self) -> None:
        for part in fields(self):
            value = _array(getattr(self, part.name))
            if not np.all(value > 0.0):
                raise ParameterError(
                    f"carcass {part.name} stiffness = {_range(value)}; it must be > 0 "
                    "(infinite for a rigid carcass)"
                )
            object.__setattr__(self, part.name, value)


@dataclass(frozen=True, slots=True, eq=False)
class BrushParameters:
    """Bristles, friction and carcass of one tire, at one or many operating points.

    Attributes
    ----------
    lateral_stiffness : array_like, [N/m^2]
        c_py: force per length of contact and per deflection, > 0; `bristle_stiffness` makes it
        from the cornering stiffness.
    friction : array_like
        mu up to which a bristle sticks, >= 0.
    longitudinal_stiffness : array_like, [N/m^2], optional
        c_px; by default as lateral.
    sliding_friction : array_like, optional
        mu of a sliding bristle, at most `friction`; by default equal to it.
    carcass : Carcass
        Rigid by default.
    """

    lateral_stiffness: npt.ArrayLike
    friction: npt.ArrayLike
    longitudinal_stiffness: npt.ArrayLike | None = None
    sliding_friction: npt.ArrayLike | None = None
    carcass: Carcass = field(default_factory=Carcass)

    def __post_init__(self) -> None:
        if self.longitudinal_stiffness is None:
            object.__setattr__(self, "longitudinal_stiffness", self.lateral_stiffness)
        if self.sliding_friction is None:
            object.__setattr__(self, "sliding_friction", self.friction)
        for name in ("lateral_stiffness", "longitudinal_stiffness"):
            value = _array(getattr(self, name))
            if not np.all(np.isfinite(value) & (value > 0.0)):
                raise ParameterError(f"{name} = {_range(value)} N/m^2; it must be finite and > 0")
            object.__setattr__(self, name, value)
        for name in ("friction", "sliding_friction"):
            value = _array(getattr(self, name))
            if not np.all(np.isfinite(value) & (value >= 0.0)):
                raise ParameterError(f"{name} = {_range(value)}; it must be finite and >= 0")
            object.__setattr__(self, name, value)
        if not np.all(_array(self.sliding_friction) <= _array(self.friction)):
            raise ParameterError(
                "sliding_friction exceeds friction; a bristle that slides cannot hold more than "
                "one that sticks; lower it"
            )


def _array(value: npt.ArrayLike | None) -> FloatArray:
    return np.asarray(value, dtype=np.float64)


def _range(values: FloatArray) -> str:
    if values.size == 1:
        return f"{float(values.ravel()[0]):.6g}"
    return f"{float(values.min()):.6g} .. {float(values.max()):.6g}"
