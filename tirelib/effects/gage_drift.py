"""Drift of the gage's gain during the campaign."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "gage_drift",
    stage="gage",
    unit="1",
    low=-0.1,
    high=0.1,
    varies_with=("order",),
    source="glue, gage factor and supply over time and temperature (assumed size)",
)
def gage_drift(state: State, strength: float) -> State:
    """Gain of the gage that drifts during the campaign.

    1 + s (o - 1/2) times the waveform, o the place in the campaign from 0 to 1.
    """
    return state.but(
        waveform=state.waveform * (1.0 + strength * (state.conditions.order - 0.5))[:, None]
    )
