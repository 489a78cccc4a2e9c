"""One turn of strain over wheel angle, and several of them stacked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.flags import TurnFlag
from tirelib.core.traces import StrainTrace, TraceConditions

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
class TurnValues:
    """What is known of turns besides their curves; features have the same.

    Attributes
    ----------
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
    """

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

    def __len__(self) -> int:
        return int(self.time.shape[0])


@dataclass(frozen=True, slots=True)
class Turns(TurnValues):
    """Several turns of one wheel.

    Attributes
    ----------
    trace : StrainTrace
    rate_hz : float, [Hz]
    """

    trace: StrainTrace
    rate_hz: float


def unknown_turn(time: float, ready: float, gages: int, flags: TurnFlag) -> Turn:
    """Return the turn of a contact without a preceding turn: its values are unknown."""
    values: dict[str, Any] = {field.name: np.nan for field in fields(Turn)}
    values |= dict.fromkeys(("offset", "offset_std", "mean"), np.full(gages, np.nan))
    values |= dict.fromkeys(("strain", "rate"), np.full((gages, PHI.size), np.nan))
    values |= {"gage_flags": np.zeros(gages, dtype=np.int64), "flags": int(flags)}
    return Turn(**{**values, "time": time, "ready": ready})


def stack_turns(turns: Sequence[Turn], lateral: FloatArray, rate: float) -> Turns:
    """Stack single turns along a new first axis."""
    shapes = dict.fromkeys(("offset", "offset_std", "mean", "gage_flags"), (lateral.size,))
    curves = dict.fromkeys(("strain", "rate"), (lateral.size, PHI.size))
    columns = {
        field.name: np.array([getattr(turn, field.name) for turn in turns], dtype=np.float64)
        for field in fields(Turn)
    }
    for name, shape in {**shapes, **curves}.items():
        columns[name] = columns[name].reshape(len(turns), *shape)
    return turns_of(columns, lateral, rate)


def turns_of(columns: Mapping[str, Any], lateral: FloatArray, rate: float) -> Turns:
    """Return the turns of whose attributes, by the names of `Turn`, these are the columns."""
    conditions = ("omega", "speed", "pressure", "camber")
    trace = StrainTrace(
        phi=PHI,
        lateral=lateral,
        conditions=TraceConditions(**{name: columns[name] for name in conditions}),
        **{name: columns[name] for name in ("strain", "rate", "pulse", "axis_shift")},
    )
    values = {field.name: columns[field.name] for field in fields(TurnValues)}
    for name in ("gage_flags", "flags"):
        values[name] = values[name].astype(np.int64)
    return Turns(trace=trace, rate_hz=rate, **values)
