"""Flags of a turn: its faults, and whether it may still be used."""

from enum import IntFlag
from functools import lru_cache


class TurnFlag(IntFlag):
    """Observations in one turn; several flags may be set together.

    The value is what an FMU's ``flags`` output carries, so a number, once given, stays.
    """

    FIRST_TURN = 1
    """No preceding turn: its period and its offset are unknown."""
    GAP = 2
    """Samples are missing (lost frame, NaN) in a gage where they are needed."""
    BRIDGED = 4
    """Up to two missing or spiked samples were replaced by a straight line."""
    SPIKE = 8
    """A spike was seen."""
    SATURATED = 16
    """A gage is constant at the end of its range inside the window."""
    DEAD_GAGE = 32
    """A gage shows no contact while its neighbours do."""
    PERIOD_JUMP = 64
    """The turn lasted less than half or more than twice the one before."""
    TRIGGER_MISMATCH = 128
    """The trigger does not come once per contact."""
    DRIFT = 256
    """The offset of a gage moved by more than a twentieth of its swing within one turn."""
    NO_SPEED = 512
    """The travel speed is unknown or zero: no slip ratio."""
    REVERSED = 1024
    """The travel speed is negative; the calibration holds for forward rolling."""
    OUT_OF_RANGE = 2048
    """A regressor or a condition lies outside the calibrated range."""
    CUT_OFF = 4096
    """The filter's cut-off does not suit the turn rate or the sample rate."""
    REDUCED_GAGES = 8192
    """One gage is out; the estimate comes from the others."""
    TOO_FEW_GAGES = 16384
    """The centre gage, or more than one gage, is out: no estimate."""
    NO_CONDITION = 32768
    """A condition that the calibration needs (pressure, camber, speed) is unknown."""
    WEAK_EDGE = 65536
    """A peak lies at the border of its search range: the edge is not distinct."""
    NO_CONTACT = 131072
    """No contact for two turns (standstill, gages frozen or dead). Live only: a batch has turns."""
    FAULT = 262144
    """The estimator met an error that it did not expect; the log names it. Live only."""
    OTHER_TIRE = 1048576
    """The strain pattern is not that of the calibrated tire: another tire, another state of it, or
    gages that do not agree, as in a wrong order."""

    ACCELERATING = 524288
    """The turn rate changes within the turn by more than its sources show: angles are uncertain."""
    OMEGA_MISMATCH = 2097152
    """The measured turn rate is less than two thirds, or more than 1.5 times, what the contacts
    give, or its sign is not the speed's."""


INVALIDATING = (
    TurnFlag.FIRST_TURN
    | TurnFlag.PERIOD_JUMP
    | TurnFlag.ACCELERATING
    | TurnFlag.TRIGGER_MISMATCH
    | TurnFlag.OMEGA_MISMATCH
    | TurnFlag.REVERSED
    | TurnFlag.OUT_OF_RANGE
    | TurnFlag.CUT_OFF
    | TurnFlag.TOO_FEW_GAGES
    | TurnFlag.NO_CONDITION
    | TurnFlag.NO_CONTACT
    | TurnFlag.FAULT
    | TurnFlag.OTHER_TIRE
)
"""Flags with which no estimate of the turn is valid."""


def flag_names(value: int) -> list[str]:
    """Return the lower-case names of the flags set in `value`.

    Examples
    --------
    >>> flag_names(TurnFlag.SPIKE | TurnFlag.FIRST_TURN)
    ['first_turn', 'spike']
    """
    return list(_names(int(value)))


@lru_cache(maxsize=1024)
def _names(value: int) -> tuple[str, ...]:
    """Return them; at every step of a stream they are asked for, and seldom others."""
    return tuple(flag.name.lower() for flag in TurnFlag if flag & value and flag.name)
