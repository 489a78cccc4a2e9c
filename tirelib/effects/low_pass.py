"""Lag of the amplifier."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects.effect import State, effect
from tirelib.effects.harmonics import orders, with_gain


@effect(
    "low_pass", stage="gage", unit="ms", low=0.0, high=1.0, components=2, varies_with=("speed",),
    source="lag of second order; (1, 0) ms is of first order with a corner at 160 Hz",
)  # fmt: skip
def low_pass(state: State, strength: Sequence[float]) -> State:
    """Amplifier that lags behind the strain.

    Harmonic n over 1 + i w (s_1 + s_2) - w^2 s_2 (1 ms), w = n Omega: later with speed, and
    smaller. s_2 = 0 is of first order; Butterworth's second has s_1 + s_2 = sqrt(2 s_2 (1 ms)).
    """
    lag, square = strength
    w = 1e-3 * orders(state) * np.asarray(state.conditions.omega)[:, None]
    return with_gain(state, 1.0 / (1.0 + 1j * w * (lag + square) - w**2 * square))
