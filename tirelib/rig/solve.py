"""Newton's method for steady rolling, with continuation in deflection and slip."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.threads import one_thread
from tirelib.rig.belt import FIELDS, U
from tirelib.rig.mesh import Mesh, mesh
from tirelib.rig.system import Balance, balance
from tirelib.rig.tire import NEW_DEPTH, Array, Condition, RigTire

TOLERANCE = 1e-9
"""Largest Newton step of a solved state: metres and radians."""
MAX_STEPS = 40
REUSE = 0.3
"""The factors are kept where a step with them cut the residual to this share: new ones cost as much
as seven such steps."""
SETTLED = 1e-6
"""Allowed residual of the right side where a derivative is found with old factors."""
FIRST_DEFLECTION = 0.004
"""Deflection between the unloaded tire and the first load [m]. With half and double of it twelve
random conditions take 299 and 300 Newton steps instead of 284, and end within 7e-12 m."""
LIMITS = {
    "load": (200.0, 12000.0),
    "pressure": (0.5e5, 5e5),
    "speed": (0.1, 90.0),
    "slip_angle": (-0.4, 0.4),
    "camber": (-0.15, 0.15),
    "slip_ratio": (-0.9, 2.0),
    "friction": (0.05, 1.5),
    "tread_depth": (0.0005, NEW_DEPTH),
}
"""Lowest and highest condition that is solved, SI."""


class SolverError(TirelibError, RuntimeError):
    """The rig found no steady state."""


@dataclass(frozen=True)
class RigState:
    """A steady rolling state.

    Attributes
    ----------
    control : array, shape (n, 16)
        Spline coefficients of the belt's fields.
    height : float
        Axle height over the road, the loaded radius for no camber [m].
    rolling_radius : float
        V_x / Omega [m].
    free_radius : float
        R_e: the rolling radius of the upright, straight, freely rolling wheel at this load,
        pressure and speed [m].
    by_load : array, shape (n, 16)
        Derivative of `control` with the load at constant rolling condition [1/N].
    stiffness : float
        Vertical stiffness, -d load / d height [N/m]; it and `by_load` are NaN in `straight`,
        because only the state that is asked for needs them.
    steps : int
        Newton steps taken.
    straight : RigState or None
        The straight, freely rolling state that defines R_e, where this is another.
    """

    tire: RigTire
    condition: Condition
    grid: Mesh
    control: Array
    height: float
    rolling_radius: float
    free_radius: float
    by_load: Array
    stiffness: float
    steps: int
    straight: "RigState | None" = None

    @property
    def omega(self) -> float:
        """Wheel speed [rad/s]."""
        c = self.condition
        return c.speed * float(np.cos(c.slip_angle)) / self.rolling_radius


def inflated(tire: RigTire, pressure: float, omega: float) -> float:
    """Radial displacement of the unloaded belt [m].

    EA u / R^2 + k_u u = p b (1 + u / R) + rhoA Omega^2 (R + u), per length, exactly linear in u
    (without softening).
    """
    r = tire.ring_radius
    push = pressure * tire.belt_width
    spin = tire.mass * omega**2
    return (push + spin * r) / (
        tire.extension / r**2 + tire.radial_stiffness(pressure) - push / r - spin
    )


@one_thread()
def solve(
    tire: RigTire,
    cond: Condition,
    start: RigState | None = None,
    grid: Mesh | None = None,
) -> RigState:
    """Find the steady state of a condition.

    Parameters
    ----------
    start : State, optional
        A state nearby to start from; the result does not depend on it beyond the tolerance.
    grid : Mesh, optional
        The default mesh otherwise.

    Raises
    ------
    ParameterError
        If the condition is not one that the rig can run.
    SolverError
        If Newton's method fails.
    """
    _check(cond)
    grid = grid or mesh()
    free = replace(cond, slip_ratio=None)
    if start is None or start.grid is not grid:
        start = _from_unloaded(tire, free, grid)
    rolling = replace(free, slip_angle=0.0, camber=0.0)
    if cond.slip_ratio is None:
        state = _approach(tire, free, start.straight or start, response=True)
        if free == rolling:
            return state
        upright = _approach(tire, rolling, start.straight or start)
        return replace(state, free_radius=upright.rolling_radius, straight=upright)
    straight = _approach(tire, rolling, start.straight or start)
    radius = straight.rolling_radius
    if start.straight is not None:
        try:
            state = _newton(tire, cond, start, radius, response=True)
            return replace(state, straight=straight)
        except SolverError:
            pass  # a start beyond full sliding may mislead: go from free rolling
    return replace(_approach(tire, cond, straight, radius, response=True), straight=straight)


def _check(cond: Condition) -> None:
    for name, (low, high) in LIMITS.items():
        value = getattr(cond, name)
        if value is not None and not low <= value <= high:
            raise ParameterError(
                f"rig condition, {name} = {value:g} (SI); allowed is {low:g} to {high:g}; "
                "change the plan"
            )


def _from_unloaded(tire: RigTire, cond: Condition, grid: Mesh) -> RigState:
    """Lower the inflated tire onto the road."""
    straight = replace(cond, slip_angle=0.0, camber=0.0, slip_ratio=None)
    rolling = tire.free_radius
    control = np.zeros((grid.n, FIELDS))
    control[:, U] = inflated(tire, cond.pressure, cond.speed / rolling)
    top = tire.free_radius + control[0, 0]
    zero = np.zeros_like(control)
    state = RigState(tire, straight, grid, control, top, rolling, rolling, zero, 0.0, 0)
    height = top - FIRST_DEFLECTION
    return _newton(tire, straight, replace(state, height=height), None, height)


def _approach(
    tire: RigTire,
    cond: Condition,
    start: RigState,
    free_radius: float | None = None,
    *,
    response: bool = False,
) -> RigState:
    """Newton from a start, halving the way to the condition where it fails."""
    try:
        return _newton(tire, cond, start, free_radius, response=response)
    except SolverError:
        return _halve(tire, cond, start, free_radius, 4, response=response)


def _halve(
    tire: RigTire,
    cond: Condition,
    start: RigState,
    free_radius: float | None,
    left: int,
    *,
    response: bool,
) -> RigState:
    was = start.condition
    if left == 0:
        raise SolverError(
            f"no steady state at {cond}; the nearest solved one is {was}; "
            "reduce slip or load, or change the tire"
        )
    slip = None
    if cond.slip_ratio is not None and free_radius is not None:
        slip = 0.5 * (cond.slip_ratio + free_radius / start.rolling_radius - 1.0)
    middle = Condition(
        load=0.5 * (cond.load + was.load),
        pressure=0.5 * (cond.pressure + was.pressure),
        speed=0.5 * (cond.speed + was.speed),
        slip_angle=0.5 * (cond.slip_angle + was.slip_angle),
        camber=0.5 * (cond.camber + was.camber),
        slip_ratio=slip,
    )
    for goal in (middle, cond):
        wanted = response and goal is cond
        try:
            start = _newton(tire, goal, start, free_radius, response=wanted)
        except SolverError:
            start = _halve(tire, goal, start, free_radius, left - 1, response=wanted)
    return start


def _newton(
    tire: RigTire,
    cond: Condition,
    start: RigState,
    free_radius: float | None = None,
    fixed_height: float | None = None,
    *,
    response: bool = False,
) -> RigState:
    """Return the state at a condition; its derivative with the load where `response` asks."""
    grid, control = start.grid, start.control
    height, rolling = start.height, start.rolling_radius
    target = None
    if tire.friction == 0.0:  # nothing couples wheel and road: roll as the inflated belt does
        target = rolling = tire.ring_radius + inflated(tire, cond.pressure, 0.0)
    if cond.slip_ratio is not None and free_radius is not None:
        target = rolling = free_radius / (1.0 + cond.slip_ratio)
    now = balance(tire, cond, grid, control, height, rolling, target, fixed_height)
    size, slow = grid.n * FIELDS, True
    for count in range(1, MAX_STEPS + 1):
        if count == 1 or slow:
            try:
                apply = now.factor()
            except RuntimeError:  # singular: the tire has left the road
                break
        step = apply(-now.residual)
        if not np.all(np.isfinite(step)):
            break
        moved = step[:size].reshape(grid.n, FIELDS)
        largest = max(float(np.max(np.abs(moved))), abs(step[-2]), abs(step[-1]))
        scale = min(1.0, 0.02 / largest)
        norm = _norm(now)
        for _ in range(6):
            trial = balance(
                tire,
                cond,
                grid,
                control + scale * moved,
                height + scale * step[-2],
                rolling + scale * step[-1],
                target,
                fixed_height,
            )
            if _norm(trial) < 1.1 * norm or largest < 1e-6:
                break
            scale *= 0.5
        slow = scale < 1.0 or _norm(trial) > REUSE * norm
        now = trial
        control = control + scale * moved
        height, rolling = height + scale * float(step[-2]), rolling + scale * float(step[-1])
        if largest < TOLERANCE:
            _check_zone(cond, now)
            by_load = _by_load(now, apply) if response else np.full_like(step, np.nan)
            return RigState(
                tire=tire,
                condition=cond,
                grid=grid,
                control=control,
                height=height,
                rolling_radius=rolling,
                free_radius=rolling if free_radius is None else free_radius,
                by_load=by_load[:size].reshape(grid.n, FIELDS),
                stiffness=-1.0 / float(by_load[-2]),
                steps=count,
            )
    raise SolverError(f"Newton's method did not converge at {cond}; take smaller steps")


def _by_load(state: Balance, apply: Callable[[Array], Array]) -> Array:
    """Return the derivative of the unknowns with the load, from factors of a state nearby."""
    unit = np.zeros_like(state.residual)
    unit[-2] = 1.0
    found, left = np.zeros_like(unit), unit
    for _ in range(MAX_STEPS):
        found = found + apply(left)
        before, left = left, unit - state.times(found)
        if np.linalg.norm(left) < SETTLED:
            return found
        if np.linalg.norm(left) > REUSE * np.linalg.norm(before):
            apply = state.factor()
    return found


def _check_zone(cond: Condition, state: Balance) -> None:
    touching = state.road.q[[0, -1]] > 0.0
    if np.any(touching):
        raise SolverError(
            f"the contact leaves the refined part of the mesh at {cond}; "
            "give a mesh with a wider zone or reduce the load"
        )


def _norm(state: Balance) -> float:
    return float(np.linalg.norm(state.residual))
