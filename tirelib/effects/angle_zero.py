"""Zero of the wheel angle."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.harmonics import orders, with_gain
from tirelib.effects.state import State


@effect(
    "angle_zero",
    stage="gage",
    unit="rad",
    low=-0.03,
    high=0.03,
    exact=True,
    source="trigger mounted off the top of the wheel; gages glued off their mark",
)
def angle_zero(state: State, strength: float) -> State:
    """Zero of the wheel angle beside the axle.

    The whole waveform comes later by s, at every speed.
    """
    return with_gain(state, np.exp(-1j * orders(state)[None] * strength))
