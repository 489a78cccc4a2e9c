"""Saturation of the gage."""

import numpy as np

from tirelib.core.errors import ParameterError
from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 5e-3
"""Strain at which the strength is the lost share, [-]."""


@effect(
    "gage_saturation",
    stage="gage",
    unit="1",
    low=0.0,
    high=1.0,
    varies_with=("load",),
    source="soft limit of glue and amplifier (assumed form)",
)
def gage_saturation(state: State, strength: float) -> State:
    """Gage or amplifier falls short at large strain.

    eps / sqrt(1 + 2 s (eps / 5000 ustrain)^2), its mean over the turn taken off as measured.
    """
    short = 1.0 + 2.0 * strength * (state.waveform / REFERENCE) ** 2
    if np.min(short) <= 0.0:
        raise ParameterError(
            f"gage_saturation: at strength {strength:g} a gage would show more than any strain; "
            "strengths are positive, a gage falls short"
        )
    shown = state.waveform / np.sqrt(short)
    if strength:
        shown = shown - shown.mean(axis=1, keepdims=True)
    return state.but(waveform=shown)
