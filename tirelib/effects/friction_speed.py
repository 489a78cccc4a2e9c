"""Friction over sliding speed."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect

SPAN = 10.0
"""Sliding speed that the strength stands for, [m/s]."""


@effect(
    "friction_speed",
    stage="brush",
    unit="1",
    low=-0.2,
    high=0.8,
    varies_with=("speed",),
    needs=("speed",),
    source="Savkoor, 1966: friction of sliding rubber over speed",
)
def friction_speed(state: BrushState, strength: float) -> BrushState:
    """Friction falls with the speed at which the tread slides.

    mu times exp(-s v_s / (10 m/s)), v_s = v sqrt(kappa^2 + tan^2 alpha).
    """
    slip = np.hypot(state.slip_ratio, np.tan(state.slip_angle))
    sliding = np.abs(state.conditions.speed) * slip
    return state.but(mu=state.mu * np.exp(-strength * sliding / SPAN))
