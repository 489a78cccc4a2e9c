"""The streaming estimator of the compiled core, see `tirelib.core.compiled`."""

import ctypes as c
from base64 import b64decode, b64encode
from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.compiled import (
    EstimateStruct,
    FeatureStruct,
    OutputStruct,
    TurnStruct,
    block_of,
    columns_of,
    memory,
)
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD, Held
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.compiled import core_calibration, estimates_of
from tirelib.estimators.estimate import QUANTITIES
from tirelib.measured.features.compiled import attributes_of
from tirelib.measured.features.extract import Features
from tirelib.measured.signal.compiled import beyond_samples
from tirelib.measured.signal.turns import check_gages
from tirelib.stream.estimate import TurnEstimate
from tirelib.stream.estimator import StreamEstimator
from tirelib.stream.snapshot import from_plain, to_plain

STATE_FORMAT = "tirelib-core-state/3"


class CompiledEstimator(StreamEstimator):
    """`StreamEstimator` of the compiled core.

    Raises
    ------
    FormatError
        If there is no core for this machine, or it does not know the calibration.
    """

    @classmethod
    def knows(cls, calibration: Calibration) -> bool:
        """Return whether there is a core for this machine that knows the calibration."""
        return core_calibration(calibration) is not None

    def reset(self) -> None:
        """Forget everything but the calibration and the rate."""
        known = core_calibration(self.calibration)
        if known is None:
            raise FormatError(
                "compiled core: there is none for this machine, or it cannot compute this "
                "calibration; use StreamEstimator, which falls back to numpy"
            )
        self._known, self._core = known, known.core
        self._memory = memory(known.core.wheel_size(known.address, self.rate))
        self._wheel = known.core.wheel_start(self._memory.ctypes.data, known.address, self.rate)
        self._turn, self._features = block_of(TurnStruct, 1), block_of(FeatureStruct, 1)
        self._estimates = block_of(EstimateStruct, 1)
        self._places = [
            block.ctypes.data for block in (self._turn, self._features, self._estimates)
        ]
        self._latest: TurnEstimate | None = None

    def push(
        self,
        frame: FloatArray,
        *,
        trigger: BoolArray | None = None,
        **held: Unpack[Held],
    ) -> list[TurnEstimate]:
        """Take the next samples and return the estimates of the turns that they complete."""
        check_gages(frame, self.gages)
        columns, kept = columns_of(frame, dict(held), HELD, trigger)
        n, taken, turns = frame.shape[1], c.c_int64(0), []
        place, take = c.byref(taken), self._core.wheel_take
        while (found := take(self._wheel, columns, n, place, *self._places)) > 0:
            turns.append(self._told())
        del kept  # until here the core read them
        if found < 0:
            raise beyond_samples(round(self.time * self.rate))
        return turns

    def take(self, samples: list[float], conditions: Sequence[float]) -> list[TurnEstimate]:
        """Like `push`, for short frames of plain numbers."""
        frame: FloatArray = np.array(samples, dtype=np.float64).reshape(-1, self.gages).T
        held: Any = dict(zip(HELD, conditions, strict=True))
        return self.push(frame, **held)

    def _told(self) -> TurnEstimate:
        """Return the turn that has just been completed."""
        lateral: FloatArray = np.array(self.calibration.lateral)
        features = Features(
            lateral=lateral, **attributes_of(self._turn, self._features, self.gages)
        )
        found = estimates_of(self._estimates, self.gages)
        self._latest = TurnEstimate(self._outputs().turn, features, found)
        return self._latest

    def wait(self, time: float) -> None:
        """Let time [s] go by in which no samples came."""
        self._core.wheel_wait(self._wheel, time)

    def _outputs(self) -> OutputStruct:
        shown = OutputStruct()
        self._core.wheel_outputs(self._wheel, c.byref(shown))
        return shown

    @property
    def latest(self) -> TurnEstimate | None:
        """The last turn's estimate; None before the first contact."""
        return self._latest

    @property
    def turns(self) -> int:
        """Number of contacts since the start."""
        return int(self._outputs().turn)

    @property
    def time(self) -> float:
        """Time taken by the samples so far, [s]."""
        return float(self._core.wheel_time(self._wheel))

    @property
    def elapsed(self) -> float:
        """Time taken by the samples so far, and that waited for since the last, [s]."""
        return float(self._core.wheel_elapsed(self._wheel))

    @property
    def age(self) -> float:
        """Time since the last estimate was made, [s]; NaN before the first."""
        return float(self._outputs().age)

    @property
    def stale(self) -> bool:
        """Whether contacts have stayed away for too long, or the wheel stands."""
        return bool(self.flags & int(TurnFlag.NO_CONTACT))

    @property
    def flags(self) -> int:
        """`TurnFlag` bits that hold now: those of the last turn, and the watchdog's."""
        return int(self._outputs().flags)

    @property
    def valid(self) -> bool:
        """Whether all is well."""
        return bool(self._outputs().valid)

    def is_valid(self, quantity: str) -> bool:
        """Return whether a quantity of the last estimate may be used now."""
        return bool(self._outputs().valid_of[QUANTITIES.index(quantity)])

    def state(self) -> dict[str, Any]:
        """Return everything that the estimator remembers, as JSON knows it."""
        bytes_ = c.create_string_buffer(self._core.state_size(self._wheel))
        self._core.state_save(self._wheel, bytes_)
        return {
            "format": STATE_FORMAT,
            "core": self._core.source,
            "rate": self.rate,
            "lateral": list(self.calibration.lateral),
            "latest": to_plain(self._latest),
            "wheel": b64encode(bytes_.raw).decode("ascii"),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state."""
        self.check_state(state, STATE_FORMAT)
        bytes_ = b64decode(state["wheel"])
        own = state["core"] == self._core.source
        if not own or not self._core.state_restore(self._wheel, bytes_, len(bytes_)):
            raise FormatError(
                "state: it is damaged, or of another build of the compiled core or another "
                "calibration; restore it where it was saved"
            )
        self._latest = from_plain(state["latest"])
