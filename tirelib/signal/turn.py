"""One turn of strain over wheel angle, and several of them stacked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray, IntArray
from tirelib.traces import Conditions, StrainTrace

PHI = np.linspace(-1.0, 0.8, 361)
"""Wheel-angle grid of a turn, [rad]; zero is the middle of the centre gage's pulse."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn; arrays over gages and wheel angle. NaN values are explained by the flags.

    `time` is the middle of the contact pulse, [s since the start]; `ready` is when the last sample
    that the turn needs was taken, [s]. `omega` and `speed` are those at the middle of the contact,
    `period` is that of the turn before it.
    """

    time: float
    ready: float
    period: float
    omega: float
    angle_std: float
    slip_std: float
    pulse: float
    axis_shift: float
    speed: float
    pressure: float
    camber: float
    friction: float
    tread_depth: float
    tread_temperature: float
    offset: FloatArray
    offset_std: FloatArray
    mean: FloatArray
    strain: FloatArray
    rate: FloatArray
    gage_flags: IntArray
    flags: int


@dataclass(frozen=True, slots=True)
class Turns:
    """Several turns of one wheel.

    Attributes
    ----------
    trace : StrainTrace
    time, ready, period : shape (n,), [s]
    angle_std, slip_std : shape (n,), [1]
        Relative standard deviation of wheel angles about the contact, and of the ratio of turn rate
        to speed there.
    offset : shape (n, n_gages), [-]
        Strain opposite the contact: hoop strain of inflation and speed, and the gage's zero.
    offset_std : shape (n, n_gages), [-]
        Standard deviation of the offset.
    mean : shape (n, n_gages), [-]
        Mean strain of the preceding turn, less the offset.
    friction, tread_depth, tread_temperature : shape (n,), [1], [m], [K]
        What was said of road and tread; NaN where unknown.
    gage_flags : shape (n, n_gages); flags : shape (n,)
        `TurnFlag` bits.
    rate_hz : float, [Hz]
    """

    trace: StrainTrace
    time: FloatArray
    ready: FloatArray
    period: FloatArray
    angle_std: FloatArray
    slip_std: FloatArray
    offset: FloatArray
    offset_std: FloatArray
    mean: FloatArray
    friction: FloatArray
    tread_depth: FloatArray
    tread_temperature: FloatArray
    gage_flags: IntArray
    flags: IntArray
    rate_hz: float

    def __len__(self) -> int:
        return int(self.time.shape[0])


def stack_turns(turns: Sequence[Turn], lateral: FloatArray, rate: float) -> Turns:
    """Stack single turns along a new first axis."""
    gages = lateral.size

    def column(name: str) -> FloatArray:
        return np.array([getattr(turn, name) for turn in turns], dtype=np.float64)

    def rows(name: str, *shape: int) -> FloatArray:
        return column(name).reshape(len(turns), *shape)

    trace = StrainTrace(
        phi=PHI,
        strain=rows("strain", gages, PHI.size),
        rate=rows("rate", gages, PHI.size),
        pulse=column("pulse"),
        lateral=lateral,
        axis_shift=column("axis_shift"),
        conditions=Conditions(
            omega=column("omega"),
            speed=column("speed"),
            pressure=column("pressure"),
            camber=column("camber"),
        ),
    )
    return Turns(
        trace=trace,
        time=column("time"),
        ready=column("ready"),
        period=column("period"),
        angle_std=column("angle_std"),
        slip_std=column("slip_std"),
        offset=rows("offset", gages),
        offset_std=rows("offset_std", gages),
        mean=rows("mean", gages),
        friction=column("friction"),
        tread_depth=column("tread_depth"),
        tread_temperature=column("tread_temperature"),
        gage_flags=rows("gage_flags", gages).astype(np.int64),
        flags=column("flags").astype(np.int64),
        rate_hz=rate,
    )
