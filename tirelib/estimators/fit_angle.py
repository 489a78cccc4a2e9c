"""Fit the slip angle to the lateral utilisation; its error grows where the curve is flat."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from tirelib.core.arrays import FloatArray
from tirelib.estimators import basis
from tirelib.estimators.angle_model import AngleModel
from tirelib.estimators.ends import End, growth
from tirelib.estimators.fit import fit_best
from tirelib.estimators.links import VARIES, Links, frozen_with_slip, keep, varying_of
from tirelib.estimators.polynomial import Polynomial, leverage
from tirelib.estimators.sliding import SlidingCurve

LEAST_ANGLE = np.deg2rad(0.5)
"""Range of slip angle, [rad], below which nothing that needs it can be calibrated."""
LEAST_ANGLE_ERROR = np.deg2rad(0.02)
"""Floor of the slip-angle error against which the cornering curve's flatness is weighed, [rad]."""


def fit_angle(
    links: Links, has_force: bool, sliding: SlidingCurve | None, say: Callable[[str], None]
) -> AngleModel | None:
    """Fit the slip angle; None, and the reason in `links`, where the data cannot inform it."""
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
    varying -= frozen_with_slip(links, varying)
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
    keep(links, "alpha", fit, fit.held_out + moved)
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
