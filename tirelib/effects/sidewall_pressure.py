"""Radial sidewall stiffness over inflation pressure."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 2.0e5
"""Pressure about which the departure is counted, [Pa]."""


@effect(
    "sidewall_pressure",
    stage="stiffness",
    unit="1",
    low=-5.0,
    high=5.0,
    varies_with=("pressure",),
    source="dissertation, Fig. 6-18: k_u is nearly the same at 2.1 and 2.5 bar; assumed form",
)
def sidewall_pressure(state: State, strength: float) -> State:
    """Radial stiffness of the sidewall departs from its straight line over pressure.

    k_u exp(s (p / 2 bar - 1)^2): the line itself belongs to the base model.
    """
    above = state.conditions.pressure / REFERENCE - 1.0
    return state.but(k_u=state.k_u * np.exp(strength * above**2))
