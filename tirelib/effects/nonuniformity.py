"""Nonuniformity of the tire, once per turn."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "nonuniformity",
    stage="gage",
    unit="ustrain",
    low=-300.0,
    high=300.0,
    components=2,
    varies_with=("angle",),
    source="run-out, imbalance: fixed to the tire as the gage is; the ring has no first harmonic",
)
def nonuniformity(state: State, strength: Sequence[float]) -> State:
    """Nonuniformity of the tire: a wave of one turn at the gage.

    s_1 cos(phi) + s_2 sin(phi): gage and fault turn together, so the wheel angle gives the phase.
    """
    cosine, sine = strength
    wave = cosine * np.cos(state.phi) + sine * np.sin(state.phi)
    return state.but(waveform=state.waveform + 1e-6 * wave)
