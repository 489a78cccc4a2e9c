"""Load across the contact under side force."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State
from tirelib.physics.contact.radial import press

DEG_PER_KN = np.deg2rad(1.0) / 1e3


@effect(
    "load_transfer",
    stage="contact",
    unit="deg/kN",
    low=0.0,
    high=1.5,
    varies_with=("slip_angle", "lateral"),
    needs=("side_force",),
    source="dissertation, section 4.1.4 (inner part unloaded in cornering); assumed size",
)
def load_transfer(state: State, strength: float) -> State:
    """Side force rolls the belt and moves load across the contact.

    The strip at y has d0 (1 + tanh(-y s Fy / d0)): Fy > 0 loads the right side, y < 0.
    """
    c = state.contact
    roll = strength * DEG_PER_KN * state.conditions.side_force
    deeper = -state.lateral * roll / c.deflection
    if not np.any(deeper):
        return state
    depth = c.deflection * (1.0 + np.tanh(deeper))
    strip = press(c.compliance, c.tread, depth, extra=c.extra, n_nodes=c.phi.shape[1])
    return state.but(contact=strip, belt=strip.displacement)
