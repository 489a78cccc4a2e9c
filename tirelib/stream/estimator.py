"""The streaming estimator: frames in, the estimates of completed turns out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.errors import FormatError, ParameterError
from tirelib.estimators.calibration import Calibration, Estimates
from tirelib.features.extract import Features, extract_features
from tirelib.flags import TurnFlag
from tirelib.held import HELD, Held
from tirelib.signal.lowpass import LowPass
from tirelib.signal.quality import UNUSABLE
from tirelib.signal.turns import LONGEST_TURN, Turn, TurnCutter, stack_turns
from tirelib.stream.backlog import Backlog
from tirelib.stream.snapshot import from_plain, restore_cutter, snapshot_cutter, to_plain

STATE_FORMAT = "tirelib-stream-state/6"
WATCHDOG_TURNS = 2.0
"""Turns after the middle of the last contact at which an estimate ceases to be valid."""
STANDSTILL = 0.05
"""Turn rate below which a wheel whose rate is measured counts as standing, [rad/s]."""
_OMEGA = HELD.index("omega")
RATES = (100.0, 1e5)
"""Allowed sample rates, [Hz]; an estimator holds 12 s of samples."""


@dataclass(frozen=True, slots=True)
class TurnEstimate:
    """Result of one turn: one row of `Features` and of `Estimates`, SI, ISO 8855.

    Attributes
    ----------
    turn : int
        Number of the turn since the start, from 1.
    features : Features
        Features of one row; ``time`` and ``ready`` are in s since the first sample.
    estimates : Estimates
        Estimates of one row: value, std and valid of Fz, alpha, kappa, Fy; flags, notes, contact
        lengths.
    """

    turn: int
    features: Features
    estimates: Estimates

    @property
    def valid(self) -> bool:
        """Whether the turn was measured well and every calibrated quantity is in range."""
        return bool(self.estimates.turn_valid[0])

    @property
    def flags(self) -> int:
        """`TurnFlag` bits of the turn."""
        return int(self.estimates.flags[0])

    @property
    def time(self) -> float:
        """Middle of the contact, [s since the first sample]."""
        return float(self.features.time[0])

    @property
    def ready(self) -> float:
        """When the last sample that the turn needs was taken, [s since the first sample]."""
        return float(self.features.ready[0])

    def value(self, quantity: str) -> float:
        """Return Fz [N], alpha [rad], kappa [1] or Fy [N]; NaN where it is not to be had."""
        return float(self.estimates.value[quantity][0])

    def std(self, quantity: str) -> float:
        """Return the standard deviation of a quantity, in its unit."""
        return float(self.estimates.std[quantity][0])

    def is_valid(self, quantity: str) -> bool:
        """Return whether a quantity may be used."""
        return bool(self.estimates.valid[quantity][0])


class StreamEstimator:
    """Estimate load, slip angle, slip ratio and lateral force from frames of strain.

    An estimate comes after each contact, at most 20 degrees of wheel angle, half the filter and one
    frame after the trailing edge, and is that of the batch (`observe`, `Calibration.estimate`),
    however the samples are cut into frames. Memory is bounded: the samples of the current turn.

    Between turns the last estimate stands, and `valid` and `flags` say whether it still holds: it
    ceases to when `WATCHDOG_TURNS` turns have passed since its contact (standstill, frozen or dead
    gages, a cut cable), counted in samples, or when a measured turn rate is zero.

    Parameters
    ----------
    calibration : Calibration
    rate : float, [Hz]
        Sample rate of the gages.
    lateral : sequence of float, optional, [m]
        Lateral positions of the gages (ISO) in the order of a frame's rows, checked against the
        calibration.
    tire : str, optional
        Name of the tire, checked against the calibration.

    Raises
    ------
    CalibrationError
        If the gages or the tire are not those of the calibration.
    ParameterError
        If the rate is out of range.
    """

    def __init__(
        self,
        calibration: Calibration,
        rate: float,
        *,
        lateral: Sequence[float] | None = None,
        tire: str | None = None,
    ) -> None:
        low, high = RATES
        if not low <= rate <= high:
            raise ParameterError(
                f"sample rate = {rate} Hz; allowed are {low:g} .. {high:g} Hz; give the rate of "
                "the gages"
            )
        gages = calibration.lateral if lateral is None else tuple(float(y) for y in lateral)
        name = calibration.tire if tire is None else tire
        calibration.check_layout(name, gages, "stream")
        self.calibration = calibration
        self.rate = float(rate)
        self.gages = len(calibration.lateral)
        self._low_pass = LowPass(calibration.order, calibration.cut_off)
        self.reset()

    def reset(self) -> None:
        """Forget everything but the calibration and the rate."""
        self._cutter = TurnCutter(self.calibration.lateral, self.rate, self._low_pass)
        self._backlog = Backlog(self._cutter)
        self._count = 0
        self._turns = 0
        self._latest: TurnEstimate | None = None
        self._complete = False  # no gage was out in the last turn, nor the speed
        self._deadline = LONGEST_TURN * self.rate
        self._standing = -1  # number of the last sample at which the wheel stood
        self._idle = 0.0  # time without samples since the last ones, [s]

    def push(
        self,
        frame: FloatArray,
        *,
        trigger: BoolArray | None = None,
        **held: Unpack[Held],
    ) -> list[TurnEstimate]:
        """Take the next samples and return the estimates of the turns that they complete.

        Parameters
        ----------
        frame : array, shape (n_gages, n), [-]
            Raw strain, oldest first; lost samples are NaN, so that time goes on.
        trigger : array of bool, shape (n,), optional
            True at the sample at which the gages pass the top of the wheel; it only checks.
        **held : array of shape (n,) or a number
            Conditions, see `Held`; those that are not given are unknown.

        Raises
        ------
        ShapeError
            If the frame has another number of gages.
        """
        turns = self._caught_up()
        turns += self._cutter.push(frame, trigger=trigger, **held)
        self._backlog.forget_range()
        self._watch(held.get("omega", math.nan), frame.shape[1])
        if frame.shape[1]:
            self._idle = 0.0
        self._count += frame.shape[1]
        return [self._estimate(turn) for turn in turns] if turns else []

    def take(self, samples: list[float], conditions: Sequence[float]) -> list[TurnEstimate]:
        """Like `push`, for short frames of plain numbers; samples that cannot end a turn wait.

        Parameters
        ----------
        samples : list of float
            Raw strain, sample by sample, oldest first.
        conditions : sequence of float
            What holds during the frame, in the order of `HELD`; NaN where unknown.
        """
        n = len(samples) // self.gages
        standing = -STANDSTILL < conditions[_OMEGA] < STANDSTILL
        if not standing and self._backlog.keep(samples, n, conditions):
            self._idle = 0.0
            self._count += n
            return []
        frame: FloatArray = np.array(samples, dtype=np.float64).reshape(n, self.gages).T
        held: Any = dict(zip(HELD, conditions, strict=True))
        return self.push(frame, **held)

    def _caught_up(self) -> list[Turn]:
        """Give the waiting samples to the cutter; no turn ends in them."""
        if not self._backlog.count:
            return []
        strain, rows = self._backlog.drained()
        held: Any = dict(zip(HELD, rows, strict=True))
        return self._cutter.push(strain, **held)

    def wait(self, time: float) -> None:
        """Let time [s] go by in which no samples came; they may still come later.

        The estimate ages and its watchdog runs, but the signal is not cut: the next sample follows
        the last.
        """
        self._idle += time

    def _watch(self, omega: FloatArray | float, n: int) -> None:
        """Note the last sample at which the wheel stood."""
        if isinstance(omega, np.ndarray):
            standing = np.flatnonzero(np.abs(omega) < STANDSTILL)
            if standing.size:
                self._standing = self._count + int(standing[-1])
        elif abs(omega) < STANDSTILL and n:
            self._standing = self._count + n - 1

    def _estimate(self, turn: Turn) -> TurnEstimate:
        self._turns += 1
        features = extract_features(stack_turns([turn], self._cutter.lateral, self.rate))
        self._latest = TurnEstimate(self._turns, features, self.calibration.estimate(features))
        no_speed = bool(turn.flags & TurnFlag.NO_SPEED)
        self._complete = not (no_speed or self._gage_out(turn.gage_flags))
        period = turn.period if math.isfinite(turn.period) else LONGEST_TURN / WATCHDOG_TURNS
        self._deadline = (turn.time + WATCHDOG_TURNS * period) * self.rate
        return self._latest

    def _gage_out(self, flags: IntArray) -> bool:
        """Return whether a gage is missing, saturated or frozen; no contact does not count."""
        silent = (flags & int(TurnFlag.DEAD_GAGE)) != 0
        if ((flags & int(UNUSABLE)) != 0)[~silent].any():
            return True
        with np.errstate(invalid="ignore"):
            swing = np.ptp(self._cutter.needed()[: self.gages][silent], axis=1)
        return not bool((np.isfinite(swing) & (swing > 0.0)).all())

    @property
    def latest(self) -> TurnEstimate | None:
        """The last turn's estimate; None before the first contact."""
        return self._latest

    @property
    def turns(self) -> int:
        """Number of contacts since the start."""
        return self._turns

    @property
    def time(self) -> float:
        """Time taken by the samples so far, [s]."""
        return self._count / self.rate

    @property
    def elapsed(self) -> float:
        """Time taken by the samples so far, and that waited for since the last, [s]."""
        return self.time + self._idle

    @property
    def age(self) -> float:
        """Time since the last estimate was made, [s]; NaN before the first."""
        if self._latest is None:
            return math.nan
        return self.elapsed - self._latest.ready

    @property
    def stale(self) -> bool:
        """Whether contacts have stayed away for too long, or the wheel stands."""
        if self._count + self._idle * self.rate > self._deadline:
            return True
        ready = -1.0 if self._latest is None else self._latest.ready * self.rate
        return self._standing >= 0 and self._standing + 1 > ready

    @property
    def flags(self) -> int:
        """`TurnFlag` bits that hold now: those of the last turn, and the watchdog's."""
        own = int(TurnFlag.FIRST_TURN) if self._latest is None else self._latest.flags
        return own | int(TurnFlag.NO_CONTACT) if self.stale else own

    @property
    def valid(self) -> bool:
        """Whether all is well: every calibrated quantity may be used now, no gage or speed is out.

        With one gage out, or without a speed, the quantities that `is_valid` names may still be
        used. A gage whose strip does not touch the road, but lives, is not out.
        """
        return self._latest is not None and self._latest.valid and self._complete and not self.stale

    def is_valid(self, quantity: str) -> bool:
        """Return whether a quantity of the last estimate may be used now."""
        return self._latest is not None and self._latest.is_valid(quantity) and not self.stale

    def state(self) -> dict[str, Any]:
        """Return everything that the estimator remembers, as JSON knows it.

        An estimator of the same calibration and rate that restores it goes on exactly alike.
        """
        self._caught_up()
        return {
            "format": STATE_FORMAT,
            "rate": self.rate,
            "lateral": list(self.calibration.lateral),
            "count": self._count,
            "turns": self._turns,
            "complete": self._complete,
            "deadline": self._deadline,
            "standing": self._standing,
            "idle": self._idle.hex(),
            "latest": to_plain(self._latest),
            "cutter": snapshot_cutter(self._cutter),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state.

        Raises
        ------
        FormatError
            If it is no state of this version, or of another rate or gage layout.
        """
        given = state.get("format")
        if given != STATE_FORMAT:
            raise FormatError(
                f"state: format = {given!r}; this version reads {STATE_FORMAT!r}; save it anew"
            )
        if state["rate"] != self.rate or state["lateral"] != list(self.calibration.lateral):
            raise FormatError(
                f"state: it is of {state['rate']:g} Hz and gages at {state['lateral']} m, the "
                f"estimator of {self.rate:g} Hz and {list(self.calibration.lateral)} m; restore "
                "it where it was saved"
            )
        self.reset()
        restore_cutter(self._cutter, state["cutter"])
        self._count, self._turns = state["count"], state["turns"]
        self._deadline, self._standing = state["deadline"], state["standing"]
        self._complete = state["complete"]
        self._idle = float.fromhex(state["idle"])
        self._latest = from_plain(state["latest"])
