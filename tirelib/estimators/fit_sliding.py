"""Fit the form of `tirelib.estimators.sliding` to the calibration's own cornering curve."""

import numpy as np
from scipy.optimize import least_squares

from tirelib.arrays import FloatArray
from tirelib.estimators.sliding import BRUSH, FREE, SlidingCurve

USUAL_FRICTION = (1.0, 0.1)
"""Friction of a calibration that does not say, and its standard deviation."""
BRUSH_DOUBT = (1.0, 1.0)
"""How far n and m of a tire may be from those of a brush (standard deviation)."""
SCALE_USED, SCALE_MOMENT = 0.005, 2e-4
"""Errors of u [1] and of Mz / Fz [m] that count as one standard deviation of the fit."""
FEWEST = 12
LEAST_LOADS = 0.2
"""Spread of ln(load) above which c and q0 vary with the load; twice it: c quadratically."""
LEAST_CAMBER = 0.02


def fit_sliding(
    angle: FloatArray,
    load: FloatArray,
    force: FloatArray,
    moment: FloatArray,
    camber: FloatArray,
    slip_ratio: FloatArray,
    friction: FloatArray,
) -> SlidingCurve | None:
    """Fit the curve to runs; None where they are too few.

    Parameters
    ----------
    angle, load, force, moment, camber, slip_ratio, friction : arrays, shape (n,), SI, ISO
        What the rig measured; moment and friction may be NaN.
    """
    free = ~(np.abs(slip_ratio) > FREE) & (load > 0.0) & np.isfinite(force)
    if free.sum() < FEWEST:
        return None
    angle, load, force, moment, camber, friction = (
        x[free] for x in (angle, load, force, moment, camber, friction)
    )
    camber = np.where(np.isfinite(camber), camber, 0.0)
    logs = np.ptp(np.log(load))
    degree = 0 if logs < LEAST_LOADS else 1 if logs < 2.0 * LEAST_LOADS else 2
    tilted = np.ptp(camber) > LEAST_CAMBER
    has_moment = bool(np.isfinite(moment).all())
    used, turned = -force / load, moment / load if has_moment else np.zeros(load.shape)
    given = np.isfinite(friction)
    free_friction = not given.any()
    usual = USUAL_FRICTION[0] if free_friction else float(np.max(friction[given]))

    def curve(x: FloatArray) -> SlidingCurve:
        return SlidingCurve(
            friction=float(x[0]),
            sharpness=float(x[1]),
            fading=float(x[2]),
            stiffness=tuple(x[3 : 4 + degree].tolist()),
            trail=tuple(x[6 : 7 + min(degree, 1)].tolist()),
            camber=(float(x[8]), float(x[9])),
            misfit=0.0,
            largest=0.0,
        )

    def left(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = curve(x)
        mu = np.where(given, friction, found.friction)
        u, tau, _ = found.forward(angle, load, mu)
        side = np.sign(angle)
        return (
            used - side * u - found.camber[0] * camber,
            turned - side * tau - found.camber[1] * camber,
        )

    def cost(x: FloatArray) -> FloatArray:
        apart, twisted = left(x)
        prior = list((x[1:3] - BRUSH) / BRUSH_DOUBT)
        prior += [(x[0] - usual) / (USUAL_FRICTION[1] if free_friction else 1e-3)]
        prior += [1e-3 * value for value in x[3:]]  # what is not used stays where it is
        parts = [apart / SCALE_USED, twisted / SCALE_MOMENT if has_moment else 0.0 * apart]
        return np.concatenate((*parts, prior))

    small = np.abs(angle) < np.median(np.abs(angle)) + 1e-9
    steep = float(abs(used[small] @ angle[small]) / max(angle[small] @ angle[small], 1e-12))
    start = np.array([usual, 3.0, 2.0, np.log(max(steep, 1.0)), 0.0, 0.0, np.log(0.03), 0.5, 0, 0])
    low = np.array([0.2, 1.3, 0.5, 0.0, -2.0, -2.0, -7.0, -2.0, -5.0, -1.0])
    high = np.array([1.6, 8.0, 6.0, 5.0, 2.0, 2.0, -1.0, 2.0, 5.0, 1.0])
    if not tilted:
        low[8:], high[8:] = -1e-9, 1e-9
    found = least_squares(cost, start, bounds=(low, high), x_scale=np.abs(start) + 0.1).x
    made = curve(found)
    twisted = left(found)[1]
    return SlidingCurve(
        made.friction, made.sharpness, made.fading, made.stiffness, made.trail, made.camber,
        misfit=float(np.sqrt(np.mean(twisted**2))), largest=float(np.abs(turned).max()),
    )  # fmt: skip
