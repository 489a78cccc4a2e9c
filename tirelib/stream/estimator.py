"""The streaming estimator: frames in, the estimates of completed turns out."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, Self, Unpack

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import FormatError
from tirelib.core.held import Held
from tirelib.core.rates import check_rate
from tirelib.estimators.calibration import Calibration
from tirelib.stream.estimate import TurnEstimate

__all__ = ["STANDSTILL", "WATCHDOG_TURNS", "StreamEstimator", "TurnEstimate"]

WATCHDOG_TURNS = 2.0
"""Turns after the middle of the last contact at which an estimate ceases to be valid."""
STANDSTILL = 0.05
"""Turn rate below which a wheel whose rate is measured counts as standing, [rad/s]."""


class StreamEstimator(ABC):
    """Estimate load, slip angle, slip ratio and lateral force from frames of strain.

    An estimate comes after each contact, at most 20 degrees of wheel angle, half the filter and one
    frame after the trailing edge, and is that of the batch (`observe`, `Calibration.estimate`),
    however the samples are cut into frames. Memory is bounded: the samples of the current turn.

    Between turns the last estimate stands, and `valid` and `flags` say whether it still holds: it
    ceases to when `WATCHDOG_TURNS` turns have passed since its contact (standstill, frozen or dead
    gages, a cut cable), counted in samples, or when a measured turn rate is zero.

    The compiled core estimates (`tirelib.stream.compiled.CompiledEstimator`), where there is one
    for this machine that knows the calibration, otherwise numpy does
    (`tirelib.stream.reference.NumpyEstimator`); both agree to 1e-9, flags included.

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

    kinds: ClassVar[tuple[type["StreamEstimator"], ...]] = ()
    """What can compute; the first that knows the calibration does."""

    def __new__(cls, calibration: Calibration, *_: Any, **__: Any) -> Self:
        """Choose what computes."""
        chosen: Any = cls
        if cls is StreamEstimator:
            chosen = next(kind for kind in cls.kinds if kind.knows(calibration))
        made: Self = super().__new__(chosen)
        return made

    @classmethod
    def knows(cls, calibration: Calibration) -> bool:
        """Return whether this kind can compute a calibration here."""
        return True

    def __init__(
        self,
        calibration: Calibration,
        rate: float,
        *,
        lateral: Sequence[float] | None = None,
        tire: str | None = None,
    ) -> None:
        check_rate(rate)
        gages = calibration.lateral if lateral is None else tuple(float(y) for y in lateral)
        name = calibration.tire if tire is None else tire
        calibration.check_layout(name, gages, "stream")
        self.calibration = calibration
        self.rate = float(rate)
        self.gages = len(calibration.lateral)
        self.reset()

    @abstractmethod
    def reset(self) -> None:
        """Forget everything but the calibration and the rate."""

    @abstractmethod
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

    @abstractmethod
    def take(self, samples: list[float], conditions: Sequence[float]) -> list[TurnEstimate]:
        """Like `push`, for short frames of plain numbers; samples that cannot end a turn wait.

        Parameters
        ----------
        samples : list of float
            Raw strain, sample by sample, oldest first.
        conditions : sequence of float
            What holds during the frame, in the order of `HELD`; NaN where unknown.
        """

    @abstractmethod
    def wait(self, time: float) -> None:
        """Let time [s] go by in which no samples came; they may still come later.

        The estimate ages and its watchdog runs, but the signal is not cut: the next sample follows
        the last.
        """

    @property
    @abstractmethod
    def latest(self) -> TurnEstimate | None:
        """The last turn's estimate; None before the first contact."""

    @property
    @abstractmethod
    def turns(self) -> int:
        """Number of contacts since the start."""

    @property
    @abstractmethod
    def time(self) -> float:
        """Time taken by the samples so far, [s]."""

    @property
    @abstractmethod
    def elapsed(self) -> float:
        """Time taken by the samples so far, and that waited for since the last, [s]."""

    @property
    @abstractmethod
    def age(self) -> float:
        """Time since the last estimate was made, [s]; NaN before the first."""

    @property
    @abstractmethod
    def stale(self) -> bool:
        """Whether contacts have stayed away for too long, or the wheel stands."""

    @property
    @abstractmethod
    def flags(self) -> int:
        """`TurnFlag` bits that hold now: those of the last turn, and the watchdog's."""

    @property
    @abstractmethod
    def valid(self) -> bool:
        """Whether all is well: every calibrated quantity may be used now, no gage or speed is out.

        With one gage out, or without a speed, the quantities that `is_valid` names may still be
        used. A gage whose strip does not touch the road, but lives, is not out.
        """

    @abstractmethod
    def is_valid(self, quantity: str) -> bool:
        """Return whether a quantity of the last estimate may be used now."""

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Return everything that the estimator remembers, as JSON knows it.

        An estimator of the same calibration and rate that restores it goes on exactly alike.
        """

    @abstractmethod
    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state.

        Raises
        ------
        FormatError
            If it is no state of this version, or of another rate or gage layout, or was saved where
            something else computed.
        """

    def check_state(self, state: dict[str, Any], wanted: str) -> None:
        """Refuse a state of another format, rate or gage layout.

        Raises
        ------
        FormatError
            Naming both.
        """
        given = state.get("format")
        if given != wanted:
            raise FormatError(
                f"state: format = {given!r}; this version reads {wanted!r}; save it anew"
            )
        if state["rate"] != self.rate or state["lateral"] != list(self.calibration.lateral):
            raise FormatError(
                f"state: it is of {state['rate']:g} Hz and gages at {state['lateral']} m, the "
                f"estimator of {self.rate:g} Hz and {list(self.calibration.lateral)} m; restore "
                "it where it was saved"
            )
