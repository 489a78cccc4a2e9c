"""Factors on each harmonic of the waveform: lag, length and place of a gage."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tirelib.core.arrays import IntArray
from tirelib.effects.state import State


def orders(state: State) -> IntArray:
    """Return the orders of the waveform's harmonics, 0 to n_phi / 2."""
    return np.arange(state.phi.size // 2 + 1)


def with_gain(state: State, gain: NDArray[np.inexact[Any]]) -> State:
    """Return a state whose waveform's harmonics are multiplied by gains.

    The measured waveform is filtered as a whole, what large displacements add to it included; so
    such an effect acts at the gage, not on the strain of the linear ring.

    Parameters
    ----------
    state : State
        With a waveform over one turn, in equal steps.
    gain : array, shape (n_points or 1, n_phi // 2 + 1)
        Gain of harmonics exp(i n phi).
    """
    # what changes is added: gains of one change no bit
    change = np.fft.irfft(np.fft.rfft(state.waveform) * (gain - 1.0), n=state.phi.size)
    return state.but(waveform=state.waveform + change)
