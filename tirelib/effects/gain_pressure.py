"""Gain of the gage that goes with the pressure."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 2e5
"""Gauge pressure at which the gain is as calibrated, [Pa]."""


@effect(
    "gain_pressure",
    stage="gage",
    unit="1",
    low=-0.2,
    high=0.2,
    varies_with=("pressure",),
    source="pressure on the foil and its cover (assumed size)",
)
def gain_pressure(state: State, strength: float) -> State:
    """Gain of the gage that goes with the pressure.

    1 + s (p / 2 bar - 1) times the waveform.
    """
    growth = state.conditions.pressure / REFERENCE - 1.0
    return state.but(waveform=state.waveform * (1.0 + strength * growth)[:, None])
