"""Saturation of the gage."""

import numpy as np

from tirelib.effects.effect import State, effect

REFERENCE = 5e-3
"""Strain at which the strength says what is lost, [-]."""


@effect(
    "gage_saturation", stage="gage", unit="1", low=0.0, high=1.0, varies_with=("load",),
    source="soft limit of glue and amplifier (assumed form)",
)  # fmt: skip
def gage_saturation(state: State, strength: float) -> State:
    """Gage or amplifier falls short at large strain.

    eps / sqrt(1 + 2 s (eps / 5000 ustrain)^2), its mean over the turn taken off as measured.
    """
    shown = state.waveform / np.sqrt(1.0 + 2.0 * strength * (state.waveform / REFERENCE) ** 2)
    if strength:
        shown = shown - shown.mean(axis=1, keepdims=True)
    return state.but(waveform=shown)
