"""Lag of the amplifier."""

import numpy as np

from tirelib.effects.effect import State, effect


@effect(
    "low_pass", stage="strain", unit="ms", low=0.0, high=1.0, varies_with=("speed",),
    source="first-order lag; 1 ms is a corner at 160 Hz",
)  # fmt: skip
def low_pass(state: State, strength: float) -> State:
    """Amplifier that lags behind the strain.

    Harmonic n over 1 + i n Omega s: later with speed, and smaller.
    """
    n = np.arange(state.strain.shape[1])
    lag = 1e-3 * strength * n * state.conditions.omega[:, None]
    return state.but(strain=state.strain / (1.0 + 1j * lag))
