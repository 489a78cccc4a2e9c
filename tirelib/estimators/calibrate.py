"""Calibrate the chain of estimators on observations: one independent measurement per run.

Each link is fitted on what the links before it would have said of a condition that they had not
seen (held-out predictions), so that errors do not look smaller further down the chain than they
are.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.chain import Chain
from tirelib.estimators.fit_angle import LEAST_ANGLE, fit_angle
from tirelib.estimators.fit_links import fit_drag, fit_force, fit_load, fit_moment, fit_radius
from tirelib.estimators.fit_sliding import Runs, fit_sliding
from tirelib.estimators.floor import with_floor
from tirelib.estimators.laws import ConditionLaws
from tirelib.estimators.likeness import AGREEMENT
from tirelib.estimators.likeness_fit import fit_likeness
from tirelib.estimators.links import VARIES, Links, varying_of
from tirelib.estimators.ranges import with_ranges
from tirelib.estimators.regressors import EVEN, ODD, compute_regressors
from tirelib.estimators.sliding import SlidingCurve
from tirelib.estimators.unknowns import Road
from tirelib.measured.observations import TRUTH, Observations, mean_by

FEWEST_CONDITIONS = 5
"""Distinct conditions below which nothing is calibrated."""
MOSTLY = 0.5
"""Share of turns with a measurement above which those without are left out."""


Model = TypeVar("Model")


def calibrate_chain(
    observations: Observations,
    gages: Sequence[int],
    progress: Callable[[str], None] | None = None,
) -> tuple[Chain, Links]:
    """Fit every link that the data can inform, with the given gages.

    Raises
    ------
    CalibrationError
        If fewer than `FEWEST_CONDITIONS` conditions were measured.
    """
    rows = observations.usable
    regressors = compute_regressors(observations.features, gages)
    for name in (*EVEN, *ODD):
        rows = rows & np.isfinite(regressors[name])
    unit = observations.unit
    if np.unique(observations.group[rows]).size < FEWEST_CONDITIONS:
        raise CalibrationError(
            f"{', '.join(h.name for h in observations.headers)}: usable turns at "
            f"{np.unique(observations.group[rows]).size} conditions; a calibration needs at least "
            f"{FEWEST_CONDITIONS}; measure more runs or look at the flags with `tirelib features`"
        )
    rows = measured(observations, rows)
    values = {name: mean_by(unit, x, rows) for name, x in regressors.items()}
    values["speed_squared"] = values["speed"] ** 2
    truth = {name: mean_by(unit, observations.truth[name], rows) for name in TRUTH}
    nominal = {name: mean_by(unit, x, rows) for name, x in observations.nominal.items()}
    groups = mean_by(unit, observations.group.astype(np.float64), rows).astype(np.int64)
    links = Links(np.unique(unit[rows]), groups, values, truth, nominal, {}, {}, {})
    say = progress or (lambda _: None)
    laws = laws_of(observations, values)
    load, mean_load = fit_load(links, laws, say)
    radius = _or_refused(links, "kappa", lambda: fit_radius(links, say))
    force = _or_refused(links, "Fy", lambda: fit_force(links, say))
    sliding = fit_sliding_of(truth, values)
    moment = fit_moment(links, force is not None, sliding, say)
    drag = fit_drag(links, sliding, say)
    angle = _or_refused(links, "alpha", lambda: fit_angle(links, force is not None, sliding, say))
    chain = Chain(
        gages=tuple(gages),
        guards=dict.fromkeys(("Fz", "alpha", "kappa", "Fy"), ()),
        laws=laws,
        force_laws=_force_laws(links, laws),
        mean_load=mean_load,
        load=load,
        radius=radius,
        force=force,
        angle=angle,
        moment=moment,
        drag=drag,
        sliding=sliding,
        road=_road(links),
    )
    turns = {**regressors, "speed_squared": regressors["speed"] ** 2}
    seen = (values, groups, varying_of(values, list(VARIES)), turns, unit, rows)
    chain = replace(
        chain, likeness=fit_likeness(*seen), agreement=fit_likeness(*seen, names=AGREEMENT)
    )
    return with_ranges(with_floor(chain, regressors, unit, rows), values, truth), links


def measured(observations: Observations, rows: BoolArray) -> BoolArray:
    """Leave out the few turns for which the rig did not measure what it measured for most."""
    for name in ("Fz", "Fy", "slip_angle", "slip_ratio"):
        known = np.isfinite(observations.truth[name])
        if known[rows].mean() > MOSTLY:
            rows = rows & known
    return rows


def _or_refused(links: Links, quantity: str, fit: Callable[[], Model | None]) -> Model | None:
    """Return a fitted model; where the data cannot inform it, keep the reason."""
    try:
        return fit()
    except CalibrationError as error:
        links.refused[quantity] = str(error)
        return None


def laws_of(observations: Observations, values: dict[str, FloatArray]) -> ConditionLaws:
    """Return the laws of the conditions under which run means `values` were measured."""
    tire = observations.headers[0].tire
    varying = varying_of(values, ("pressure", "speed_squared"))

    def limits(x: FloatArray) -> tuple[float, float]:
        return (float(x.min()), float(x.max())) if np.isfinite(x).all() else (np.nan, np.nan)

    return ConditionLaws(
        pressure=limits(values["pressure"]),
        speed=limits(values["speed"]),
        pressure_fitted="pressure" in varying,
        speed_fitted="speed_squared" in varying,
        contact_width=tire.belt_width or np.nan,
        radius=tire.ring_radius or tire.free_radius,
    )


def _force_laws(links: Links, laws: ConditionLaws) -> ConditionLaws:
    """Return the laws of what depends on lateral force: only what varied with it is fitted."""
    force = np.abs(links.truth["Fy"])
    cornering = force > 0.2 * np.nanmax(force) if np.isfinite(force).any() else force > 0.0
    if not cornering.any():
        return laws
    part = {name: x[cornering] for name, x in links.values.items()}
    varying = varying_of(part, ("pressure", "speed_squared"))

    def limits(x: FloatArray) -> tuple[float, float]:
        return (float(x.min()), float(x.max())) if np.isfinite(x).all() else (np.nan, np.nan)

    return replace(
        laws,
        pressure=limits(part["pressure"]),
        speed=limits(part["speed"]),
        pressure_fitted="pressure" in varying,
        speed_fitted="speed_squared" in varying,
    )


def fit_sliding_of(
    truth: dict[str, FloatArray], values: dict[str, FloatArray]
) -> SlidingCurve | None:
    """Fit the cornering curve on roads of other friction; None where slip was not varied."""
    needed = (truth["slip_angle"], truth["Fz"], truth["Fy"])
    if not all(np.isfinite(x).all() for x in needed) or np.ptp(needed[0]) < LEAST_ANGLE:
        return None
    return fit_sliding(
        Runs(
            *needed,
            truth["Fx"],
            truth["Mz"],
            values["camber"],
            truth["slip_ratio"],
            values["friction"],
        )
    )


def _road(links: Links) -> Road:
    """Return what the data say of friction and tread; NaN where a run does not."""
    ranges = []
    for name in ("friction", "tread_depth", "tread_temperature"):
        x = links.values[name]
        known = bool(np.isfinite(x).all())
        ranges.append((float(x.min()), float(x.max())) if known else (np.nan, np.nan))
    return Road(*ranges)
