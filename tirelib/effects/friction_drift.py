"""Friction that drifts during the campaign."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "friction_drift",
    stage="brush",
    unit="1",
    low=-0.3,
    high=0.3,
    varies_with=("order",),
    components=2,
    source="wear and polish of tread and road during a test (assumed size)",
)
def friction_drift(state: BrushState, strength: Sequence[float]) -> BrushState:
    """Friction drifts from the first run to the last.

    mu times exp(s1 x / 2 + s2 (x^2 - 1/3)), x from -1 at the first point to 1 at the last: s1 is
    the logarithm of last over first, s2 the bend.
    """
    x = 2.0 * state.conditions.order - 1.0
    curve = 0.5 * strength[0] * x + strength[1] * (x**2 - 1.0 / 3.0)
    return state.but(mu=state.mu * np.exp(curve))
