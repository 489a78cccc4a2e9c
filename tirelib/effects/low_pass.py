"""Lag of the amplifier."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.harmonics import orders, with_gain
from tirelib.effects.state import State


@effect(
    "low_pass",
    stage="gage",
    unit="ms",
    low=0.0,
    high=1.0,
    components=2,
    start=(0.1, 0.0),
    varies_with=("speed",),
    source="lag of second order; of first order, 1 ms is a corner at 160 Hz",
)
def low_pass(state: State, strength: Sequence[float]) -> State:
    """Amplifier that lags behind the strain.

    Harmonic n over 1 + i w s_1 + w^2 (s_2 (1 ms) - s_1^2 / 2), w = n Omega: s_1 makes it later, as
    flat as Butterworth's second order does, and s_2 smaller; s_2 (1 ms) = s_1^2 / 2 is first order.
    Beside a delay that is not known, a lag and a lead of one size leave the same to second order.
    """
    lag, weaker = strength
    w = 1e-3 * orders(state) * np.asarray(state.conditions.omega)[:, None]
    return with_gain(state, 1.0 / (1.0 + 1j * w * lag + w**2 * (weaker - 0.5 * lag**2)))
