"""One wheel inside an FMU: parameters and frames in, the values of the output variables out."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.axes import sign
from tirelib.errors import ParameterError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.chain import QUANTITIES
from tirelib.flags import TurnFlag, flag_names
from tirelib.stream.estimator import StreamEstimator, TurnEstimate

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

    Raises
    ------
    ParameterError
        If the rate or the axes are not allowed, or the gages have no mirror image in the axes.
    """

    def __init__(
        self, calibration: Calibration, rate: float, samples: int, axes: str = "iso"
    ) -> None:
        self._sign = [sign(_AXIS_NAME[quantity], axes) for quantity in QUANTITIES]
        self._order = _gage_order(calibration.lateral, sign("lateral", axes), axes)
        self._estimator = StreamEstimator(calibration, rate)
        self.rate = float(rate)
        self.samples = samples
        self._seen: tuple[int, bool] | None = None
        self._offset = 0.0  # time at which the estimator was started anew, after a fault
        self._turns = 0  # turns before that
        self._fault = False
        self._held: tuple[tuple[float, ...], tuple[Any, ...]] | None = None

    def samples_in(self, step: float) -> int:
        """Return how many samples a communication step [s] holds.

        Raises
        ------
        ParameterError
            If it is no whole number.
        """
        exact = step * self.rate
        whole = round(exact) if math.isfinite(exact) else 0
        if whole < 1 or abs(exact - whole) > STEP_TOLERANCE:
            raise ParameterError(
                f"communication step = {step} s is {exact:g} samples at {self.rate:g} Hz; a whole "
                f"number of samples is needed; step by {self.samples / self.rate:g} s"
            )
        return whole

    def step(self, frame: list[float], step: float, valid: bool, *conditions: float) -> bool:
        """Take a frame and go on by one communication step; tell whether more than age changed.

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
            Speed, pressure, camber, omega; NaN where unknown.
        """
        n = self.samples_in(step)
        strain = np.full((self._estimator.gages, n), np.nan)
        if valid:
            taken = min(n, self.samples)
            rows = np.array(frame).reshape(self.samples, -1)[:taken, self._order]
            strain[:, :taken] = rows.T
        speed, pressure, camber, omega = conditions
        turns = self._estimator.push(
            strain, speed=speed, pressure=pressure, camber=camber, omega=omega
        )
        if turns:
            self._fault, self._held = False, None
        now = (self._estimator.turns, self._estimator.stale)
        changed = now != self._seen
        self._seen = now
        return changed

    def fault(self) -> None:
        """Hold the last values as invalid and start the estimator anew, after an error."""
        values, texts = self.outputs()
        self._offset += self._estimator.time
        self._turns += self._estimator.turns
        self._estimator.reset()
        self._seen, self._fault = None, True
        self._held = (values, texts)

    @property
    def age(self) -> float:
        """Time since the estimate was made, [s]; NaN before the first."""
        if self._held is not None:
            return self._held[0][-1] + self._estimator.time
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
            return (math.nan,) * (2 * len(QUANTITIES) + self._estimator.gages + 3)
        values = (s * latest.value(q) for s, q in zip(self._sign, QUANTITIES, strict=True))
        stds = (latest.std(quantity) for quantity in QUANTITIES)
        lengths = np.empty(self._estimator.gages)
        lengths[:] = latest.estimates.contact_length[0][np.argsort(self._order)]
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
        status = ";".join(flag_names(flags))
        return (*values[:-1], self.age), (others[0], flags, *none_valid, others[-2], status)

    def state(self) -> dict[str, Any]:
        """Return everything that is remembered, as JSON knows it."""
        return {
            "estimator": self._estimator.state(),
            "seen": None,
            "offset": self._offset,
            "turns": self._turns,
            "fault": self._fault,
            "held": None if self._held is None else [_hex(self._held[0]), list(self._held[1])],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state of a wheel with the same parameters."""
        self._estimator.restore(state["estimator"])
        self._offset, self._turns = state["offset"], state["turns"]
        self._fault, self._seen = state["fault"], None
        held = state["held"]
        self._held = None if held is None else (_unhex(held[0]), tuple(held[1]))


def load_wheel(embedded: Path, override: str, rate: float, samples: int, axes: str) -> Wheel:
    """Return a wheel with the embedded calibration, or with another of the same gage layout.

    Raises
    ------
    FormatError
        If a calibration cannot be read.
    CalibrationError
        If the other calibration is of another gage layout.
    ParameterError
        If a parameter is out of range.
    """
    calibration = read_calibration(embedded)
    if override:
        other = read_calibration(override)
        other.check_layout(other.tire, calibration.lateral, "StrainTire.fmu")
        calibration = other
    return Wheel(calibration, rate, samples, axes)


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
