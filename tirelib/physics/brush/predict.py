r"""Forces of the brush under a parabolic pressure, in closed form, every constant per point.

For many samples at a time: a campaign's sweeps, and models in which any constant of the brush
changes with the conditions. With a half the contact length, D the size of the bristles' demand per
distance from the leading edge, and t = 2 D a^2 / (3 mu Fz), at most 1, the front share 1 - t of the
contact sticks and

.. math:: F_{stick} = 2 a^2 (1 - t)^2 D, \qquad F_{slide} = \mu_s F_z\, t^2 (3 - 2 t)

Adhesion acts along the demand (c_px kappa, -c_py tan alpha), sliding against the slip. Without
longitudinal slip these are Eq. (3) and (4) of the dissertation, corrected. Axes ISO 8855.

`tirelib.physics.brush.forces` has the same laws for any pressure; the two agree to rounding.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError, ShapeError

MOST_ITERATIONS = 40
TOLERANCE = 1e-10
"""Residual of the balance with a compliant carcass, relative to mu Fz a."""


@dataclass(frozen=True, slots=True, eq=False)
class PointParameters:
    """Constants of the brush; each is one number or one per point.

    Attributes
    ----------
    lateral_stiffness : array_like, [N/m^2]
        c_py, > 0.
    friction : array_like
        mu up to which a bristle sticks, > 0.
    half_length : array_like, [m]
        a, half the contact length, > 0.
    longitudinal_stiffness : array_like, [N/m^2], optional
        c_px; by default as lateral.
    sliding_friction : array_like, optional
        mu of a sliding bristle; by default equal to `friction`.
    camber_thrust : array_like
        Slip angle that a radian of camber is worth.
    slip_angle_offset, slip_ratio_offset : array_like, [rad], [-]
        Added to the slips: ply steer, conicity, and a rig's zero.
    Fx_offset, Fy_offset, Mz_offset : array_like, [N], [N], [N m]
        Added to the results: rolling resistance, and a rig's zero.
    yaw_compliance : array_like, [rad/(N m)]
        1 / C_yaw of Eq. (2): turn of the contact under its aligning moment; 0 is rigid.
    lateral_compliance : array_like, [m/N]
        1 / C_lat of Eq. (2): shift of the contact under Fy, an arm for Fx; 0 is rigid.
    """

    lateral_stiffness: npt.ArrayLike
    friction: npt.ArrayLike
    half_length: npt.ArrayLike
    longitudinal_stiffness: npt.ArrayLike | None = None
    sliding_friction: npt.ArrayLike | None = None
    camber_thrust: npt.ArrayLike = 0.0
    slip_angle_offset: npt.ArrayLike = 0.0
    slip_ratio_offset: npt.ArrayLike = 0.0
    Fx_offset: npt.ArrayLike = 0.0
    Fy_offset: npt.ArrayLike = 0.0
    Mz_offset: npt.ArrayLike = 0.0
    yaw_compliance: npt.ArrayLike = 0.0
    lateral_compliance: npt.ArrayLike = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class PointConditions:
    """Operating points; each is one number or one per point.

    Attributes
    ----------
    load : array_like, [N]
        Fz > 0.
    slip_angle, camber : array_like, [rad]
    slip_ratio : array_like
        kappa = (Omega Re - v)/v >= -1, of the speed in the wheel's plane; braking is negative.
    """

    load: npt.ArrayLike
    slip_angle: npt.ArrayLike
    slip_ratio: npt.ArrayLike = 0.0
    camber: npt.ArrayLike = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class PointForces:
    """Forces on the tire, one per point, [N], [N], [N m]."""

    Fx: FloatArray
    Fy: FloatArray
    Mz: FloatArray


def predict_forces(parameters: PointParameters, conditions: PointConditions) -> PointForces:
    """Return steady-state forces and aligning moment.

    Raises
    ------
    ParameterError
        If a number is out of range.
    ShapeError
        If parameters and conditions do not broadcast.
    ConvergenceError
        If the balance with a compliant carcass is not found.

    Examples
    --------
    >>> brush = PointParameters(lateral_stiffness=6e4 / (2 * 0.06**2), friction=0.9,
    ...                         half_length=0.06)
    >>> float(predict_forces(brush, PointConditions(4000.0, np.radians(3.0))).Fy)
    -2317.79468
    """
    return _answer(_Contact.of(parameters, conditions), parameters)


def _answer(contact: "_Contact", parameters: PointParameters) -> PointForces:
    """Return a contact's forces, turned by a compliant carcass, with the offsets."""
    yaw = np.asarray(parameters.yaw_compliance, dtype=np.float64)
    turn: FloatArray | float = _balance(contact, yaw) if np.any(yaw) else 0.0
    Fx, Fy, moment = contact.forces(turn)
    if np.any(parameters.lateral_compliance):
        moment = moment - Fx * Fy * np.asarray(parameters.lateral_compliance)
    found = (
        Fx + np.asarray(parameters.Fx_offset, dtype=np.float64),
        Fy + np.asarray(parameters.Fy_offset, dtype=np.float64),
        moment + np.asarray(parameters.Mz_offset, dtype=np.float64),
    )
    return PointForces(*(np.array(part) for part in np.broadcast_arrays(*found)))


@dataclass(frozen=True, slots=True, eq=False)
class _Contact:
    """Checked constants; slips times rolling = 1 + kappa, so that a locked wheel is a case."""

    c_px: FloatArray
    c_py: FloatArray
    stick: FloatArray  # mu Fz, the force up to which all bristles stick
    slide: FloatArray
    a: FloatArray
    kappa: FloatArray
    tangent: FloatArray

    @classmethod
    def of(cls, p: PointParameters, at: PointConditions) -> "_Contact":
        _check_shapes(p, at)
        mu, Fz = _number("friction", p.friction, 0.0), _number("load", at.load, 0.0)
        sliding = p.friction if p.sliding_friction is None else p.sliding_friction
        c_py = _number("lateral_stiffness", p.lateral_stiffness, 0.0)
        c_px = c_py
        if p.longitudinal_stiffness is not None:
            c_px = _number("longitudinal_stiffness", p.longitudinal_stiffness, 0.0)
        angle = _number("slip_angle", at.slip_angle) + _number("angle", p.slip_angle_offset)
        if np.any(p.camber_thrust):
            angle = angle + _number("camber", at.camber) * _number("thrust", p.camber_thrust)
        if not np.all(np.abs(angle) < 0.5 * np.pi):
            raise ParameterError(
                f"brush: a slip angle of {float(np.abs(angle).max()):.4g} rad; allowed is less "
                "than pi/2 with offset and camber thrust; give angles in radians"
            )
        kappa = _number("slip_ratio", at.slip_ratio) + _number("ratio", p.slip_ratio_offset)
        if not np.all(kappa >= -1.0):
            raise ParameterError(
                f"brush: slip_ratio = {float(kappa.min()):.4g}; allowed is >= -1, a locked wheel; "
                "give it as a ratio, not in percent"
            )
        half = _number("half_length", p.half_length, 0.0)
        slide = _number("sliding_friction", sliding) * Fz
        return cls(c_px, c_py, mu * Fz, slide, half, kappa, np.tan(angle))

    def forces(self, turn: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return Fx, Fy and the moment about the middle, for a turn of the contact."""
        rolling = 1.0 + self.kappa
        across = rolling * turn - self.tangent
        demand_x, demand_y = self.c_px * self.kappa, self.c_py * across
        size = np.hypot(demand_x, demand_y)
        limit = 1.5 * rolling * self.stick / self.a**2
        t = np.minimum(size, limit) / np.where(limit > 0.0, limit, 1.0)
        t = np.where(limit > 0.0, t, 1.0)
        s = 1.0 - t
        stick = 2.0 * (self.a * s) ** 2 / np.where(rolling > 0.0, rolling, 1.0)
        slip = np.hypot(self.kappa, across)
        slip = np.where(slip > 0.0, slip, 1.0)
        slide_x, slide_y = self.slide * (self.kappa / slip), self.slide * (across / slip)
        share = t**2 * (3.0 - 2.0 * t)
        Fx = stick * demand_x + share * slide_x
        Fy = stick * demand_y + share * slide_y
        # arms of both parts about the middle: a (1 - 4 s / 3), and minus 3 a (s t)^2 / share
        arm = stick * demand_y * (1.0 - 4.0 / 3.0 * s)
        moment = self.a * (arm - 3.0 * (s * t) ** 2 * slide_y)
        return Fx, Fy, moment


def _balance(contact: _Contact, compliance: FloatArray) -> FloatArray:
    """Return the turn of the contact that its own moment causes, by Newton's method."""
    if not np.all(np.isfinite(compliance) & (compliance >= 0.0)):
        raise ParameterError(
            f"brush: yaw_compliance = {float(compliance.min()):.6g} rad/(N m); it must be finite "
            "and >= 0, 0 for a rigid carcass"
        )
    scale = contact.stick * contact.a
    _, _, moment = contact.forces(0.0)
    moment, h = 0.5 * moment, 1e-6
    size = np.full(moment.shape, np.inf)
    for _ in range(MOST_ITERATIONS):
        rest = contact.forces(compliance * moment)[2] - moment
        size = np.abs(rest) / scale
        if np.all(size <= TOLERANCE):
            return compliance * moment
        moved = contact.forces(compliance * (moment + h * scale))[2] - moment
        slope = (moved - rest) / (h * scale) - 1.0
        moment = moment - rest / np.minimum(slope, -0.25)
    raise ConvergenceError(
        f"brush: {int((size > TOLERANCE).sum())} of {size.size} points have no balance with the "
        f"carcass (remainder {float(size.max()):.1e} of mu Fz a); it is too soft in yaw for the "
        "bristles; lower yaw_compliance",
        compliance * moment,
        float(size.max()),
    )


def _check_shapes(p: PointParameters, at: PointConditions) -> None:
    shapes = {
        name: np.shape(value)
        for part in (p, at)
        for name in part.__slots__
        if (value := getattr(part, name)) is not None
    }
    try:
        np.broadcast_shapes(*{*shapes.values()})
    except ValueError:
        many = ", ".join(f"{name} {shape}" for name, shape in shapes.items() if shape)
        raise ShapeError(
            f"brush: shapes {many} do not broadcast; give one value or one per point"
        ) from None


def _number(name: str, value: npt.ArrayLike, above: float | None = None) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    good = np.isfinite(array)
    if above is not None:
        good &= array > above
    if not good.all():
        allowed = "finite" if above is None else f"finite and > {above:g}"
        raise ParameterError(
            f"brush: {name} = {float(array[~good].ravel()[0]):.6g} at {int((~good).sum())} of "
            f"{array.size} points; it must be {allowed}"
        )
    return array
