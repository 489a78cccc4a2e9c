"""Radial sidewall stiffness over deflection."""

import numpy as np

from tirelib.effects.effect import State, effect

REFERENCE = 0.020
"""Deflection at which the base model's k_u holds, [m]."""


@effect(
    "sidewall_load",
    stage="stiffness",
    unit="1",
    low=0.0,
    high=0.8,
    varies_with=("load",),
    source="dissertation, Eq. (54): k_u = A exp(B d0), B < 0",
)
def sidewall_load(state: State, strength: float) -> State:
    """Radial stiffness of the sidewall falls as the tire is pressed.

    k_u exp(-s (d0 / 20 mm - 1)): s is the relative fall from 20 to 40 mm, about; B = -s / 20 mm.
    """
    return state.but(k_u=state.k_u * np.exp(-strength * (state.deflection / REFERENCE - 1.0)))
