"""The error of a model of strain: one number in one unit, the same from every verb.

    error = rms of W (measured - model) over the straight runs,

where W whitens each run's waveform by the noise and by set points that may be off: load, pressure,
gain and angle zero by the campaign's tolerances, along the model's slopes. The delay of the gages
against the trigger is fitted first and taken out, for it is neither the tire's nor the model's. So
a model without any fault has the error 1.

The unit is the noise of a run's mean waveform. It comes from the data alone: from repeats at equal
set points, beside what the campaign's own slopes by load, pressure, gain and angle explain of their
differences (`tirelib.inference.identify.noise`). A model does not change it. Without repeats the
unit is microstrain, and the error is the rms residual after the delay has been fitted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import linalg

from tirelib.core.arrays import BoolArray, FloatArray, rms
from tirelib.effects.state import Operating
from tirelib.inference.compare.model import Prediction, TireModel, predict_runs
from tirelib.inference.compare.set_points import predict_set_points, tangents
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.identify.delay import STD, UNIT, by_delay, earlier
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.noise import LEAST_NOISE
from tirelib.inference.identify.random_effects import Whitening, angle_slope, scales, whitening_of
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import operating_points
from tirelib.physics.rolling.solve import Start

NOISE, MICROSTRAIN = "noise", "ustrain"
PASSES = 3
"""Gauss-Newton steps of the delay."""
SEEN = 3.0
"""Standard deviations of a delay from which it is reported."""
LEAST_ERROR = 1.1
"""Error from which there is a misfit to be shared out."""


@dataclass(frozen=True, slots=True)
class ModelError:
    """A model's error on runs.

    Attributes
    ----------
    value : float
        In `unit`.
    unit : str
        noise, or ustrain without repeats.
    noise : float, [-]
        Standard deviation of a run's mean waveform by noise; NaN without repeats.
    rms : float, [-]
        Rms of model less measured, the delay taken out, set points left in.
    delay, delay_std : float, [s]
        Delay of the gages against the trigger.
    prediction : Prediction
        With the delay.
    rest : shape (n_runs, n_phi), [-]
        Measured less model, the delay taken out.
    whiten : Whitening or None
        None without repeats.
    """

    value: float
    unit: str
    noise: float
    rms: float
    delay: float
    delay_std: float
    prediction: Prediction
    rest: FloatArray
    whiten: Whitening | None

    @property
    def known(self) -> bool:
        """Whether there are repeats."""
        return self.unit == NOISE

    def white_of(self, waveforms: FloatArray) -> FloatArray:
        """Return waveforms (..., n_runs, n_phi) in `unit`: whitened, or microstrain."""
        return 1e6 * waveforms if self.whiten is None else self.whiten(waveforms)

    @property
    def by_run(self) -> FloatArray:
        """The same for each run, shape (n_runs,); their mean square is that of `value`."""
        return np.asarray(np.sqrt(np.mean(self.white_of(self.rest) ** 2, axis=1)))

    @property
    def told(self) -> dict[str, Any]:
        """The keys under which every document states an error: value, unit, noise, raw rms."""
        return {
            "error": self.value,
            "error_unit": self.unit,
            "noise": 1e6 * self.noise,
            "residual_rms_raw": 1e6 * self.rms,
        }


@dataclass(frozen=True, slots=True)
class Yardstick:
    """What errors on runs are measured with; nothing of it is a model's.

    Attributes
    ----------
    strain : shape (n_runs, n_phi), [-]
        Mean over the gages in use.
    scale : shape (n_runs, 4)
        Standard deviations of load, pressure, gain (relative) and angle zero [rad].
    noise : float, [-]
        NaN without repeats.
    lateral : tuple of float, [m]
        Places of the gages in use.
    """

    strain: FloatArray
    at: Operating
    scale: FloatArray
    noise: float
    lateral: tuple[float, ...]
    low_pass: LowPass

    @classmethod
    def of(cls, runs: StraightRuns) -> "Yardstick":
        """Return the yardstick of a campaign's straight runs."""
        waves = runs.waves
        return cls(
            runs.strain,
            operating_points(waves),
            scales(runs.tolerance, waves.angle_std),
            runs.noise.std,
            tuple(waves.header.gage_lateral[g] for g in runs.gages),
            waves.low_pass,
        )

    def take(self, chosen: BoolArray) -> "Yardstick":
        """Return the yardstick of some of the runs; the unit stays."""
        strain, scale = self.strain[chosen], self.scale[chosen]
        return replace(self, strain=strain, at=self.at.take(chosen), scale=scale)

    @property
    def unit(self) -> str:
        """Unit of errors."""
        return NOISE if np.isfinite(self.noise) else MICROSTRAIN

    def error(
        self, model: TireModel, delay: float | None = None, *, start: Start | None = None
    ) -> ModelError:
        """Return the error of a model.

        Parameters
        ----------
        delay : float, optional, [s]
            That of the runs to which the model was fitted, where these are others; it is fitted
            here by default.
        start : Rolling or Unknowns, optional
            Solution of these runs by a model nearby; saves time, the result is the same.

        Raises
        ------
        CalibrationError
            If the model has no solution at the runs' conditions.
        """
        found = predict_runs(model, self.at, self.lateral, self.low_pass, start=start)
        return self.of_prediction(found, delay)

    def of_prediction(self, prediction: Prediction, delay: float | None = None) -> ModelError:
        """Return the error of what a model predicts without a delay."""
        raw = self.strain - prediction.strain
        deviation = 0.0
        if delay is None:
            delay, deviation = self._delay(raw, prediction)
        late = late_prediction(prediction, self.at.omega, delay)
        rest, whiten = self.strain - late.strain, None
        value = 1e6 * rms(rest)
        if np.isfinite(self.noise):
            whiten = whitening_of(tangents(late), self.scale, self.noise)
            value = rms(whiten(rest))
        return ModelError(
            value, self.unit, self.noise, rms(rest), delay, deviation, late, rest, whiten
        )

    def _delay(self, raw: FloatArray, prediction: Prediction) -> tuple[float, float]:
        """Return the common delay of the runs and its standard deviation, [s].

        What is left beside the set points, misfit and all, counts as noise.
        """
        tangent = tangents(prediction)
        first = predict_set_points(raw, tangent, self.scale, self.noise)
        whiten = whitening_of(tangent, self.scale, max(rms(raw - first.shift), LEAST_NOISE))
        return fitted_delay(
            self.strain, prediction.strain, self.at.omega, whiten, first.independent
        )


def error_of(runs: StraightRuns, model: TireModel) -> ModelError:
    """Return the error of a model on a campaign's straight runs.

    Raises
    ------
    CalibrationError
        If the model has no solution at the campaign's conditions.
    """
    return Yardstick.of(runs).error(model)


def named_errors(before: ModelError, after: ModelError) -> Mapping[str, Any]:
    """Return the keys under which a document states the errors before and after a change."""
    return {
        "error_unit": before.unit,
        "noise": 1e6 * before.noise,
        "error_before": before.value,
        "error_after": after.value,
        "residual_rms_before": 1e6 * before.rms,
        "residual_rms_after": 1e6 * after.rms,
        "residual_rms_unit": MICROSTRAIN,
    }


def fitted_delay(
    measured: FloatArray,
    predicted: FloatArray,
    omega: FloatArray,
    whiten: Whitening,
    independent: float,
) -> tuple[float, float]:
    """Return the delay [s] and its standard deviation, by what of it goes with the speed.

    One offset of the wheel angle, the same in all runs, is fitted beside the delay without a
    prior. At one speed the two cannot be told apart, and no delay is reported. Damping of the
    sidewall and sliding shift the strain too, and the delay holds a little of them.

    Parameters
    ----------
    measured, predicted : shape (n_runs, n_phi), [-]
    omega : shape (n_runs,), [rad/s]
    whiten : Whitening
        By set points and what a good model leaves.
    independent : float
        Samples in a turn of what is left that tell something of their own.
    """
    delay, information = 0.0, np.eye(2)
    share = independent / measured.shape[1]
    prior = np.array([(UNIT / STD) ** 2, 0.0])
    for _ in range(PASSES):
        late = earlier(predicted, omega, -delay)
        slopes = np.stack([by_delay(late, omega), angle_slope(late)])
        rows = whiten(slopes).reshape(2, -1)
        rest = whiten(measured - late).ravel()
        information = share * rows @ rows.T + np.diag(prior)
        # the prior holds the whole delay near zero, not the step
        gain = share * rows @ rest - prior * np.array([delay / UNIT, 0.0])
        delay += UNIT * float(np.linalg.solve(information, gain)[0])
    return delay, UNIT * float(np.sqrt(np.linalg.inv(information)[0, 0]))


def late_prediction(prediction: Prediction, omega: FloatArray, delay: float) -> Prediction:
    """Return what gages that come later by a delay show."""

    def late(waves: FloatArray) -> FloatArray:
        return earlier(waves, omega, -delay)

    gages = prediction.gages
    return replace(
        prediction,
        strain=late(prediction.strain),
        gages=np.stack([late(gages[:, k]) for k in range(gages.shape[1])], axis=1),
        by_load=late(prediction.by_load),
        by_pressure=late(prediction.by_pressure),
    )


def lag_message(delay: float, std: float, omega: FloatArray) -> tuple[str, ...]:
    """Say a delay that is more than chance."""
    if abs(delay) < SEEN * std:
        return ()
    side = "after" if delay > 0.0 else "before"
    turn = np.rad2deg(abs(delay) * float(np.max(np.abs(omega))))
    return (
        f"The gages come {1e6 * abs(delay):.0f} microseconds {side} the trigger in all runs "
        f"({turn:.2g} deg of the wheel in the fastest): it is counted out of all errors. Effects "
        "that act late as well are weighed against it by `tirelib diagnose`.",
    )


@dataclass(frozen=True, slots=True)
class Floor:
    """Structural floor as far as known, in units of the noise.

    Attributes
    ----------
    value : float
        Part of the error that noise and the tire's structure explained when the model was last
        changed on these data (`tirelib.inference.diagnose.floor`); NaN where its history does not
        say.
    smooth : float
        Error that stays when a smooth misfit of angle, load and pressure is taken out: no change
        of the model that acts smoothly can go below. NaN without noise.
    share : float
        Part of the excess error^2 - 1 that the smooth misfit explains; NaN for an error near 1.
    """

    value: float
    smooth: float
    share: float


def floor_of(model: TireModel, data_hash: str, error: ModelError, points: Operating) -> Floor:
    """Return what is known of the floor.

    Parameters
    ----------
    data_hash : str
        Hash of the campaign: a floor on other data is none here.
    error : ModelError
        Error on the counted runs.
    points : Operating
        The same runs.
    """
    smooth, share = float("nan"), float("nan")
    if error.whiten is not None:
        smooth = _without_smooth(error.rest, error.prediction, points, error.whiten)
        if error.value > LEAST_ERROR:
            share = (error.value**2 - smooth**2) / (error.value**2 - 1.0)
    return Floor(last_floor(model.history, "strain", data_hash), smooth, share)


def last_floor(history: Sequence[Mapping[str, Any]], quantity: str, data_hash: str) -> float:
    """Return the floor in noise units by the last change for a quantity.

    NaN where the history does not say it, or says it of other data.
    """
    told = [entry for entry in history if entry.get("quantity", "strain") == quantity]
    if not told or told[-1].get("data_sha256") != data_hash:
        return float("nan")
    value = told[-1].get("floor")
    return float(value) if isinstance(value, int | float) else float("nan")


def _without_smooth(
    rest: FloatArray, prediction: Prediction, points: Operating, whiten: Whitening
) -> float:
    """Return the error with a smooth misfit taken out."""
    half = 0.5 * (prediction.edges[:, 1] - prediction.edges[:, 0])
    shapes = Discrepancy().columns(prediction.strain, GRID / half[:, None], points)
    rows = whiten(shapes).reshape(len(shapes), -1)
    white = whiten(rest).ravel()
    normal = rows @ rows.T + np.eye(len(rows))
    weights = linalg.cho_solve(linalg.cho_factor(normal), rows @ white)
    left = white - weights @ rows
    return rms(left)
