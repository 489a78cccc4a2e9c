"""From campaigns to a calibration with its report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.core.threads import one_thread
from tirelib.estimators.calibrate import calibrate_chain, measured
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.cornering import CorneringTrend, cornering_trend
from tirelib.estimators.dissertation import Means, Regression, fit_all, means_for_tables
from tirelib.estimators.gage_chains import Rolling
from tirelib.estimators.links import Links
from tirelib.estimators.regressors import compute_regressors
from tirelib.measured.observations import Observations, geometry_of, mean_by
from tirelib.measured.signal import LowPass

ROLLING_SIGMAS = 4.0
"""Scatter of free-rolling turns, in standard deviations, that is not called traction."""
LEAST_TRACTION = 0.02
"""Smallest threshold on (CP1 - CP2) / TP."""
FREE_FORCE = 0.03
"""A run with |Fx| below this share of Fz counts as freely rolling."""


@dataclass(frozen=True, slots=True)
class Trained:
    """A calibration with everything that was seen while making it.

    `links` are those of the full gage set; `skipped` says why a regression of the dissertation
    could not be fitted; `cornering` is None without enough slip angles.
    """

    calibration: Calibration
    links: Links
    means: Means
    regressions: tuple[Regression, ...]
    skipped: dict[str, str]
    cornering: CorneringTrend | None


@one_thread()
def train(
    observations: Observations,
    *,
    low_pass: LowPass | None = None,
    progress: Callable[[str], None] | None = None,
) -> Trained:
    """Calibrate all gage sets on observations and fit the dissertation's regressions.

    Parameters
    ----------
    observations : Observations
    low_pass : LowPass, optional
        The filter with which the observations were made.
    progress : callable, optional
        Called with a label at each step.

    Raises
    ------
    CalibrationError
        If the data cannot inform any quantity.
    """
    features = observations.features
    count, centre = features.lateral.size, features.centre_gage
    if count < 3:
        raise CalibrationError(
            f"{observations.headers[0].name}: {count} gages; slopes over the lateral position need "
            "at least three, one of them at the centre"
        )
    say = progress or (lambda _: None)

    def labelled(label: str) -> Callable[[str], None]:
        return lambda quantity: say(f"{quantity} from {label}")

    full, links = calibrate_chain(observations, range(count), labelled("all gages"))
    if not any(full.has(quantity) for quantity in ("Fz", "alpha", "kappa", "Fy")):
        reasons = "; ".join(f"{quantity}: {why}" for quantity, why in links.refused.items())
        raise CalibrationError(
            f"{observations.headers[0].name}: nothing to calibrate: {reasons}; a campaign needs "
            "what the rig measured beside the strain (channels Fz, Fy, slip_angle, slip_ratio of "
            'its runs): import both together with `tirelib import` (page "Calibrate with your own '
            'transmitter")'
        )
    chains = {-1: full}
    for missing in range(count):
        if missing != centre and count > 3:
            gages = [gage for gage in range(count) if gage != missing]
            chains[missing], _ = calibrate_chain(
                observations, gages, labelled(f"gages without y = {_mm(features.lateral[missing])}")
            )
    header = observations.headers[0]
    filtered = low_pass or LowPass()
    calibration = Calibration(
        tire=header.tire.name,
        lateral=tuple(float(y) for y in features.lateral),
        chains=chains,
        rolling=_rolling(observations),
        order=filtered.order,
        cut_off=filtered.cut_off,
        geometry=geometry_of(header),
    )
    regressors = compute_regressors(features, range(count))
    average = averaging(observations)
    _, radius = full.predict(regressors)
    if not full.has("kappa"):
        radius = np.full(len(features), header.tire.ring_radius or header.tire.free_radius)
    means = means_for_tables(
        features,
        radius,
        {name: average(x) for name, x in observations.truth.items()},
        average(observations.group.astype(np.float64)).astype(np.int64),
        average,
    )
    regressions, skipped = fit_all(means)
    return Trained(calibration, links, means, regressions, skipped, cornering_trend(means))


def averaging(observations: Observations) -> Callable[[FloatArray], FloatArray]:
    """Return a function that averages over the turns of each run that have every gage."""
    features = observations.features
    rows = observations.usable & np.isfinite(features.contact_angle).all(axis=1)
    rows &= np.isfinite(features.cp1).all(axis=1) & np.isfinite(features.cp2).all(axis=1)
    rows = measured(observations, rows)
    unit = observations.unit
    return lambda values: mean_by(unit, values, rows)


def _rolling(observations: Observations) -> Rolling:
    """Learn from free-rolling turns how far CP1 and CP2 differ without traction."""
    features = observations.features
    traction = compute_regressors(features, range(features.lateral.size))["traction"]
    rows = observations.usable & np.isfinite(traction)
    force, load = observations.truth["Fx"], observations.truth["Fz"]
    if np.isfinite(force).any() and np.isfinite(load).any():
        free = rows & (np.abs(force) < FREE_FORCE * np.abs(load))
        rows = free if free.any() else rows
    centre = float(np.median(traction[rows]))
    spread = float(np.std(traction[rows]))
    return Rolling(centre, max(LEAST_TRACTION, ROLLING_SIGMAS * spread))


def take(observations: Observations, rows: BoolArray) -> Observations:
    """Return the chosen turns."""
    from dataclasses import fields, replace

    features = observations.features
    part = {
        field.name: getattr(features, field.name)[rows]
        for field in fields(features)
        if field.name != "lateral"
    }
    return replace(
        observations,
        features=replace(features, **part),
        run=observations.run[rows],
        campaign=observations.campaign[rows],
        group=observations.group[rows],
        sweep=observations.sweep[rows],
        truth={name: x[rows] for name, x in observations.truth.items()},
        nominal={name: x[rows] for name, x in observations.nominal.items()},
    )


def _mm(y: float) -> str:
    return f"{1e3 * y:+.0f} mm"


__all__: Sequence[str] = ("Trained", "averaging", "take", "train")
