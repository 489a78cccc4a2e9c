r"""Damping of the rolling tire from the shift of its contact with speed (section 6.5.2.2).

Damping moves the contact toward its entry, in proportion to the turn rate. Two readings tell it:

with wheel angle
    the middle of the two strain-rate peaks against the axle's normal; it needs the trigger, and its
    zero (where the gage sits) is fitted along. A delay between trigger and strain looks like
    damping: half a sample of 10 kHz as much as a ratio of 0.07, so the delay has to be known;
without
    the middle of the rate peaks against that of the two compressive peaks, from the strain alone.
    It is the mean of the dissertation's distances (Eq. 113) at both edges, so a change of contact
    length cancels.

Both are calibrated with the model at several damping ratios, by one of two laws
(`routes.damped_ring`).

The tread's shear carries part of the drag and reduces the middle's shift by a quarter, so the
contact with shear is the default.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from routes.damped_ring import SHEAR_SHARE, Law, damped_waveform
from routes.edges import EdgeReading, read_edges
from routes.static_route_fit import Parameter, Quantity, fit_few
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.effects.state import Operating
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.measured.signal import LowPass
from tirelib.model.base import operating_points

TRIALS = (0.0, 0.06, 0.12)
"""Damping ratios (law "sidewall") at which the model is solved; a parabola lies between."""
MODAL_SHARE = 0.25
"""The trials of the law "modal" are smaller by this, for a shift of like size."""
LEAST_RATIO = 1.5
"""Least ratio of the fastest to the slowest turn rate."""
LAG_ZERO = 2e-4
"""Deviation of the lag of a tire without damping, [rad]: friction and an uneven belt."""
STRUCTURE = 0.08
"""Relative deviation of the lag's slope that a ring leaves open."""
STRUCTURE_MIDDLE = 0.2
"""The same of the middle's slope: it depends on how tread and road share the drag."""
SHEAR_STD = 0.4

LEAST_DAMPING = 0.02
"""Damping ratio below which relative deviations count as those of this one."""
WIDEST_STD = 0.02
"""Deviation above which a damping ratio is called not identifiable."""
DELAY_STD = 0.29
"""Deviation of the trigger's delay, [samples]: anywhere within one, as sampling leaves it."""


@dataclass(frozen=True, slots=True)
class Damping:
    """Damping ratio by both readings.

    Attributes
    ----------
    law : str
    value : Quantity
        Both readings weighed by their deviations.
    without_angle, with_angle : Quantity or None
        None where there is no trigger.
    lag, lag_model : shape (n_runs,), [rad]
        Middle of the rate peaks against the compressive peaks, measured and by the model at
        `value`.
    middle, middle_model : shape (n_runs,), [rad]
        Middle of the rate peaks against the axle; the model's with the fitted zero.
    zero : float, [rad]
        Fitted zero of the wheel angle; NaN without trigger.
    """

    law: Law
    value: Quantity
    without_angle: Quantity
    with_angle: Quantity | None
    lag: FloatArray
    lag_model: FloatArray
    middle: FloatArray
    middle_model: FloatArray
    zero: float


def fit_damping(
    runs: StraightRuns,
    strain: FloatArray,
    values: Mapping[str, float | FloatArray],
    relative_std: Mapping[str, float],
    *,
    law: Law = "sidewall",
    sheared: bool = True,
    delay: float = 0.0,
    delay_std: float = DELAY_STD,
) -> Damping:
    """Return the damping ratio from runs at several speeds.

    Parameters
    ----------
    runs : StraightRuns
    strain : shape (n_runs, n_phi), [-]
        The waveforms to be read.
    values : mapping
        The identified tire; one value per run is allowed.
    relative_std : mapping of str to float
        Relative deviations of values that the shift depends on; they widen the interval.
    law : str
    sheared : bool
        With the tread's shear (its stiffness from `values`, else a third of the normal one).
    delay, delay_std : float, [samples]
        By which the strain comes late against the trigger, and how well that is known.

    Raises
    ------
    CalibrationError
        If the turn rates lie too near to each other.
    """
    points, low_pass = operating_points(runs.waves), runs.waves.low_pass
    slowest, fastest = float(points.omega.min()), float(points.omega.max())
    if not fastest >= LEAST_RATIO * slowest:
        raise CalibrationError(
            f"{runs.waves.header.name}: turn rates from {slowest:.1f} to {fastest:.1f} rad/s; the "
            f"fastest has to be {LEAST_RATIO} times the slowest or more to separate damping from "
            "the angle's zero; add runs at a low and at a high speed"
        )
    noise = runs.waves.scatter / np.sqrt(np.maximum(runs.waves.turns, 1))
    read = read_edges(strain, low_pass=low_pass, noise=noise, labels=runs.waves.run.tolist())
    trial = np.array(TRIALS) * (MODAL_SHARE if law == "modal" else 1.0)
    table = _calibration(values, points, trial, law, sheared, low_pass)
    lag = _solve_lag(read.lag, table[0], trial)
    unsure = _unsureness(values, points, trial, law, sheared, low_pass, relative_std, table)
    without = _quantity("damping", lag[0], lag[1], float(np.hypot(unsure[0], STRUCTURE)))
    angle_std = runs.waves.angle_std
    with_angle, zero = None, np.nan
    if np.isfinite(angle_std).sum() >= 3:
        late = points.omega / runs.waves.header.rate if runs.waves.header.rate > 0 else 0.0
        middle = _solve_middle(read.middle - delay * late, angle_std, table[1], trial)
        zero = middle[2]
        moved = _solve_middle(
            read.middle - (delay - delay_std) * late, angle_std, table[1], trial, lowest=-0.5
        )
        held = _solve_middle(read.middle - delay * late, angle_std, table[1], trial, lowest=-0.5)
        scatter = float(np.hypot(middle[1], moved[0] - held[0]))
        spread = float(np.hypot(unsure[1], STRUCTURE_MIDDLE))
        with_angle = _quantity("damping", middle[0], scatter, spread)
    value = without if with_angle is None else _joined(without, with_angle)
    return Damping(
        law,
        value,
        without,
        with_angle,
        read.lag,
        _between(table[0], trial, value.value),
        read.middle,
        _between(table[1], trial, value.value) + np.nan_to_num(zero),
        zero,
    )


def _read(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    damping: float,
    law: Law,
    sheared: bool,
    low_pass: LowPass,
) -> EdgeReading:
    strain = damped_waveform(values, points, damping, law, sheared=sheared, low_pass=low_pass)
    return read_edges(strain, low_pass=low_pass)


def _calibration(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    trial: FloatArray,
    law: Law,
    sheared: bool,
    low_pass: LowPass,
) -> tuple[FloatArray, FloatArray]:
    """Return lag and middle at every trial, each (n_trials, n_runs)."""
    reads = [_read(values, points, float(x), law, sheared, low_pass) for x in trial]
    return np.stack([r.lag for r in reads]), np.stack([r.middle for r in reads])


def _between(table: FloatArray, trial: FloatArray, at: float) -> FloatArray:
    """Return the parabola through three trials at a damping ratio."""
    a, b, c = trial
    weight = np.array(
        [
            (at - b) * (at - c) / ((a - b) * (a - c)),
            (at - a) * (at - c) / ((b - a) * (b - c)),
            (at - a) * (at - b) / ((c - a) * (c - b)),
        ]
    )
    out: FloatArray = weight @ table
    return out


def _solve_lag(lag: FloatArray, table: FloatArray, trial: FloatArray) -> tuple[float, float]:
    """Return lambda and its deviation by scatter."""
    scatter = 1e-4

    def residual(x: FloatArray) -> FloatArray:
        rest: FloatArray = (lag - _between(table, trial, float(x[0])) - x[1]) / scatter
        return rest

    start = float(trial[1])
    free = (
        Parameter("damping", "-", start, 0.0, 3.0 * float(trial[2]), scaled=False),
        Parameter("lag", "rad", 0.0, -0.02, 0.02, scaled=False, prior_std=LAG_ZERO),
    )
    fit = fit_few(residual, free, where="damping without wheel angle", free_scale=True)
    known = LAG_ZERO * _lever(table, trial)
    return float(fit.x[0]), float(np.hypot(np.sqrt(fit.covariance[0, 0]), known))


def _lever(table: FloatArray, trial: FloatArray) -> float:
    """Return the change of lambda by a unit of lag that all runs share."""
    slope = (table[2] - table[0]) / (trial[2] - trial[0])
    return float(abs(np.sum(slope)) / np.sum(slope**2))


def _solve_middle(
    middle: FloatArray,
    angle_std: FloatArray,
    table: FloatArray,
    trial: FloatArray,
    lowest: float = 0.0,
) -> tuple[float, float, float]:
    """Return lambda, its deviation and the angle's zero."""
    sigma = np.hypot(np.where(np.isfinite(angle_std), angle_std, 1.0), 2e-4)

    def residual(x: FloatArray) -> FloatArray:
        rest: FloatArray = (middle - _between(table, trial, float(x[0])) - x[1]) / sigma
        return rest

    free = (
        Parameter("damping", "-", float(trial[1]), lowest, 3.0 * float(trial[2]), scaled=False),
        Parameter("zero", "rad", 0.0, -0.5, 0.5, scaled=False),
    )
    fit = fit_few(residual, free, where="damping with wheel angle")
    scale = max(1.0, float(np.mean(fit.residual**2)) * middle.size / max(middle.size - 2, 1))
    return float(fit.x[0]), float(np.sqrt(scale * fit.covariance[0, 0])), float(fit.x[1])


def _unsureness(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    trial: FloatArray,
    law: Law,
    sheared: bool,
    low_pass: LowPass,
    relative_std: Mapping[str, float],
    table: tuple[FloatArray, FloatArray],
) -> tuple[float, float]:
    """Return relative deviations of lag and middle by those of the tire's values."""
    spread = {name: min(std, 0.5) for name, std in relative_std.items()}
    full = dict(values)
    if sheared and not np.any(np.asarray(values["tread_shear_stiffness"]) > 0):
        full["tread_shear_stiffness"] = SHEAR_SHARE * np.asarray(values["tread_stiffness"])
        spread["tread_shear_stiffness"] = SHEAR_STD
    total = np.zeros(2)
    still = [t[0] for t in table]
    base = [t[1] - s for t, s in zip(table, still, strict=True)]
    for name, std in spread.items():
        moved = {**full, name: np.asarray(full[name]) * np.exp(std)}
        read = _read(moved, points, float(trial[1]), law, sheared, low_pass)
        for k, y in enumerate((read.lag, read.middle)):
            change = y - still[k]
            total[k] += (float(change @ base[k]) / float(base[k] @ base[k]) - 1.0) ** 2
    return float(np.sqrt(total[0])), float(np.sqrt(total[1]))


def _quantity(name: str, value: float, scatter: float, relative: float) -> Quantity:
    std = float(np.hypot(scatter, relative * max(value, LEAST_DAMPING)))
    return Quantity.of(name, "-", value, std, *_damping_flags(value, std))


def _damping_flags(value: float, std: float) -> tuple[str, ...]:
    told = (("at_boundary", value <= 1e-6), ("not_identifiable", std > WIDEST_STD))
    return tuple(flag for flag, holds in told if holds)


def _joined(a: Quantity, b: Quantity) -> Quantity:
    """Return the mean of two values by their deviations, wider where they disagree."""
    weight = np.array([a.std**-2, b.std**-2])
    values = np.array([a.value, b.value])
    mean = float(weight @ values / weight.sum())
    std = float(1.0 / np.sqrt(weight.sum()))
    apart = abs(a.value - b.value) / float(np.hypot(a.std, b.std))
    wider = std * max(1.0, apart / 1.96)
    return Quantity.of("damping", "-", mean, wider, *_damping_flags(mean, wider))
