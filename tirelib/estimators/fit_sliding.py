"""Fit the form of `tirelib.estimators.sliding` to the calibration's own cornering curve."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import FloatArray
from tirelib.estimators.sliding import BRUSH, FREE, LOAD, USUAL_FRICTION, SlidingCurve

GRIP = (0.95, 0.05)
"""Largest utilisation over the friction, and how far tires differ (standard deviation)."""
FORM_DOUBT = 0.05
"""Relative standard deviation of a fitted friction: the rig's `reference`, `soft` and `stiff` are
fitted -2, 1 and -5 % off their 0.95."""
BRUSH_DOUBT = (1.0, 1.0)
"""How far n and m of a tire may be from those of a brush (standard deviation)."""
SCALE_USED, SCALE_PULL, SCALE_MOMENT = 0.005, 0.02, 2e-4
"""Errors of u_y, u_x [1] and of Mz / Fz [m] (at 4 kN, in proportion to the load elsewhere) that
count as one standard deviation of the fit."""
FEWEST_SLIDING = 12
LEAST_LOADS = 0.2
"""Spread of ln(load) above which c, q0 and r vary with the load; twice it: quadratically."""
LEAST_CAMBER = 0.02
LEAST_PULL = 0.1
"""Longitudinal utilisation above which its error counts as a share of it."""
FEWEST_PULLED = 4
"""Braked or driven runs below which the tire counts as equally stiff along and across."""


@dataclass(frozen=True, slots=True)
class Runs:
    """What the rig measured of n runs, SI, ISO 8855; all but the first three may be NaN."""

    angle: FloatArray
    load: FloatArray
    side: FloatArray
    pull: FloatArray
    moment: FloatArray
    camber: FloatArray
    slip_ratio: FloatArray
    friction: FloatArray


def fit_sliding(runs: Runs) -> SlidingCurve | None:
    """Fit the curve to runs; None where too few roll freely."""
    angle, load = runs.angle, runs.load
    free = ~(np.abs(runs.slip_ratio) > FREE)
    told = np.isfinite(runs.slip_ratio) & np.isfinite(runs.pull)  # how it brakes and drives
    good = (load > 0.0) & np.isfinite(runs.side) & (free | told)
    if (good & free).sum() < FEWEST_SLIDING:
        return None
    load = np.where(good, load, LOAD)
    camber = np.nan_to_num(runs.camber)
    logs = np.log(load)
    degree = _degree(logs[good])
    pulled = good & ~free
    turns = _degree(logs[pulled]) if pulled.sum() >= FEWEST_PULLED else 0
    tilted = np.ptp(camber) > LEAST_CAMBER
    has_moment = bool(np.isfinite(runs.moment[good & free]).all())
    used, pull = -runs.side / load, -runs.pull / load
    turned = runs.moment / load
    given = np.isfinite(runs.friction)
    known = bool(given.any())
    usual = float(np.max(runs.friction[given])) if known else USUAL_FRICTION[0]
    rolls = np.where(np.isfinite(runs.slip_ratio), runs.slip_ratio, np.cos(angle) - 1.0)
    side = np.sign(angle)

    def curve(x: FloatArray, **more: float) -> SlidingCurve:
        return SlidingCurve(
            friction=usual if known else float(x[0]),
            friction_std=more.get("friction_std", 0.0),
            grip=float(x[0]) / usual if known else 1.0,
            sharpness=float(x[1]),
            fading=float(x[2]),
            stiffness=tuple(x[3 : 4 + degree].tolist()),
            trail=tuple(x[6 : 7 + min(degree, 1)].tolist()),
            ratio=tuple(x[10 : 11 + turns].tolist()),
            camber=(float(x[8]), float(x[9])),
            misfit=more.get("misfit", np.inf),
            slant=more.get("slant", np.inf),
        )

    def left(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return errors of u_y, u_x and Mz / (Fz q0), and u_x."""
        found = curve(x)
        mu = np.where(given, runs.friction, found.friction)
        across, along, aligned, _ = found.forward(angle, load, mu, rolls)
        return (
            np.where(good, used - side * across - found.camber[0] * camber, 0.0),
            np.where(pulled, pull - along, 0.0),
            np.where(
                good & free & has_moment,
                turned / found.longest(load) - side * aligned - found.camber[1] * camber,
                0.0,
            ),
            along,
        )

    def cost(x: FloatArray) -> FloatArray:
        apart, slanted, twisted, _ = left(x)
        twisted = twisted * curve(x).longest(load) * LOAD / load
        likely = (GRIP[0] * usual, GRIP[1] * usual) if known else USUAL_FRICTION
        prior = [*(x[1:3] - BRUSH) / BRUSH_DOUBT, (x[0] - likely[0]) / likely[1]]
        prior += [1e-3 * value for value in x[3:]]  # what is not used stays where it is
        parts = (apart / SCALE_USED, slanted / SCALE_PULL, twisted / SCALE_MOMENT)
        return np.concatenate((*parts, prior))

    rows = good & free
    small = rows & (np.abs(angle) < np.median(np.abs(angle[rows])) + 1e-9)
    steep = float(abs(used[small] @ angle[small]) / max(angle[small] @ angle[small], 1e-12))
    start = np.array(
        [
            usual,
            3.0,
            2.0,
            np.log(max(steep, 1.0)),
            0.0,
            0.0,
            np.log(0.03),
            0.5,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        ]
    )
    low = np.array([0.2, 1.3, 0.5, 0.0, -2.0, -2.0, -7.0, -2.0, -5.0, -40.0, -2.0, -2.0, -2.0])
    high = np.array([1.6, 8.0, 6.0, 5.0, 2.0, 2.0, -1.0, 2.0, 5.0, 40.0, 2.0, 2.0, 2.0])
    if not tilted:
        low[8:10], high[8:10] = -1e-9, 1e-9
    if pulled.sum() < FEWEST_PULLED:
        low[10:], high[10:] = -1e-9, 1e-9
    found = least_squares(cost, start, bounds=(low, high), x_scale=np.abs(start) + 0.1).x
    _, slanted, twisted, along = left(found)
    hard = pulled & (np.abs(along) > LEAST_PULL)
    return curve(
        found,
        friction_std=0.0 if known else FORM_DOUBT * float(found[0]),
        misfit=_rms(twisted[good & free]) if has_moment else np.inf,
        slant=_rms(slanted[hard] / along[hard]) if hard.sum() >= FEWEST_PULLED else np.inf,
    )


def _degree(logs: FloatArray) -> int:
    spread = np.ptp(logs)
    return 0 if spread < LEAST_LOADS else 1 if spread < 2.0 * LEAST_LOADS else 2


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2)))
