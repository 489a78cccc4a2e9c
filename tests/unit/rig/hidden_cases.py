"""A coarse rig with each hidden effect planted, solved once for all tests."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from tirelib.rig.hidden import HIDDEN
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import Trace, edges, trace
from tirelib.rig.shown import Shown
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import Condition, RigTire

TIRE = RigTire(friction=0.0, sidewall_damping=0.0)
CONDITIONS = (
    Condition(3000.0, 1.7e5, 28.0),
    Condition(6000.0, 1.9e5, 14.0),
    Condition(4000.0, 2.5e5, 35.0),
)
PLACES = (0.4, 1.0, 0.0)
"""Places of the runs in their campaign."""
ANGLE = 1.1
ON_TIRE = [name for name, effect in HIDDEN.items() if effect.on_tire]
ON_TRACE = [name for name, effect in HIDDEN.items() if effect.on_trace]


@dataclass(frozen=True)
class Planted:
    """States and traces of the three runs."""

    states: tuple[RigState, ...]
    traces: tuple[Trace, ...]

    @property
    def waves(self) -> np.ndarray:
        """Mean strain of the gages without its mean over the turn, shape (3, n)."""
        strain = np.stack([t.strain.mean(axis=1) for t in self.traces])
        return strain - strain.mean(axis=1, keepdims=True)


@cache
def plain() -> Planted:
    """Return the rig that hides nothing."""
    grid = mesh(0.018, 0.15)
    states = tuple(solve(TIRE, cond, None, grid) for cond in CONDITIONS)
    return Planted(states, tuple(trace(state, 720) for state in states))


def seen(run: int) -> Shown:
    """Return what gages stand in, in a run of the plain rig."""
    state = plain().states[run]
    return Shown(
        TIRE,
        CONDITIONS[run],
        state.omega,
        plain().traces[run],
        edges(state)[0],
        state.stiffness,
        PLACES[run],
        ANGLE,
    )


@cache
def planted(name: str, share: float = 1.0) -> Planted:
    """Return the rig with an effect at a share of its visible strength."""
    effect, base = HIDDEN[name], plain()
    strength = share * effect.visible
    if effect.on_trace:
        return Planted(base.states, tuple(effect.trace(seen(k), strength) for k in range(3)))
    states = []
    for cond, place, start in zip(CONDITIONS, PLACES, base.states, strict=True):
        tire = effect.tire(TIRE, cond, place, strength)
        lower = tire.free_radius - TIRE.free_radius
        states.append(solve(tire, cond, replace(start, height=start.height + lower), start.grid))
    return Planted(tuple(states), tuple(trace(state, 720) for state in states))
