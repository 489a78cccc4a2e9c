"""Camber at gages away from the middle."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State
from tirelib.physics.contact.radial import press


@effect(
    "camber",
    stage="contact",
    unit="1",
    low=0.0,
    high=1.5,
    varies_with=("camber", "lateral"),
    needs=("camber",),
    source="dissertation, Fig. 4-16; geometry of tirelib.physics.contact.load_transfer",
)
def camber(state: State, strength: float) -> State:
    """Camber presses one side of the tread deeper than the other.

    The strip at y has d0 (1 + tanh(-s y tan(gamma) / d0)): s = 1 is the geometry of a rigid tread,
    which yields before a strip leaves the road.
    """
    c = state.contact
    deeper = -strength * state.lateral * np.tan(state.conditions.camber) / c.deflection
    if not np.any(deeper):
        return state
    depth = c.deflection * (1.0 + np.tanh(deeper))
    strip = press(c.compliance, c.tread, depth, extra=c.extra, n_nodes=c.phi.shape[1])
    return state.but(contact=strip, belt=strip.displacement)
