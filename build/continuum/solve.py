"""Newton's method for a rolling state, and the way to the first one of a tire."""

from dataclasses import dataclass, replace
from dataclasses import fields as fields_of
from functools import cached_property

import numpy as np

from continuum.balance import Balance, balance, step
from continuum.elements import fields
from continuum.grid import FINE, Grid, grid
from continuum.polar import Array, tangential
from continuum.sidewall import SidewallLaw, law
from continuum.tire import Condition, Tire

SMALLEST, LARGEST = 1e-9, 4e-3
"""Newton's method ends below the first and takes no step above the second [m]."""
KEPT = 1e-5
"""Below this step the stiffness is not factored again, as long as steps fall fast [m]."""
ITERATIONS, HALVINGS = 15, 4
"""Most steps of Newton's method, and most halvings on the way from a start that is too far off."""

CREEPS = (0.03, 0.01)
"""Creep of the friction on the way to a tire's own."""


@dataclass(frozen=True)
class Model:
    """A tire with its mesh and its sidewalls' law, which many states share.

    `fine` is the size of the mesh's elements in the contact [rad].
    """

    tire: Tire
    mesh: Grid
    law: SidewallLaw
    fine: float = FINE


@dataclass(frozen=True)
class State:
    """A solved state; `iterations` are those of Newton's method."""

    model: Model
    balance: Balance
    iterations: int

    @cached_property
    def _response(self) -> tuple[Array, float]:
        """How displacements and height change with one newton of load."""
        now = self.balance
        more = replace(now, cond=replace(now.cond, load=now.road.load + 1.0))
        return step(more, None, now.factor)[:2]

    @property
    def by_load(self) -> Array:
        """Derivative of the displacements with the load [m/N]."""
        return self._response[0]

    @property
    def stiffness(self) -> float:
        """Vertical stiffness at constant speed [N/m]."""
        higher = self._response[1]
        return -1.0 / higher if higher else 0.0

    @property
    def omega(self) -> float:
        """Turn rate [rad/s]."""
        return self.balance.omega

    @property
    def height(self) -> float:
        """Height of the axle over the road [m]."""
        return self.balance.height


def model(tire: Tire, fine: float = FINE) -> Model:
    """Mesh a tire and solve its sidewall's section."""
    return Model(tire, grid(tire, fine), law(tire.arch), fine)


def solve(model: Model, cond: Condition, start: State | None = None) -> State:
    """Solve a state of straight, free rolling.

    Parameters
    ----------
    start : State, optional
        State of a tire with the same mesh, near by; without one the tire is lowered on to the road.

    Raises
    ------
    ArithmeticError
        If Newton's method does not converge.
    """
    return _way(model, cond, start or _lowered(model, cond), HALVINGS)


def _way(model: Model, cond: Condition, start: State, left: int) -> State:
    """Solve from a start; where that is too far off, through the condition half way."""
    old = start.balance
    try:
        return _near(model, cond, start)
    except ArithmeticError:
        if left == 0:
            raise
    if model.tire.friction and model.tire.creep < CREEPS[0]:
        return _gripping(model, cond, start, left)
    half = Condition(
        *(0.5 * (getattr(cond, f.name) + getattr(old.cond, f.name)) for f in fields_of(cond))
    )
    return _way(model, cond, _way(model, half, start, left - 1), left - 1)


def _gripping(model: Model, cond: Condition, start: State, left: int) -> State:
    """Solve with friction from a start that is too far off: let the tread creep more at first."""
    smooth = [c for c in CREEPS if c > model.tire.creep]
    for creep in smooth:
        start = _way(replace(model, tire=replace(model.tire, creep=creep)), cond, start, left - 1)
    return _near(model, cond, start)


def _near(model: Model, cond: Condition, start: State) -> State:
    """Solve from a state near by; a tire with less tread starts lower by that."""
    old = start.balance
    height = old.height + model.tire.free_radius - old.tire.free_radius
    return _newton(model, cond, old.u, height, old.rolling, None)


def _lowered(model: Model, cond: Condition) -> State:
    """Lower the tire, without friction, step by step."""
    model = replace(model, tire=replace(model.tire, friction=0.0))
    radius = model.tire.free_radius
    u = np.zeros((model.mesh.n, 2))
    state = _newton(model, cond, u, radius, radius, radius - 2e-3)
    for load in (600.0, 1500.0, 2800.0):
        if load < cond.load:
            old = state.balance
            state = _newton(model, replace(cond, load=load), old.u, old.height, old.rolling, None)
    return state


def rolling_radius(model: Model, now: Balance) -> float:
    """Return V / omega of a tire without friction: what of the belt passes the contact per radian.

    The mean of |x_phi| over the contact pressure, at the belt's inner face.
    """
    slope = fields(now.mesh.carcass, now.u)[1]
    line = now.mesh.carcass
    x_phi = line.radius[..., None] * tangential(line.phi) + slope
    passing = np.linalg.norm(x_phi, axis=-1)
    force = now.road.q * now.road.area
    total = float(force.sum())
    return float(np.sum(passing * force)) / total if total > 0.0 else float(line.radius[0, 0])


def _newton(
    model: Model, cond: Condition, u: Array, height: float, rolling: float, target: float | None
) -> State:
    tire, factor, last = model.tire, None, np.inf
    for count in range(1, ITERATIONS + 1):
        now = balance(tire, model.law, cond, model.mesh, u, height, rolling, cond.speed / rolling)
        try:
            moved, higher, further = step(now, target, factor)
        except (RuntimeError, np.linalg.LinAlgError):  # a singular matrix
            break
        size = max(float(np.abs(moved).max()), abs(higher), abs(further))
        if not np.isfinite(size):
            break
        falls, last = size < 0.2 * last, size
        factor = (factor or now.factor) if size < KEPT and falls else None
        part = min(1.0, LARGEST / size)
        u, height = u + part * moved, height + part * higher
        before = rolling
        rolling = rolling + part * further if tire.friction else rolling_radius(model, now)
        if size < SMALLEST and abs(rolling - before) < SMALLEST:
            return State(model, now, count)
    raise ArithmeticError(
        f"{tire.name}: no balance at {cond.load:.0f} N, {cond.pressure / 1e5:.2f} bar, "
        f"{3.6 * cond.speed:.0f} km/h after {count} iterations; start from a state nearer by"
    )
