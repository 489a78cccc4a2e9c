"""One wheel inside an FMU: parameters and frames in, the values of the output variables out."""

import math
from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.axes import sign
from tirelib.core.errors import ParameterError
from tirelib.core.flags import TurnFlag, flag_names
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.estimate import QUANTITIES
from tirelib.fmu.refusals import FAULT, StepError, status_entry
from tirelib.fmu.remarks import Remark, remarks
from tirelib.measured.signal.turns import LONGEST_TURN
from tirelib.stream.estimate import TurnEstimate
from tirelib.stream.reference import NumpyEstimator

_AXIS_NAME = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}
STEP_TOLERANCE = 0.01
"""How far, in samples, a communication step may be from a whole number of samples."""


class Wheel:
    """A streaming estimator with the axes, the gage order and the time steps of an FMU.

    Parameters
    ----------
    calibration : Calibration
    rate : float, [Hz]
        Sample rate.
    samples : int
        Samples of a frame.
    axes : str
        ``iso``, ``sae`` or ``adapted_sae``: signs of the outputs, and the side on which the
        lateral positions of the gages count as positive.
    digest : str
        Hash of the calibration's file; empty for the embedded one.

    Raises
    ------
    ParameterError
        If the rate or the axes are not allowed, or the gages have no mirror image in the axes.
    """

    def __init__(
        self,
        calibration: Calibration,
        rate: float,
        samples: int,
        axes: str = "iso",
        digest: str = "",
    ) -> None:
        self._digest = digest
        self._sign = [sign(_AXIS_NAME[quantity], axes) for quantity in QUANTITIES]
        self._order = _gage_order(calibration.lateral, sign("lateral", axes), axes)
        self._mirrored = self._order != sorted(self._order)
        self._estimator = NumpyEstimator(calibration, rate)
        self.rate = float(rate)
        self.samples = samples
        self._known_step = math.nan, 0  # a communication step [s] and its samples
        self._seen: tuple[int, bool] | None = None
        self.ended = False  # whether the last step has ended a turn
        self.taken = 0  # samples of the last step
        self._offset = 0.0  # time at which the estimator was started again, after a fault
        self._turns = 0  # turns before that
        self._fault = False
        self._cause = ""  # of the last fault
        self._held: tuple[tuple[float, ...], tuple[Any, ...]] | None = None

    def samples_in(self, step: float) -> int:
        """Return how many samples a communication step [s] holds.

        Raises
        ------
        StepError
            If it is no whole number, or more than the longest turn holds.
        """
        if step == self._known_step[0]:
            return self._known_step[1]
        exact = step * self.rate
        whole = round(exact) if math.isfinite(exact) else 0
        if whole < 1 or abs(exact - whole) > STEP_TOLERANCE:
            raise StepError(
                f"communication step = {step} s is {exact:g} samples at {self.rate:g} Hz; a whole "
                f"number of samples is needed; step by {self.samples / self.rate:g} s"
            )
        self._check_length(step)
        self._known_step = step, whole
        return whole

    def _check_length(self, step: float) -> None:
        if not 0.0 < step <= LONGEST_TURN:
            raise StepError(
                f"communication step = {step} s; allowed is above 0 and up to {LONGEST_TURN:g} s, "
                f"the longest turn; step by {self.samples / self.rate:g} s"
            )

    def step(
        self,
        frame: list[float],
        step: float,
        valid: bool,
        *conditions: float,
        count: int | None = None,
    ) -> bool:
        """Take a frame and go on by one communication step; return whether more than age changed.

        A step of fewer samples than the frame takes the first of them; in a longer one the samples
        after the frame are missing.

        Parameters
        ----------
        frame : list of float, length samples x gages
            Strain, sample by sample, oldest first.
        step : float, [s]
        valid : bool
            False when the frame was lost; its samples are missing then.
        *conditions : float
            In the order of `HELD`; NaN, like infinity, where unknown.
        count : int, optional
            How many samples of the frame are new, whatever the step: time is counted in samples. A
            step without any lets the estimate age.

        Raises
        ------
        StepError
            If the step or the count is not allowed; nothing has changed.
        """
        n = self.samples_in(step) if count is None else self._counted(step, count)
        self.ended, self.taken = False, n
        if n:
            known = [value if math.isfinite(value) else math.nan for value in conditions]
            turns = self._estimator.take(self._strain(frame, n, valid), known)
            self.ended = bool(turns)
            if turns:
                self._fault, self._held = False, None
        else:
            self._estimator.wait(step)
        now = (self._estimator.turns, self._estimator.stale)
        changed = now != self._seen
        self._seen = now
        return changed

    def _strain(self, frame: list[float], n: int, valid: bool) -> list[float]:
        """Return the next n samples, one after the other; those that did not come are NaN."""
        gages = self._estimator.gages
        taken = frame[: n * gages] if valid else []
        if self._mirrored and taken:
            rows: FloatArray = np.array(taken).reshape(-1, gages)[:, self._order]
            taken = rows.ravel().tolist()
        return taken + [math.nan] * (n * gages - len(taken))

    def _counted(self, step: float, count: int) -> int:
        """Return how many samples are new in a buffered frame."""
        self._check_length(step)
        if not 0 <= count <= self.samples:
            raise StepError(
                f"samples = {count}; allowed are 0 .. {self.samples}, the frame's length; set how "
                "many samples of the frame are new"
            )
        return count

    def remarks(self, omega: float) -> dict[str, Remark]:
        """Return by kind what is out of range in the last turn.

        Parameters
        ----------
        omega : float, [rad/s]
            Turn rate that is given now.
        """
        latest = self._estimator.latest
        known = self._estimator.calibration
        return {} if latest is None else remarks(known, latest, self._sign, omega)

    def fault(self, cause: str) -> None:
        """Hold the last values as invalid and start the estimator again, after an error."""
        values, texts = self.outputs()
        self._offset += self._estimator.time
        self._turns += self._estimator.turns
        self._estimator.reset()
        self._seen, self._fault, self._cause = None, True, cause
        self._held = (values, texts)

    @property
    def age(self) -> float:
        """Time since the estimate was made, [s]; NaN before the first."""
        if self._held is not None:
            return self._held[0][-1] + self._estimator.elapsed
        return self._estimator.age

    def outputs(self) -> tuple[tuple[float, ...], tuple[Any, ...]]:
        """Return the values of the Real outputs and of the others, in the table's order."""
        if self._held is not None:
            return self._held_outputs(*self._held)
        live, latest = self._estimator, self._estimator.latest
        flags = live.flags | (int(TurnFlag.FAULT) if self._fault else 0)
        notes = latest.estimates.notes[0] if latest is not None else ()
        rolling = latest.estimates.rolling[0] if latest is not None else "unknown"
        others = (
            self._turns + live.turns,
            flags,
            live.valid,
            *(live.is_valid(quantity) for quantity in QUANTITIES),
            rolling,
            ";".join((*flag_names(flags), *notes)),
        )
        return (*self._reals(latest), live.age), others

    def _reals(self, latest: TurnEstimate | None) -> tuple[float, ...]:
        if latest is None:
            return (math.nan,) * (2 * (len(QUANTITIES) + self._estimator.gages) + 3)
        values = (s * latest.value(q) for s, q in zip(self._sign, QUANTITIES, strict=True))
        stds = (latest.std(quantity) for quantity in QUANTITIES)
        order, found = np.argsort(self._order), latest.estimates
        lengths = np.concatenate(
            (found.contact_length[0][order], found.contact_length_std[0][order])
        )
        return (
            *values,
            *stds,
            *lengths.tolist(),
            float(latest.estimates.radius[0]),
            float(latest.features.omega[0]),
            latest.time + self._offset,
        )

    def _held_outputs(
        self, values: tuple[float, ...], others: tuple[Any, ...]
    ) -> tuple[tuple[float, ...], tuple[Any, ...]]:
        """Return what was held at a fault: old values, no validity."""
        flags = int(others[1]) | int(TurnFlag.FAULT)
        if self._estimator.stale:
            flags |= int(TurnFlag.NO_CONTACT)
        none_valid = (False,) * (1 + len(QUANTITIES))
        names = [name for name in flag_names(flags) if name != FAULT]
        status = ";".join((*names, status_entry(FAULT, self._cause)))
        return (*values[:-1], self.age), (others[0], flags, *none_valid, others[-2], status)

    def state(self) -> dict[str, Any]:
        """Return everything that is remembered, as JSON knows it."""
        return {
            "calibration": self._digest,
            "estimator": self._estimator.state(),
            "seen": None,
            "offset": self._offset,
            "turns": self._turns,
            "fault": self._fault,
            "cause": self._cause,
            "held": None if self._held is None else [_hex(self._held[0]), list(self._held[1])],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state of a wheel with the same parameters.

        Raises
        ------
        ValueError
            If the file of the calibration holds another one now.
        """
        if state["calibration"] != self._digest:
            raise ValueError("a state of another calibration")
        self._estimator.restore(state["estimator"])
        self._offset, self._turns = state["offset"], state["turns"]
        self._fault, self._cause, self._seen = state["fault"], state["cause"], None
        held = state["held"]
        self._held = None if held is None else (_unhex(held[0]), tuple(held[1]))


def check_missing(value: float) -> None:
    """Refuse what cannot stand for a missing value.

    Raises
    ------
    ParameterError
        If it is infinite.
    """
    if math.isinf(value):
        raise ParameterError(
            f"missing = {value}; allowed are NaN and finite numbers; set what Real outputs show "
            "where there is no value"
        )


@lru_cache(maxsize=4)
def embedded_calibration(path: Path) -> Calibration:
    """Return the calibration inside an FMU, which does not change while the FMU is loaded.

    Read once for all instances and resets: reading takes as long as half a turn.
    """
    return read_calibration(path)


def read_other(path: str) -> tuple[Calibration, str]:
    """Return a calibration, and the hash of its file."""
    return read_calibration(path), sha256(Path(path).read_bytes()).hexdigest()


def load_wheel(
    embedded: Path,
    override: str,
    rate: float,
    samples: int,
    axes: str,
    *,
    tire: str = "",
    order: float = 0.0,
    read: Callable[[str], tuple[Calibration, str]] = read_other,
) -> Wheel:
    """Return a wheel with the embedded calibration, or with another of the same gage layout.

    Parameters
    ----------
    embedded : path
    override : str
        Path of the other calibration; empty: none.
    tire : str
        Name of the tire, which the calibration must be of; empty: the embedded calibration's.
    order : float, [cycles per turn]
        Cut-off of the low-pass that the calibration must have been made with; 0: any.
    read : callable
        Reads the other calibration; one that remembers it lets a state be taken up again where the
        file is gone.

    Raises
    ------
    FormatError
        If a calibration cannot be read.
    CalibrationError
        If the calibration is of another tire or gage layout.
    ParameterError
        If a parameter is out of range.
    """
    own = embedded_calibration(embedded)
    calibration, digest = read(override) if override else (own, "")
    where = f"StrainTire.fmu: {override or 'the embedded calibration'}"
    calibration.check_layout(tire or own.tire, own.lateral, where)
    if not (order == 0.0 or math.isclose(order, calibration.order, rel_tol=1e-6)):
        raise ParameterError(
            f"filter_order = {order:g}; the calibration was made with {calibration.order:g} cycles "
            "per turn, another low-pass would bias it; set 0, or calibrate anew with "
            "`tirelib calibrate --order`"
        )
    return Wheel(calibration, rate, samples, axes, digest)


def _gage_order(lateral: tuple[float, ...], side: float, axes: str) -> list[int]:
    """Return, for each gage of the calibration, which gage of the FMU it is."""
    order = [
        [index for index, other in enumerate(lateral) if abs(side * other - y) < 1e-4]
        for y in lateral
    ]
    if not all(order):
        positions = ", ".join(f"{1e3 * y:+g}" for y in lateral)
        raise ParameterError(
            f"axes = {axes!r}: gages at {positions} mm (ISO) have no mirror image; "
            "use axes = 'iso' with this layout"
        )
    return [found[0] for found in order]


def _hex(values: tuple[float, ...]) -> list[str]:
    return [value.hex() for value in values]


def _unhex(values: list[str]) -> tuple[float, ...]:
    return tuple(float.fromhex(value) for value in values)
