"""Texture of the road at the edges of the contact."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.patch import inward, pressed_again
from tirelib.effects.state import State
from tirelib.physics.contact.fourier import evaluate


@effect(
    "roughness",
    stage="contact",
    unit="mm^2",
    low=0.0,
    high=0.5,
    varies_with=("load",),
    source="Greenwood and Williamson (1966) with normal heights and springs as asperities",
)
def roughness(state: State, strength: float) -> State:
    """Rough road touches the tread before and after the contact and smears its edges.

    Heights of variance s add k_t s / (2 |delta'|) to the pressure's integral at each edge, where
    the tread's compression delta begins: E max(delta + z, 0) - max(delta, 0), gathered there.
    """
    c = state.contact
    bend = evaluate(state.belt[..., 0], c.edges, 1)
    slope = np.abs(bend - state.free_radius[:, None] * np.sin(c.edges))
    force = 0.5e-6 * strength * state.k_t[:, None] / slope
    lift = state.radius * np.sum(force * np.cos(c.edges), axis=1)
    return pressed_again(state, inward(state, c.edges, force), lift)
