"""Bristle stiffness over tread temperature."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect

REFERENCE, SPAN = 323.15, 50.0
"""Temperature at which nothing changes, and warming that the strength stands for, [K]."""


@effect(
    "stiffness_temperature",
    stage="brush",
    unit="1",
    low=-0.1,
    high=1.0,
    varies_with=("temperature",),
    needs=("temperature",),
    source="assumed: rubber modulus falls by some 10 % per 20 K above room temperature",
)
def stiffness_temperature(state: BrushState, strength: float) -> BrushState:
    """Tread rubber softens as it warms up.

    c_py and c_px times exp(-s (T - 50 degC) / 50 K), T of the tread.
    """
    factor = np.exp(-strength * (state.conditions.temperature - REFERENCE) / SPAN)
    return state.but(c_py=state.c_py * factor, c_px=state.c_px * factor)
