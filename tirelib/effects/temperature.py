"""Softening of rubber as the tire warms up."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 293.15
"""Temperature at which nothing changes, [K]."""
SPAN = 50.0
"""Warming that the strength stands for, [K]."""


@effect(
    "temperature",
    stage="stiffness",
    unit="1",
    low=0.0,
    high=0.4,
    varies_with=("temperature", "order"),
    source="assumed: rubber modulus falls by some 10 % per 20 K above room temperature",
)
def temperature(state: State, strength: float) -> State:
    """Rubber of sidewall and tread softens as the tire warms up.

    k_u, k_v, k_t times exp(-s x), x = (T - 20 degC) / 50 K where the temperature is measured in
    every run, else x = place in the campaign, 0 first to 1 last.
    """
    warmth = (state.conditions.temperature - REFERENCE) / SPAN
    x = warmth if np.isfinite(warmth).all() else state.conditions.order
    soft = np.exp(-strength * x)
    return state.but(k_u=state.k_u * soft, k_v=state.k_v * soft, k_t=state.k_t * soft)
