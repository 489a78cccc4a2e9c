"""Coordinates in which the strain of a rolling tire is smooth: of the condition, of the angle.

Each formula stands once and serves arrays as well as single numbers, for which `math` takes a tenth
of the time; `by` is the module that has the functions, ``numpy`` or ``math``.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

INPUTS = ("Fz", "alpha", "kappa", "camber", "speed", "pressure")
FRICTION = "friction"
"""A seventh input, of surfaces that were made with it: the road's coefficient of friction."""
MIRRORED = np.array([1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
"""Sign of the inputs in the mirror image of a condition, left for right."""
LOAD, SPEED, PRESSURE = 4000.0, 20.0, 2.4e5
"""Sizes by which loads, speeds and pressures are divided."""
COMMON_HALF_ANGLE = 0.25
"""Half contact angle of the common waveform [rad]; the warp is monotonic up to twice that."""
SMALLEST_HALF_ANGLE = 0.08
"""Half contact angle below which the warp does not follow [rad]."""
_PI = float(np.pi)


def coordinates(
    inputs: Sequence[Any], slip: Sequence[float], scales: Sequence[float], by: Any = np
) -> list[Any]:
    """Return the coordinates of conditions: 8, or 9 where friction is an input.

    Slip acts through s = (u, w), u = C_x s_x m / (1 + s_x), w = C_y tan(alpha) m / (1 + s_x), with
    s_x = (1 + kappa) / cos(alpha) - 1 and m = (Fz / 4 kN)^a (p / 2.4 bar)^b; s tanh(|s| / mu) mu /
    |s| bends where the tire slides. Without an input for it, the friction mu is 1.

    Parameters
    ----------
    inputs : sequence of 6 or 7 floats or arrays
        `INPUTS`, SI, and friction.
    slip : sequence of float, length 4
        C_x, C_y, a, b.
    scales : sequence of float, as many as coordinates
        By which the coordinates are multiplied: how fast the strain changes with each.
    by : module
    """
    load, alpha, kappa, camber, speed, pressure, *rest = inputs
    friction = rest[0] if rest else 1.0
    along = (1.0 + kappa) / by.cos(alpha) - 1.0
    size = (load / LOAD) ** slip[2] * (pressure / PRESSURE) ** slip[3] / (1.0 + along)
    u, w = slip[0] * along * size, slip[1] * by.tan(alpha) * size
    total = by.hypot(u, w) + 1e-12
    bent = friction * by.tanh(total / friction) / total
    found = (
        by.sqrt(load / LOAD),
        camber / 0.1,
        speed / SPEED,
        pressure / PRESSURE,
        u * bent,
        w * bent,
        along / 0.1,
        alpha / 0.1,
        *rest,
    )
    return [scale * value for scale, value in zip(scales, found, strict=True)]


def half_angle(square: Any, by: Any = np) -> Any:
    """Return half contact angles [rad] of squares that an interpolation may leave below zero."""
    return by.sqrt(0.5 * (square + by.hypot(square, SMALLEST_HALF_ANGLE**2)))


def warped(angle: Any, centre: Any, half: Any, by: Any = np) -> Any:
    """Return the angle at which the common waveform shows what is seen at a wheel angle.

    s = t - (h - h_0) tanh(2 t / h) (1 - (t / pi)^2)^2, t = angle - centre: the edges of the contact
    come to +-h_0, the slope beside them keeps its width, the top of the wheel stays.

    Parameters
    ----------
    angle : float or array, [rad]
        Any angle; it is wrapped.
    centre, half : float or array, [rad]
        Middle and half of the contact; all three broadcast.
    by : module
    """
    t = (angle - centre + _PI) % (2.0 * _PI) - _PI
    pull = by.tanh(2.0 * t / half) * (1.0 - (t / _PI) ** 2) ** 2
    return t - (half - COMMON_HALF_ANGLE) * pull


def spline_weights(t: Any) -> tuple[Any, Any, Any, Any]:
    """Return the four weights of a cubic B-spline at t, 0 .. 1 between its middle knots."""
    s = 1.0 - t
    return (
        s * s * s / 6.0,
        (t * t * (3.0 * t - 6.0) + 4.0) / 6.0,
        (s * s * (3.0 * s - 6.0) + 4.0) / 6.0,
        t * t * t / 6.0,
    )
