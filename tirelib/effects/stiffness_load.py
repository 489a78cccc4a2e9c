"""Bristle stiffness over load."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "stiffness_load",
    stage="brush",
    unit="1",
    low=-0.5,
    high=1.0,
    varies_with=("load",),
    source="Pacejka, Tire and Vehicle Dynamics, ch. 4: cornering stiffness less than in proportion "
    "to load",
)
def stiffness_load(state: BrushState, strength: float) -> BrushState:
    """Stiffness of the bristles falls with load.

    c_py and c_px times exp(-s (Fz / Fz0 - 1)). Where no ring gives the contact's length the base
    fits a power of load, and this is the departure from it.
    """
    factor = np.exp(-strength * (state.conditions.load / state.reference_load - 1.0))
    return state.but(c_py=state.c_py * factor, c_px=state.c_px * factor)
