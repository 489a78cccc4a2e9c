"""Fit load, rolling radius, lateral force, aligning moment and drag to the links of a chain."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators import basis
from tirelib.estimators.ends import outermost
from tirelib.estimators.fit import Fit, fit_best
from tirelib.estimators.grow import grow
from tirelib.estimators.laws import ConditionLaws
from tirelib.estimators.links import VARIES, Links, frozen_with_slip, keep, varying_of
from tirelib.estimators.polynomial import Polynomial, leverage
from tirelib.estimators.pulled import parted
from tirelib.estimators.regressors import ODD
from tirelib.estimators.sliding import SlidingCurve

FREE_ROLLING = 0.02
"""Slip ratio up to which a run tells the effective rolling radius."""
LEAST_FORCE = 0.05
"""Least range of the lateral force that is fitted, over the largest load (at least 2 kN)."""
LEAST_LOAD = 0.1
"""Least range of the load from which it is fitted, over the mean load."""


def fit_load(
    links: Links, laws: ConditionLaws, say: Callable[[str], None]
) -> tuple[Polynomial | None, float]:
    """Fit the load (None, and the reason in `links`, where it cannot be); the mean load, [N]."""
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
    keep(links, "Fz", fit, fit.held_out + correction)
    links.values["load"] = fit.held_out + correction
    model = _with_pull(fit.model, values, truth - correction - fit.held_out)
    return fit.at_any_load(model), mean


def _with_pull(
    model: Polynomial, values: Mapping[str, FloatArray], error: FloatArray
) -> Polynomial:
    """Return the model with a standard deviation for free rolling and one for traction."""
    uncertain = leverage(model.design(values), model.covariance)
    found = parted(error, uncertain, values["traction"])
    if found is None:
        return model
    return replace(model, residual=found[0], pulled=found[1])


def fit_radius(links: Links, say: Callable[[str], None]) -> Polynomial | None:
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
    keep(links, "kappa", fit, held)
    links.values["slip_ratio"] = held
    links.values["slip_size"] = np.abs(held)
    return fit.model


def fit_force(links: Links, say: Callable[[str], None]) -> Polynomial | None:
    """Fit the lateral force; None, and the reason in `links`, where the data cannot inform it."""
    truth, values = links.truth["Fy"], links.values
    if not np.isfinite(truth).all():
        links.refused["Fy"] = "the rig measured no Fy in some run"
        return None
    if np.ptp(truth) < LEAST_FORCE * float(np.nanmax(np.append(values["load"], 2000.0))):
        links.refused["Fy"] = f"Fy varies by {np.ptp(truth):.0f} N only; measure slip angles"
        return None
    say("Fy")
    fit = _fit_odd(links, truth, "Fy")
    keep(links, "Fy", fit, fit.held_out)
    return fit.at_any_load(fit.model)


def _fit_odd(links: Links, truth: FloatArray, what: str) -> Fit:
    """Fit what changes its sign when left and right change places."""
    values = links.values
    varying = varying_of(values, list(VARIES))
    varying -= frozen_with_slip(links, varying)
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


def fit_moment(
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


def fit_drag(
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
