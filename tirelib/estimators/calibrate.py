"""Calibrate the chain of estimators on observations: one independent measurement per run.

Each link is fitted on what the links before it would have said of a condition that they had not
seen (held-out predictions), so that errors do not look smaller further down the chain than they
are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from scipy.optimize import minimize

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.errors import CalibrationError
from tirelib.estimators import basis
from tirelib.estimators.chain import AngleModel, Chain
from tirelib.estimators.ends import End, growth, outermost
from tirelib.estimators.fit import Fit, bands_of, fit_best, levels_of
from tirelib.estimators.fit_sliding import Runs, fit_sliding
from tirelib.estimators.floor import with_floor
from tirelib.estimators.grow import grow
from tirelib.estimators.laws import ConditionLaws
from tirelib.estimators.likeness_fit import fit_likeness
from tirelib.estimators.polynomial import Polynomial, leverage
from tirelib.estimators.ranges import with_ranges
from tirelib.estimators.regressors import EVEN, ODD, compute_regressors
from tirelib.estimators.sliding import SlidingCurve
from tirelib.estimators.unknowns import Road
from tirelib.observations import TRUTH, Observations, mean_by

FEWEST_CONDITIONS = 5
"""Distinct conditions below which nothing is calibrated."""
VARIES = {
    "contact_angle": 0.02,
    "traction": 0.08,
    "camber": 0.02,
    "slip_ratio": 0.02,
    "slip_angle": np.deg2rad(1.0),
    "side": 300.0,
    "load": 300.0,
    "pressure": 1e4,
    "speed_squared": 60.0,
    "cp1_slope": 0.02,
    "cp2_slope": 0.02,
    "angle_slope": 0.002,
    "tp_slope": 0.02,
    "angle_bow": 0.005,
    "tp_bow": 0.02,
    "cp1_bow": 0.01,
    "cp2_bow": 0.01,
    "fullness": 0.02,
    "skew": 0.0005,
    "steepness": 0.1,
    "steepness_change": 0.1,
    "lead_bend": 0.01,
    "trail_bend": 0.01,
}
"""Range (SI) that a regressor must cover in the data to enter a regression."""
MOSTLY = 0.5
"""Share of turns with a measurement above which those without are left out."""
FREE_ROLLING = 0.02
"""Slip ratio up to which a run tells the effective rolling radius."""
LEAST_FORCE = 0.05
"""Range of Fy over mean Fz, and ..."""
LEAST_LOAD = 0.1
"""... range of Fz over mean Fz, and ..."""
LEAST_ANGLE = np.deg2rad(0.5)
"""... range of slip angle, [rad], below which the quantity cannot be calibrated."""
BETWEEN = ("load", "slip_angle", "slip_ratio")
"""What a wheel does between the conditions of a plan."""
LEAST_ANGLE_ERROR = np.deg2rad(0.02)
"""Floor of the slip-angle error against which the cornering curve's flatness is weighed, [rad]."""


Model = TypeVar("Model")


@dataclass(frozen=True, slots=True)
class Links:
    """What the fits of one chain leave behind for reports.

    Rows are independent measurements (runs, or turns of sweeps). `held_out` are predictions by fits
    that had not seen the row's condition; `refused` says why a quantity has no model.
    """

    unit: IntArray
    groups: IntArray
    values: dict[str, FloatArray]
    truth: dict[str, FloatArray]
    nominal: dict[str, FloatArray]
    held_out: dict[str, FloatArray]
    candidates: dict[str, tuple[tuple[int, float], ...]]
    refused: dict[str, str]

    def load_level(self) -> IntArray | None:
        """Return the levels at which the load was held; None if it was not held at some."""
        return levels_of(self.truth["Fz"])

    def between(self) -> list[IntArray]:
        """Return levels, or bands, of load, slip angle and slip ratio, as far as varied."""
        varied = self._varied()
        return [bands_of(varied[name]) for name in BETWEEN if name in varied]

    def outermost(self) -> list[BoolArray]:
        """Return the rows at either end of every condition that was varied."""
        return list(outermost(self._varied()))

    def _varied(self) -> dict[str, FloatArray]:
        varied = {
            "load": self.truth["Fz"],
            "side": np.abs(self.truth["Fy"]),
            "slip_angle": np.abs(self.truth["slip_angle"]),
            "slip_ratio": self.truth["slip_ratio"],
            "camber": np.abs(self.values["camber"]),
            "pressure": self.values["pressure"],
            "speed_squared": self.values["speed_squared"],
        }
        return {name: x for name, x in varied.items() if np.ptp(x) > VARIES[name]}


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
    load, mean_load = _fit_load(links, laws, say)
    radius = _or_refused(links, "kappa", lambda: _fit_radius(links, say))
    force = _or_refused(links, "Fy", lambda: _fit_force(links, say))
    sliding = fit_sliding_of(truth, values)
    moment = _fit_moment(links, force is not None, sliding, say)
    drag = _fit_drag(links, sliding, say)
    angle = _or_refused(links, "alpha", lambda: _fit_angle(links, force is not None, sliding, say))
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
    chain = replace(
        chain,
        likeness=fit_likeness(values, groups, varying_of(values, list(VARIES)), turns, unit, rows),
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


def varying_of(values: dict[str, FloatArray], names: Sequence[str]) -> set[str]:
    """Return the regressors that cover a range worth fitting."""
    return {
        name
        for name in names
        if name in values
        and np.isfinite(values[name]).all()
        and np.ptp(values[name]) > VARIES[name]
    }


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


def _fit_load(
    links: Links, laws: ConditionLaws, say: Callable[[str], None]
) -> tuple[Polynomial | None, float]:
    truth, values = links.truth["Fz"], links.values
    mean = float(np.mean(truth)) if np.isfinite(truth).all() else np.nan
    reason = ""
    if not np.isfinite(mean):
        reason = "the rig measured no Fz in some run"
    elif np.ptp(truth) < LEAST_LOAD * mean or "contact_angle" not in varying_of(
        values, ["contact_angle"]
    ):
        reason = f"the load varies by {np.ptp(truth):.0f} N only; measure several loads"
    if reason:
        links.refused["Fz"] = reason
        links.values["load"] = np.full(truth.shape, mean)
        return None, mean
    say("Fz")
    correction, _ = laws.load_correction(values)
    varying, level = varying_of(values, list(VARIES)), links.load_level()
    candidates = basis.load_candidates(varying)
    grown = grow(
        values,
        truth - correction,
        links.groups,
        candidates,
        basis.load_families(varying),
        odd=ODD,
        level=level,
    )
    candidates += [grown] if grown and grown not in candidates else []
    try:
        fit = fit_best(
            values,
            truth - correction,
            links.groups,
            candidates,
            odd=ODD,
            level=level,
            between=links.between(),
            outermost=links.outermost(),
            what="Fz",
        )
    except CalibrationError as error:
        links.refused["Fz"] = str(error)
        links.values["load"] = np.full(truth.shape, mean)
        return None, mean
    _keep(links, "Fz", fit, fit.held_out + correction)
    links.values["load"] = fit.held_out + correction
    return fit.model, mean


def _fit_radius(links: Links, say: Callable[[str], None]) -> Polynomial | None:
    """Effective rolling radius ``v (1 + kappa) / Omega`` (Eq. 21, 22) from nearly free rolling."""
    values, kappa = links.values, links.truth["slip_ratio"]
    free = (np.abs(kappa) < FREE_ROLLING) & (values["speed"] > 0.0)
    if free.sum() < 1:
        links.refused["kappa"] = "no run rolls freely with a measured speed and slip ratio"
        return None
    say("kappa")
    part = {name: x[free] for name, x in values.items()}
    radius = part["speed"] * (1.0 + kappa[free]) / part["omega"]
    varying = varying_of(part, ["load", "pressure", "speed_squared"])
    if "Fz" in links.refused:
        varying.discard("load")
    groups = links.groups[free]
    if np.unique(groups).size < 2:
        groups = np.arange(free.sum())
    if np.unique(groups).size < 2:
        groups, part = np.arange(2), {name: np.repeat(x, 2) for name, x in part.items()}
        radius = np.repeat(radius, 2)
    ends = outermost({name: part[name] for name in sorted(varying)})
    fit = fit_best(
        part,
        radius,
        groups,
        basis.radius_candidates(varying),
        outermost=list(ends),
        what="R_eff",
    )
    held_radius = fit.model.predict(values)[0]
    held_radius[np.flatnonzero(free)[: fit.held_out.size]] = fit.held_out[: int(free.sum())]
    with np.errstate(invalid="ignore", divide="ignore"):
        held = values["omega"] * held_radius / values["speed"] - 1.0
    _keep(links, "kappa", fit, held)
    links.values["slip_ratio"] = held
    links.values["slip_size"] = np.abs(held)
    return fit.model


def _fit_force(links: Links, say: Callable[[str], None]) -> Polynomial | None:
    truth, values = links.truth["Fy"], links.values
    if not np.isfinite(truth).all():
        links.refused["Fy"] = "the rig measured no Fy in some run"
        return None
    if np.ptp(truth) < LEAST_FORCE * float(np.nanmax(np.append(values["load"], 2000.0))):
        links.refused["Fy"] = f"Fy varies by {np.ptp(truth):.0f} N only; measure slip angles"
        return None
    say("Fy")
    fit = _fit_odd(links, truth, "Fy")
    _keep(links, "Fy", fit, fit.held_out)
    return fit.model


def _fit_odd(links: Links, truth: FloatArray, what: str) -> Fit:
    """Fit what changes its sign when left and right change places."""
    values = links.values
    varying = varying_of(values, list(VARIES))
    varying -= _frozen_with_slip(links, varying)
    candidates, odd = basis.force_candidates(varying), (*ODD, "camber")
    grown = grow(
        values,
        truth,
        links.groups,
        candidates,
        basis.force_families(varying),
        odd=odd,
        level=links.load_level(),
        centre=False,
    )
    candidates += [grown] if grown and grown not in candidates else []
    return fit_best(
        values,
        truth,
        links.groups,
        candidates,
        odd=odd,
        level=links.load_level(),
        between=links.between(),
        outermost=links.outermost(),
        centre=False,
        what=what,
    )


def _fit_moment(
    links: Links, has_force: bool, sliding: SlidingCurve | None, say: Callable[[str], None]
) -> Polynomial | None:
    """Mz / (Fz q0), from the regressors of the lateral force; None where it was not measured."""
    truth = links.truth["Mz"]
    if not has_force or sliding is None or not np.isfinite(truth).all() or np.ptp(truth) == 0.0:
        return None
    say("Mz")
    load = links.truth["Fz"]
    try:
        return _fit_odd(links, truth / (load * sliding.longest(load)), "Mz").model
    except CalibrationError:
        return None


def _fit_drag(
    links: Links, sliding: SlidingCurve | None, say: Callable[[str], None]
) -> Polynomial | None:
    """-Fx / Fz, from the regressors of the load; None where it was not measured or not varied."""
    if sliding is None or not np.isfinite(sliding.slant):
        return None
    say("Fx")
    pull, varying = -links.truth["Fx"] / links.truth["Fz"], varying_of(links.values, list(VARIES))
    try:
        return fit_best(
            links.values,
            pull,
            links.groups,
            basis.load_candidates(varying),
            odd=(*ODD, "camber"),
            level=links.load_level(),
            between=links.between(),
            outermost=links.outermost(),
            what="Fx",
        ).model
    except CalibrationError:
        return None


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


def _frozen_with_slip(links: Links, varying: set[str]) -> set[str]:
    """Return the conditions that stand still wherever there is lateral force."""
    cornering = np.abs(links.truth["Fy"]) > 0.2 * np.abs(links.truth["Fy"]).max()
    part = {name: x[cornering] for name, x in links.values.items()}
    return varying - varying_of(part, sorted(varying))


def _fit_angle(
    links: Links, has_force: bool, sliding: SlidingCurve | None, say: Callable[[str], None]
) -> AngleModel | None:
    truth, values = links.truth["slip_angle"], links.values
    if not has_force:
        links.refused["alpha"] = "it follows from Fy, which is not calibrated"
        return None
    if not np.isfinite(truth).all() or np.ptp(truth) < LEAST_ANGLE:
        links.refused["alpha"] = "the slip angle was not measured or not varied"
        return None
    if not np.isfinite(values["load"]).all():
        links.refused["alpha"] = "it needs the load, and the rig measured no Fz"
        return None
    say("alpha")
    values["utilisation"] = links.held_out["Fy"] / values["load"]
    varying = varying_of(values, list(VARIES))
    varying -= _frozen_with_slip(links, varying)
    if "Fz" in links.refused:
        varying.discard("load")
    candidates = basis.angle_candidates(varying)
    blur = float(
        np.sqrt(np.mean(((links.truth["Fy"] - links.held_out["Fy"]) / values["load"]) ** 2))
    )
    sharpness = blur / LEAST_ANGLE_ERROR
    # where the cornering curve is flat, the same error of Fy means more slip angle: weigh it less
    steep = _flatness(truth, values["utilisation"])
    odd = ("utilisation", "camber")
    moved, doubt = _by_friction(links, sliding)
    truth = truth - moved  # what it would be on the road that the curve stands for
    steady = 1.0 / (1.0 + (doubt / LEAST_ANGLE_ERROR) ** 2)
    weights = steady / (1.0 + (sharpness * steep) ** 2)
    for _ in range(2):
        fit = fit_best(
            values,
            truth,
            links.groups,
            candidates,
            odd=odd,
            level=links.load_level(),
            between=links.between(),
            outermost=links.outermost(),
            weights=weights,
            centre=False,
            what="alpha",
        )
        steep = np.maximum(steep, np.abs(fit.model.slope(values, "utilisation")))
        weights = steady / (1.0 + (sharpness * steep) ** 2)
    _keep(links, "alpha", fit, fit.held_out + moved)
    return _weighed(fit.model, values, truth - fit.held_out, fit.ends)


def _by_friction(links: Links, sliding: SlidingCurve | None) -> tuple[FloatArray, FloatArray]:
    """Return what the friction of each run changes in its slip angle, and its doubt, [rad]."""
    friction = links.values["friction"]
    none = np.zeros_like(friction)
    if sliding is None or np.isnan(friction).all():
        return none, none
    used = np.abs(links.truth["Fy"] / links.truth["Fz"])
    told = sliding.at(
        used,
        links.truth["Fz"],
        np.where(np.isnan(friction), sliding.friction, friction),
        links.truth["slip_ratio"],
    )
    side = np.where(links.truth["slip_angle"] < 0.0, -1.0, 1.0)
    return side * told.change, np.fmin(told.std, 1.0)


def _weighed(
    model: Polynomial, values: dict[str, FloatArray], error: FloatArray, ends: tuple[End, ...]
) -> AngleModel:
    """Find how the held-out error grows where the cornering curve is flat, and beyond the data.

    Maximum likelihood of ``variance = leverage + a + b s^2 + c s^4``, s the slope d alpha / d u.
    """
    x = model.design(values)
    uncertain = leverage(x, model.covariance)
    steep = model.slope(values, "utilisation") ** 2
    typical = float(np.median(steep))
    unit = float(np.median(error**2)) + LEAST_ANGLE_ERROR**2 * 1e-3
    shape = np.stack((np.ones_like(steep), steep / typical, (steep / typical) ** 2))

    def surprise(logs: FloatArray) -> float:
        variance = uncertain + unit * (np.exp(logs) @ shape)
        return float(np.sum(np.log(variance) + error**2 / variance))

    best = minimize(
        surprise,
        np.array([-1.0, -1.0, -3.0]),
        method="Nelder-Mead",
        bounds=[(-9.0, 9.0)] * 3,
        options={"maxiter": 2000},
    )
    constant, square, fourth = np.exp(best.x) * unit
    known = unit * (np.exp(best.x) @ shape)
    if model.border is None:
        raise ValueError("a fitted model knows its border")
    lost = growth(
        [end.error for end in ends],
        [known[end.rows] + end.uncertain for end in ends],
        [end.beyond for end in ends],
    )
    border = replace(model.border, growth=lost)
    return AngleModel(
        replace(model, residual=float(np.sqrt(constant)), border=border),
        blur=float(np.sqrt(square / typical)),
        bend=float(np.sqrt(fourth) / typical),
    )


def _flatness(angle: FloatArray, utilisation: FloatArray) -> FloatArray:
    """Slope d alpha / d utilisation of a curve ``u = a tanh(alpha / b)`` through the data."""
    size, share = np.abs(angle), np.abs(utilisation)
    top = 1.02 * float(share.max())
    width = float(np.median(size[size > 0] / np.arctanh(np.minimum(share[size > 0] / top, 0.98))))
    return width / top * np.cosh(np.minimum(size / width, 6.0)) ** 2


def _keep(links: Links, quantity: str, fit: Fit, held_out: FloatArray) -> None:
    links.held_out[quantity] = held_out
    links.candidates[quantity] = fit.candidates
