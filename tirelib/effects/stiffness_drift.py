"""Stiffness that drifts during the campaign."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "stiffness_drift",
    stage="brush",
    unit="1",
    low=-0.4,
    high=0.4,
    varies_with=("order",),
    components=2,
    source="E b / h: a tread that wears gets stiffer; wear during a test (assumed size)",
)
def stiffness_drift(state: BrushState, strength: Sequence[float]) -> BrushState:
    """Stiffness of the bristles drifts from the first run to the last.

    c_p times exp(s1 x / 2 + s2 (x^2 - 1/3)), x from -1 at the first point to 1 at the last: s1 is
    the logarithm of last over first, s2 the bend.
    """
    x = 2.0 * state.conditions.order - 1.0
    curve = 0.5 * strength[0] * x + strength[1] * (x**2 - 1.0 / 3.0)
    factor = np.exp(curve)
    return state.but(c_py=state.c_py * factor, c_px=state.c_px * factor)
