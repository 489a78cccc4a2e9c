"""Gain of the gage that goes with the load."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 4e3
"""Load at which the gain is as calibrated, [N]."""


@effect(
    "gain_load",
    stage="gage",
    unit="1",
    low=-0.2,
    high=0.2,
    varies_with=("load",),
    source="soft glue that gives way, an amplifier that is not linear (assumed size)",
)
def gain_load(state: State, strength: float) -> State:
    """Gain of the gage that goes with the load.

    1 + s (Fz / 4 kN - 1) times the waveform.
    """
    growth = state.conditions.load / REFERENCE - 1.0
    return state.but(waveform=state.waveform * (1.0 + strength * growth)[:, None])
