"""The streaming estimator in numpy: the readable reference of the compiled core."""

import math
from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD, Held
from tirelib.estimators.estimate import QUANTITIES
from tirelib.measured.features.extract import reference_features
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.quality import UNUSABLE
from tirelib.measured.signal.turns import LONGEST_TURN, Turn, TurnCutter, stack_turns
from tirelib.stream.backlog import Backlog
from tirelib.stream.estimate import TurnEstimate
from tirelib.stream.estimator import STANDSTILL, WATCHDOG_TURNS, StreamEstimator
from tirelib.stream.snapshot import from_plain, restore_cutter, snapshot_cutter, to_plain

STATE_FORMAT = "tirelib-stream-state/8"
_OMEGA = HELD.index("omega")


class NumpyEstimator(StreamEstimator):
    """`StreamEstimator` in numpy and scipy, as the Python FMU runs it."""

    def reset(self) -> None:
        """Forget everything but the calibration and the rate."""
        low_pass = LowPass(self.calibration.order, self.calibration.cut_off)
        self._cutter = TurnCutter(self.calibration.lateral, self.rate, low_pass)
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
        """Take the next samples and return the estimates of the turns that they complete."""
        turns = self._caught_up()
        turns += self._cutter.push(frame, trigger=trigger, **held)
        self._backlog.forget_range()
        self._watch(held.get("omega", math.nan), frame.shape[1])
        if frame.shape[1]:
            self._idle = 0.0
        self._count += frame.shape[1]
        return [self._estimate(turn) for turn in turns] if turns else []

    def take(self, samples: list[float], conditions: Sequence[float]) -> list[TurnEstimate]:
        """Like `push`, for short frames of plain numbers; samples that cannot end a turn wait."""
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
        """Let time [s] go by in which no samples came; they may still come later."""
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
        features = reference_features(stack_turns([turn], self._cutter.lateral, self.rate))
        found = self.calibration.reference_estimate(features)
        self._latest = TurnEstimate(self._turns, features, found)
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
        """Whether all is well."""
        if self._latest is None or not self._latest.valid or not self._complete:
            return False
        known = self.calibration.chains[-1]
        return all(self.is_valid(quantity) for quantity in QUANTITIES if known.has(quantity))

    def is_valid(self, quantity: str) -> bool:
        """Return whether a quantity of the last estimate may be used now."""
        return self._latest is not None and self._latest.is_valid(quantity) and not self.stale

    def state(self) -> dict[str, Any]:
        """Return everything that the estimator remembers, as JSON knows it."""
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
        """Take up a state."""
        self.check_state(state, STATE_FORMAT)
        self.reset()
        restore_cutter(self._cutter, state["cutter"])
        self._count, self._turns = state["count"], state["turns"]
        self._deadline, self._standing = state["deadline"], state["standing"]
        self._complete = state["complete"]
        self._idle = float.fromhex(state["idle"])
        self._latest = from_plain(state["latest"])
