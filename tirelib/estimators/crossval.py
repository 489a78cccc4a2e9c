"""Leave one load, speed, pressure or camber out: what is said of a level never seen."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.calibrate import calibrate_chain
from tirelib.estimators.dissertation import FREE, SMALL_ANGLE, UPRIGHT, Means
from tirelib.estimators.fit import LARGEST_LEVEL
from tirelib.estimators.gage_chains import LARGEST_ANGLE_STD
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.train import Trained, take
from tirelib.measured.observations import Observations, mean_by

LEVELS = {
    "load": (250.0, "N"),
    "pressure": (1e4, "bar"),
    "speed": (0.5 / 3.6, "km/h"),
    "camber": (0.01, "deg"),
    "slip_ratio": (0.005, "1"),
}
"""Conditions of which a level is held out, with the least distance of two levels (SI)."""
FACTOR = {"bar": 1e-5, "km/h": 3.6, "deg": 180.0 / np.pi, "N": 1.0, "1": 1.0}
TRUTH_NAME = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}
REPORT_UNIT = {"Fz": "N", "alpha": "deg", "kappa": "1", "Fy": "N"}
MOST_LEVELS = 9


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Errors at one level of one condition, by fits that never saw this level.

    `inside` is False for the outermost levels: there a fit without them extrapolates.
    `dissertation` is the rmse of the dissertation's regression, None where it has none or cannot be
    fitted without the level; `in_use` that of the estimator. Both in `unit`, over run means.
    `in_range` is the share of turns that the estimator calls valid, `in_use_in_range` its rmse over
    run means of these, None where there are none: what it says of the others is flagged.
    """

    condition: str
    level: str
    quantity: str
    unit: str
    inside: bool
    n: int
    dissertation: float | None
    in_use: float
    in_range: float
    in_use_in_range: float | None


def leave_levels_out(
    observations: Observations,
    trained: Trained,
    progress: Callable[[str], None] | None = None,
) -> tuple[HeldOut, ...]:
    """Hold out every level of every varied condition in turn."""
    gages = trained.calibration.chains[-1].gages
    regressors = compute_regressors(observations.features, gages)
    made: list[HeldOut] = []
    for condition, label, inside, test in _levels(observations):
        if progress is not None:
            progress(f"without {condition} {label}")
        try:
            chain, _ = calibrate_chain(take(observations, ~test), gages)
        except CalibrationError:
            continue
        rows = test & observations.usable
        estimates, _ = chain.predict(regressors)
        for quantity, estimate in estimates.items():
            good = rows & np.isfinite(estimate.value)
            truth = observations.truth[TRUTH_NAME[quantity]]
            if quantity == "alpha":
                good &= np.abs(truth) <= np.deg2rad(SMALL_ANGLE)
            good &= np.isfinite(truth)
            if not good.any() or not trained.calibration.chains[-1].has(quantity):
                continue
            error = estimate.value - truth
            valid = good & estimate.valid
            if quantity == "alpha":
                valid &= estimate.std <= LARGEST_ANGLE_STD
            factor, unit = FACTOR[REPORT_UNIT[quantity]], observations.unit
            made.append(
                HeldOut(
                    condition,
                    label,
                    quantity,
                    REPORT_UNIT[quantity],
                    inside,
                    n=int(np.unique(unit[good]).size),
                    dissertation=_dissertation(trained.means, observations, quantity, test),
                    in_use=factor * _rmse(error, unit, good),
                    in_range=float(valid.sum() / good.sum()),
                    in_use_in_range=factor * _rmse(error, unit, valid) if valid.any() else None,
                )
            )
    return tuple(made)


def _rmse(error: FloatArray, unit: IntArray, rows: BoolArray) -> float:
    """Return the root mean square over the means of each unit."""
    return float(np.sqrt(np.mean(mean_by(unit, error, rows) ** 2)))


def _levels(observations: Observations) -> Iterator[tuple[str, str, bool, BoolArray]]:
    """Yield condition, label, whether it lies between others, and rows of each level."""
    for condition, (step, unit) in LEVELS.items():
        nominal = observations.nominal[condition]
        known = np.isfinite(nominal)
        if not known.any():
            continue
        levels = np.unique(np.round(nominal[known] / step) * step)
        if not 2 < levels.size <= MOST_LEVELS:
            continue
        for level in levels:
            rows = known & (np.abs(nominal - level) <= 0.5 * step)
            if rows.sum() > LARGEST_LEVEL * known.sum():
                continue  # most of the data: what remains cannot stand for it
            inside = bool(levels[0] < level < levels[-1])
            value = float(np.mean(nominal[rows])) * FACTOR[unit] + 0.0
            yield condition, f"{value:.4g} {unit}", inside, rows


def _dissertation(
    means: Means, observations: Observations, quantity: str, test: BoolArray
) -> float | None:
    """Held-out error of the dissertation's regression of a quantity, in its report unit."""
    centre = int(np.argmin(np.abs(means.lateral)))
    near = np.argsort(np.abs(means.lateral), kind="stable")[:3]
    length, peak = means.contact_length, means.cp1
    y: FloatArray
    if quantity == "Fz":
        x, y = np.stack((length[:, centre], length[:, centre] ** 2), axis=1), means.load
    elif quantity == "alpha":
        x, y = means.rate_slope[:, None], means.slip_angle
    elif quantity == "Fy":
        x, y = np.concatenate((length[:, near], peak[:, near]), axis=1), means.lateral_force
    else:
        return None
    features = observations.features
    rows = observations.usable & np.isfinite(features.contact_angle).all(axis=1)
    rows &= np.isfinite(features.cp1).all(axis=1) & np.isfinite(features.cp2).all(axis=1)
    held = mean_by(observations.unit, test.astype(np.float64), rows) > 0.5
    use = np.isfinite(x).all(axis=1) & np.isfinite(y)
    use &= ~(np.abs(means.camber) > UPRIGHT) & ~(np.abs(means.slip_ratio) > FREE)
    if quantity != "Fz":
        use &= np.abs(means.slip_angle) <= SMALL_ANGLE
    train, hold = use & ~held, use & held
    if train.sum() < x.shape[1] + 3 or not hold.any():
        return None
    design = np.column_stack((np.ones(y.size), x))
    found = np.linalg.lstsq(design[train], y[train], rcond=None)[0]
    return float(np.sqrt(np.mean((design[hold] @ found - y[hold]) ** 2)))
