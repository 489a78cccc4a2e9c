"""Stiffening of rubber with the rate of its deformation."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 20.0
"""Belt speed at which the strength counts with ln 2, [m/s]."""


@effect(
    "dynamic_stiffening",
    stage="stiffness",
    unit="1",
    low=0.0,
    high=0.5,
    varies_with=("speed",),
    source="storage modulus of filled rubber grows with the logarithm of frequency (assumed size)",
)
def dynamic_stiffening(state: State, strength: float) -> State:
    """Rubber of sidewall and tread is stiffer the faster the tire rolls.

    k_u, k_v, k_t times (1 + v / 20 m/s)^s with the belt's speed v = R Omega.
    """
    speed = state.radius * np.abs(state.conditions.omega)
    stiff = (1.0 + speed / REFERENCE) ** strength
    return state.but(k_u=state.k_u * stiff, k_v=state.k_v * stiff, k_t=state.k_t * stiff)
