"""Estimates of a continuous recording, block by block: hours of driving in bounded memory.

The turns are those of a batch: the same `TurnCutter`, `extract_features` and `Calibration`. After a
gap that no turn can span the cutter begins again, and the first turn after it is flagged.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.campaign.blocks import Block, blocks
from tirelib.campaign.recording import Recording, Wheel
from tirelib.core.arrays import FloatArray
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.estimate import Estimates
from tirelib.measured.features.extract import Features, extract_features
from tirelib.measured.signal import LowPass, Turn, TurnCutter, Turns, stack_turns

RATES_ALIKE = 1e-4
"""Relative difference of two files' sample rates up to which one follows the other: a tenth of what
a campaign allows a declared rate (`tirelib.campaign.timebase`)."""
ANCHORS = 16
"""Blocks whose times are kept: a turn reaches back 6 s at most, a block holds more."""


@dataclass(frozen=True, slots=True)
class WheelTurns:
    """Turns of one wheel of a recording that follow each other.

    Attributes
    ----------
    wheel : Wheel
    features : Features
        `time` and `ready` are in s since the start of the recording, on its own clock.
    estimates : Estimates
    until : float, [s]
        Time up to which the recording was read.
    missing : int
        Samples that are missing in the centre gage of this part.
    fresh : bool
        The part begins after a gap that no turn spans, or at the start.
    """

    wheel: Wheel
    features: Features
    estimates: Estimates
    until: float
    missing: int
    fresh: bool


def estimate_recording(recording: Recording, calibration: Calibration) -> Iterator[WheelTurns]:
    """Yield the estimates of a recording, wheel after wheel and part after part.

    Parameters
    ----------
    recording : Recording
    calibration : Calibration
        Calibration of the tires of all wheels.

    Raises
    ------
    CalibrationError
        If a wheel has another tire or other gages.
    FormatError
        If a block of the recording cannot be read (`tirelib.campaign.blocks.blocks`).
    """
    for wheel in recording.wheels:
        calibration.check_layout(wheel.tire, wheel.lateral, f"{recording.path}, {wheel.name}")
    for wheel in recording.wheels:
        cutter = _Cutter(wheel, calibration)
        for block in blocks(recording, wheel):
            features = extract_features(cutter.cut(block))
            yield WheelTurns(
                wheel,
                features,
                calibration.estimate(features),
                float(block.time[-1]),
                int(np.isnan(block.strain[cutter.centre]).sum()),
                block.fresh,
            )


class _Cutter:
    """A `TurnCutter` that begins again after long gaps; times are on the recording's clock."""

    def __init__(self, wheel: Wheel, calibration: Calibration) -> None:
        self._lateral = np.asarray(wheel.lateral, dtype=np.float64)
        self._low_pass = LowPass(calibration.order, calibration.cut_off)
        self.centre = int(np.argmin(np.abs(wheel.lateral)))
        self._rate = np.nan

    def cut(self, block: Block) -> Turns:
        """Return the turns that end in a block."""
        if block.fresh or not np.isclose(self._rate, block.rate, rtol=RATES_ALIKE, atol=0.0):
            self._rate = block.rate
            self._cutter = TurnCutter(tuple(self._lateral), block.rate, self._low_pass)
            self._taken, self._numbers, self._times = 0, list[float](), list[float]()
        held: Any = block.held
        turns = self._cutter.push(block.strain, trigger=block.trigger, **held)
        self._numbers += [self._taken, self._taken + block.time.size - 1]
        self._times += [float(block.time[0]), float(block.time[-1])]
        self._taken += block.time.size
        del self._numbers[:-ANCHORS], self._times[:-ANCHORS]
        return stack_turns([self._timed(turn) for turn in turns], self._lateral, block.rate)

    def _timed(self, turn: Turn) -> Turn:
        """Return a turn with its times on the recording's clock."""
        numbers: FloatArray = np.array([turn.time, turn.ready]) * self._rate
        time, ready = np.interp(numbers, self._numbers, self._times)
        return replace(turn, time=float(time), ready=float(ready))
