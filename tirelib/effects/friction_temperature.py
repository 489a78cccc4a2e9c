"""Friction over tread temperature."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect

REFERENCE, SPAN = 323.15, 50.0
"""Temperature at which nothing changes, and warming that the strength stands for, [K]."""


@effect(
    "friction_temperature",
    stage="brush",
    unit="1",
    low=-0.8,
    high=0.8,
    varies_with=("temperature",),
    needs=("temperature",),
    source="rubber friction over temperature and speed has one peak (Grosch); below it friction "
    "rises, above it falls",
)
def friction_temperature(state: BrushState, strength: float) -> BrushState:
    """Friction changes as the tread warms up.

    mu times exp(-s (T - 50 degC) / 50 K), T of the tread; s < 0 below the rubber's best.
    """
    warmth = (state.conditions.temperature - REFERENCE) / SPAN
    return state.but(mu=state.mu * np.exp(-strength * warmth))
