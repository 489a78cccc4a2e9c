"""Gain of the gage that goes with the speed."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 20.0
"""Speed at which the gain is as calibrated, [m/s]."""


@effect(
    "gain_speed",
    stage="gage",
    unit="1",
    low=-0.2,
    high=0.2,
    varies_with=("speed",),
    source="supply by an energy harvester, heat of a rolling tire (assumed size)",
)
def gain_speed(state: State, strength: float) -> State:
    """Gain of the gage that goes with the speed.

    1 + s (v / 20 m/s - 1) times the waveform.
    """
    growth = state.conditions.speed / REFERENCE - 1.0
    return state.but(waveform=state.waveform * (1.0 + strength * growth)[:, None])
