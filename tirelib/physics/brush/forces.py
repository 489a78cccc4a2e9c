r"""Steady-state brush with pointwise sticking and sliding, for any contact pressure.

Dissertation Eq. (23) and (25), the latter corrected (the demand lacks tan alpha in print), with
longitudinal slip and a compliant carcass added. A bristle at the distance z = a2 - x behind the
leading edge is bent by the theoretical slip

.. math:: \sigma_x = \frac{\kappa}{1 + \kappa}, \qquad
          \sigma_y = \frac{\tan\alpha}{1 + \kappa}

so its demand is (c_px sigma_x, -c_py sigma_y) z. Where that exceeds mu q(x), the bristle slides and
carries mu_s q(x) in the direction opposite to the sliding. Adhesion force, and with equal
stiffnesses also sliding force, is opposite to the slip. Axes ISO 8855.

Limits: one row of bristles; a bristle that slid and sticks again is as if it had never slid;
friction does not depend on the sliding speed along the contact.
"""

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ConvergenceError, ParameterError, ShapeError
from tirelib.physics.brush.contact_split import Grid, make_grid, split
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.physics.contact.profiles import PressureProfile

MOST_ITERATIONS = 60
MOST_HALVINGS = 8
MOST_NAMED = 8
"""Operating points that an error names."""
TOLERANCE = 1e-11
"""Residual of the carcass balance, relative to mu Fz and mu Fz times the contact length."""


@dataclass(frozen=True, slots=True, eq=False)
class BrushForces:
    """Forces on the tire, one per operating point.

    Attributes
    ----------
    Fx, Fy : arrays, [N]
    Mz : array, [N m]
        Aligning moment about the wheel's axle; positive for a positive slip angle.
    trail : array, [m]
        Pneumatic trail -Mz/Fy; NaN where Fy is zero.
    adhesion : array
        Share of the contact length that sticks, 0 .. 1.
    """

    Fx: FloatArray
    Fy: FloatArray
    Mz: FloatArray
    trail: FloatArray
    adhesion: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BrushDistribution:
    """Force per length over the contact, at the profile's nodes, shape (..., n_nodes).

    Attributes
    ----------
    x : array, [m]
    fx, fy : arrays, [N/m]
    sticks : array of bool
    """

    x: FloatArray
    fx: FloatArray
    fy: FloatArray
    sticks: BoolArray


def brush_forces(
    profile: PressureProfile,
    parameters: BrushParameters,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike = 0.0,
    *,
    curvature: npt.ArrayLike = 0.0,
) -> BrushForces:
    """Return the steady-state forces and aligning moment.

    Parameters
    ----------
    profile : PressureProfile
        Its operating points broadcast with all else.
    parameters : BrushParameters
    slip_angle : array_like, [rad]
        Between -pi/2 and pi/2; a positive one gives a negative Fy.
    slip_ratio : array_like
        kappa = (Omega Re - v)/v >= -1; braking is negative, -1 is a locked wheel.
    curvature : array_like, [1/m]
        Curvature of the path of the belt's contact line over the road (camber, turn slip); a
        positive one gives a positive Fy.

    Raises
    ------
    ParameterError
        If a slip is out of range or not finite.
    ConvergenceError
        If the balance with the carcass is not found; carries Fy and Mz of every operating point.
    ShapeError
        If the arguments do not broadcast.

    Examples
    --------
    >>> from tirelib.physics.contact.profiles import parabola
    >>> p = BrushParameters(lateral_stiffness=6e4 / (2 * 0.06**2), friction=0.9)
    >>> float(brush_forces(parabola(4000.0, -0.06, 0.06), p, np.radians(3.0)).Fy)
    -2317.79468
    """
    brush, shape = _set_up(profile, parameters, slip_angle, slip_ratio, curvature)
    state = brush.solve()
    parts = brush.forces(state)
    moment = parts.moment - np.divide(parts.Fy * parts.Fx, brush.lateral)
    trail = np.divide(-moment, parts.Fy, out=np.full_like(moment, np.nan), where=parts.Fy != 0.0)
    found = (parts.Fx, parts.Fy, moment, trail, parts.adhesion)
    return BrushForces(*(part.reshape(shape) for part in found))


def brush_distribution(
    profile: PressureProfile,
    parameters: BrushParameters,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike = 0.0,
    *,
    curvature: npt.ArrayLike = 0.0,
) -> BrushDistribution:
    """Return the force per length over the contact; arguments and errors as `brush_forces`."""
    brush, shape = _set_up(profile, parameters, slip_angle, slip_ratio, curvature)
    state = brush.solve()
    count = profile.x.shape[-1]
    x = profile.x.reshape(-1, count)[brush.grid.row]
    pressure = profile.pressure.reshape(-1, count)[brush.grid.row]
    u = (brush.front[:, None] - x) / brush.length[:, None]
    point = np.arange(brush.grid.row.size)[:, None]
    demand_x, demand_y = brush.demand(state, u, point)
    sticks = np.hypot(demand_x, demand_y) <= (brush.rolling * brush.stick)[:, None] * pressure
    along, across = brush.direction(state)
    slide = brush.slide[:, None] * pressure
    speed = np.where(sticks, brush.rolling[:, None], 1.0)  # rolling > 0 wherever a bristle sticks
    speed = np.where(speed == 0.0, 1.0, speed)
    fx = np.where(sticks, demand_x / speed, slide * along[:, None])
    fy = np.where(sticks, demand_y / speed, slide * across[:, None])
    full = (*shape, count)
    parts = (x.reshape(full), fx.reshape(full), fy.reshape(full), sticks.reshape(full))
    return BrushDistribution(*parts)


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    Fx: FloatArray
    Fy: FloatArray
    moment: FloatArray  # of fy about x = 0, before the carcass shifts the contact
    adhesion: FloatArray


State = tuple[FloatArray, FloatArray]
"""Turn of the belt, [rad], and half its curvature, [1/m]: what the carcass adds to the slip."""


@dataclass(frozen=True, slots=True, eq=False)
class _Brush:
    """All operating points, flat; slips times 1 + kappa, so that a locked wheel is one of them."""

    grid: Grid
    cx: FloatArray
    cy: FloatArray
    stick: FloatArray
    slide: FloatArray
    lateral: FloatArray
    yaw: FloatArray
    bend: FloatArray
    tangent: FloatArray
    kappa: FloatArray
    curvature: FloatArray
    front: FloatArray
    length: FloatArray
    load: FloatArray

    @property
    def rolling(self) -> FloatArray:
        return 1.0 + self.kappa

    def demand(
        self, state: State, u: FloatArray, point: npt.NDArray[np.int64]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the adhesion force per length times 1 + kappa."""
        turn, bow = state
        z = u * self.length[point]
        lateral = turn[point] + bow[point] * (2.0 * self.front[point] - z)
        slope = self.rolling[point] * lateral - self.tangent[point]
        return self.cx[point] * self.kappa[point] * z, self.cy[point] * slope * z

    def direction(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Return the direction of the sliding force: the bristle's in the middle of the contact."""
        turn, bow = state
        lateral = turn + bow * (2.0 * self.front - 0.5 * self.length)
        along, across = self.kappa, self.rolling * lateral - self.tangent
        size = np.hypot(along, across)
        size = np.where(size == 0.0, 1.0, size)
        return along / size, across / size

    def forces(self, state: State) -> _Parts:
        """Integrate the contact for a given shape of the belt."""

        def excess(u: FloatArray, pressure: FloatArray, point: npt.NDArray[np.int64]) -> FloatArray:
            demand = np.hypot(*self.demand(state, u, point))
            return np.asarray(demand - (self.rolling * self.stick)[point] * pressure)

        pieces = split(self.grid, excess)
        everywhere = np.arange(self.grid.row.size)
        end = self._antiderivatives(state, np.ones(everywhere.size), everywhere, self.grid.whole)
        there = self.grid.profile.curve.cumulative(pieces.place, self.grid.row[pieces.point])
        at = self._antiderivatives(state, pieces.place, pieces.point, there)
        zero, none = np.zeros(everywhere.size), np.zeros(pieces.point.size)
        adhesion = pieces.total(zero + 1.0, zero, pieces.place, none)
        Fx, Fy, moment = (pieces.total(*end[k], *at[k]) for k in range(3))
        return _Parts(Fx, Fy, moment, adhesion)

    def _antiderivatives(
        self,
        state: State,
        u: FloatArray,
        point: npt.NDArray[np.int64],
        carried: tuple[FloatArray, FloatArray],
    ) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Return (stick, slide) integrals of fx, fy and x fy from the leading edge to u.

        `carried` is the pressure's load and moment from the leading edge to u.
        """
        turn, bow = (part[point] for part in state)
        front, length, rolling = self.front[point], self.length[point], self.rolling[point]
        z = u * length
        inverse = np.divide(1.0, rolling, out=np.zeros_like(rolling), where=rolling > 0.0)
        slope = turn - self.tangent[point] * inverse
        stick_x = self.cx[point] * self.kappa[point] * inverse * z**2 / 2.0
        stick_y = self.cy[point] * (slope * z**2 / 2.0 + bow * (front * z**2 - z**3 / 3.0))
        arm = self.cy[point] * (slope * z**3 / 3.0 + bow * (2.0 * front * z**3 / 3.0 - z**4 / 4.0))
        load, moment = carried
        along, across = (part[point] for part in self.direction(state))
        friction = self.slide[point]
        return (
            (stick_x, friction * load * along),
            (stick_y, friction * load * across),
            (front * stick_y - arm, friction * across * (front * load - length * moment)),
        )

    def solve(self) -> State:
        """Return the shape of the belt that agrees with the forces that it causes (Newton)."""
        force, moment = np.zeros_like(self.tangent), np.zeros_like(self.tangent)
        if np.all(np.isinf(self.yaw) & np.isinf(self.bend)):
            return self.belt(force, moment)
        left, brush, f, m = np.arange(force.size), self, force, moment
        r = brush.residual(f, m)
        for _ in range(MOST_ITERATIONS):
            open_ = np.maximum(*np.abs(r)) > TOLERANCE
            force, moment = force.copy(), moment.copy()
            force[left], moment[left] = f, m
            if not open_.any():
                return self.belt(force, moment)
            left, f, m, r = left[open_], f[open_], m[open_], r[:, open_]
            brush = brush.take(open_)
            f, m, r = brush.step(f, m, r)
        open_ = np.maximum(*np.abs(r)) > TOLERANCE
        force[left], moment[left] = f, m
        if not open_.any():
            return self.belt(force, moment)
        raise _no_balance(left[open_], force, moment, float(np.abs(r).max()))

    def take(self, keep: BoolArray) -> Self:
        """Return some of the operating points."""
        rest = {f.name: getattr(self, f.name)[keep] for f in fields(self) if f.name != "grid"}
        return replace(self, grid=self.grid.take(keep), **rest)

    def belt(self, force: FloatArray, moment: FloatArray) -> State:
        """Return the shape of the belt under a force and a moment, Eq. (2)."""
        return moment / self.yaw, 0.5 * (self.curvature - force / self.bend)

    def residual(self, force: FloatArray, moment: FloatArray) -> FloatArray:
        """Return by how much the forces differ from those assumed, shape (2, n_points)."""
        found = self.forces(self.belt(force, moment))
        scale, arm = self._scales()
        return np.stack([(found.Fy - force) / scale, (found.moment - moment) / arm])

    def step(
        self, force: FloatArray, moment: FloatArray, r: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Take one Newton step, halved where it would not help; return also the new remainder."""
        scale, arm = self._scales()
        h = 1e-7
        minus, zero = np.full_like(force, -1.0), np.zeros_like(force)
        (a, c), (b, d) = (minus, zero), (zero, minus)  # a rigid carcass does not answer
        if not np.all(np.isinf(self.bend)):
            a, c = (self.residual(force + h * scale, moment) - r) / h
        if not np.all(np.isinf(self.yaw)):
            b, d = (self.residual(force, moment + h * arm) - r) / h
        det = a * d - b * c
        det = np.where(np.abs(det) < 1e-12, 1.0, det)
        by_force = -(d * r[0] - b * r[1]) / det * scale
        by_moment = -(a * r[1] - c * r[0]) / det * arm
        share = np.ones_like(force)
        size = np.abs(r).max(axis=0)
        for _ in range(MOST_HALVINGS):
            new = self.residual(force + share * by_force, moment + share * by_moment)
            worse = np.abs(new).max(axis=0) > size
            if not worse.any():
                break
            share = np.where(worse, 0.5 * share, share)
        else:
            new = self.residual(force + share * by_force, moment + share * by_moment)
        return force + share * by_force, moment + share * by_moment, new

    def _scales(self) -> tuple[FloatArray, FloatArray]:
        scale = np.maximum(self.stick * self.load, 1e-300)
        return scale, scale * self.length


def _no_balance(
    points: IntArray, force: FloatArray, moment: FloatArray, rest: float
) -> ConvergenceError:
    first = ", ".join(map(str, points[:MOST_NAMED])) + (", ..." if points.size > MOST_NAMED else "")
    return ConvergenceError(
        f"brush: {points.size} of {force.size} operating points (number {first}) have no balance "
        f"with the carcass; {rest:.2g} of mu Fz is left, allowed is {TOLERANCE:g}. The belt is so "
        "soft that the bristle in the middle, whose direction is that of all sliding, turns over, "
        "or sliding friction is far below sticking friction: stiffen carcass.bend or carcass.yaw",
        (force, moment),
        rest,
    )


def _set_up(
    profile: PressureProfile,
    parameters: BrushParameters,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike,
    curvature: npt.ArrayLike,
) -> tuple[_Brush, tuple[int, ...]]:
    """Check and flatten everything to one axis of operating points."""
    alpha = np.asarray(slip_angle, dtype=np.float64)
    kappa = np.asarray(slip_ratio, dtype=np.float64)
    bow = np.asarray(curvature, dtype=np.float64)
    if not np.all(np.abs(alpha) < 0.5 * np.pi):
        raise ParameterError("a slip angle is not between -pi/2 and pi/2 rad; give it in radians")
    if not np.all(np.isfinite(kappa) & (kappa >= -1.0)):
        raise ParameterError("a slip ratio is not finite and >= -1; -1 is a locked wheel")
    if not np.all(np.isfinite(bow)):
        raise ParameterError("a curvature is not finite; give it in 1/m, 0 for none")
    p = parameters
    given = (
        p.longitudinal_stiffness,
        p.lateral_stiffness,
        p.friction,
        p.sliding_friction,
        p.carcass.lateral,
        p.carcass.yaw,
        p.carcass.bend,
        np.tan(alpha),
        kappa,
        bow,
        profile.leading,
        profile.length,
        profile.load,
        np.arange(profile.load.size).reshape(profile.shape),
    )
    arrays = [np.asarray(part) for part in given]
    try:
        shape = np.broadcast_shapes(*(a.shape for a in arrays))
    except ValueError:
        raise ShapeError(
            f"profile {profile.shape}, slip angle {alpha.shape}, slip ratio {kappa.shape} and the "
            "parameters do not broadcast; give one value or one per operating point"
        ) from None
    *flat, row = (np.broadcast_to(a, shape).ravel() for a in arrays)
    return _Brush(make_grid(profile, row), *flat), shape
