"""Gain of the gage."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "gage_gain",
    stage="gage",
    unit="1",
    low=-0.1,
    high=0.1,
    untestable="the strain is in proportion to the innerliner's offset, which the base model fits",
    source="gage factor, glue, calibration of the bridge",
)
def gage_gain(state: State, strength: float) -> State:
    """Gain of the gage other than one.

    1 + s times the waveform.
    """
    return state.but(waveform=(1.0 + strength) * state.waveform)
