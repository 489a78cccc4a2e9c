"""Lateral force that lags behind the slip angle."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "relaxation",
    stage="brush",
    unit="m",
    low=0.0,
    high=1.0,
    varies_with=("slip_angle", "speed"),
    needs=("speed", "slip_rate"),
    source="Pacejka, Tire and Vehicle Dynamics, ch. 7: first-order lag over the relaxation length",
)
def relaxation(state: BrushState, strength: float) -> BrushState:
    """Slip at the bristles lags by a rolled distance.

    alpha - (s / v) d alpha / dt: the lag of first order in a slow sweep, nothing in steady runs.
    """
    at = state.conditions
    lag = strength * at.slip_rate / np.abs(at.speed)
    return state.but(slip_angle=state.slip_angle - lag)
