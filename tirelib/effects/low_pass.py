"""Lag of the amplifier."""

from tirelib.effects.effect import State, effect
from tirelib.effects.harmonics import orders, with_gain


@effect(
    "low_pass", stage="gage", unit="ms", low=0.0, high=1.0, varies_with=("speed",),
    source="first-order lag; 1 ms is a corner at 160 Hz",
)  # fmt: skip
def low_pass(state: State, strength: float) -> State:
    """Amplifier that lags behind the strain.

    Harmonic n over 1 + i n Omega s: later with speed, and smaller.
    """
    lag = 1e-3 * strength * orders(state) * state.conditions.omega[:, None]
    return with_gain(state, 1.0 / (1.0 + 1j * lag))
