"""Coordinates in which the strain of a rolling tire is smooth: of the condition, of the angle."""

from collections.abc import Sequence

import numpy as np

from tirelib.arrays import FloatArray

INPUTS = ("Fz", "alpha", "kappa", "camber", "speed", "pressure")
MIRRORED = np.array([1.0, -1.0, 1.0, -1.0, 1.0, 1.0])
"""Sign of the inputs in the mirror image of a condition, left for right."""
LOAD, SPEED, PRESSURE = 4000.0, 20.0, 2.4e5
"""Sizes by which loads, speeds and pressures are divided."""
HALF = 0.25
"""Half contact angle of the common waveform [rad]; the warp is monotonic up to twice that."""
SMALLEST = 0.08
"""Half contact angle below which the warp does not follow [rad]."""


def coordinates(inputs: FloatArray, slip: Sequence[float], scales: FloatArray) -> FloatArray:
    """Return coordinates of conditions, shape (n, 8).

    Slip acts through s = (u, w), u = C_x s_x m / (1 + s_x), w = C_y tan(alpha) m / (1 + s_x), with
    s_x = (1 + kappa) / cos(alpha) - 1 and m = (Fz / 4 kN)^a (p / 2.4 bar)^b; s tanh(|s|) / |s|
    bends where the tire slides.

    Parameters
    ----------
    inputs : array, shape (n, 6)
        In the order of `INPUTS`, SI.
    slip : sequence of float, length 4
        C_x, C_y, a, b.
    scales : array, shape (8,)
        By which the coordinates are multiplied: how fast the strain changes with each.
    """
    load, alpha, kappa, camber, speed, pressure = inputs.T
    along = (1.0 + kappa) / np.cos(alpha) - 1.0
    size = (load / LOAD) ** slip[2] * (pressure / PRESSURE) ** slip[3] / (1.0 + along)
    u, w = slip[0] * along * size, slip[1] * np.tan(alpha) * size
    total = np.hypot(u, w) + 1e-12
    bent = np.tanh(total) / total
    found: FloatArray = scales * np.stack((
        np.sqrt(load / LOAD), camber / 0.1, speed / SPEED, pressure / PRESSURE, u * bent, w * bent,
        along / 0.1, alpha / 0.1,
    ), axis=1)  # fmt: skip
    return found


def half_angle(square: FloatArray) -> FloatArray:
    """Return half contact angles [rad] of squares that an interpolation may leave below zero."""
    floor = SMALLEST**2
    return np.asarray(np.sqrt(0.5 * (square + np.hypot(square, floor))))


def warped(angle: FloatArray, centre: FloatArray, half: FloatArray) -> FloatArray:
    """Return the angle at which the common waveform shows what is seen at a wheel angle.

    s = t - (h - h_0) tanh(2 t / h) (1 - (t / pi)^2)^2, t = angle - centre: the edges of the contact
    come to +-h_0, the slope beside them keeps its width, the top of the wheel stays.

    Parameters
    ----------
    angle : array, [rad]
        Any angle; it is wrapped.
    centre, half : array, [rad]
        Middle and half of the contact; all three broadcast.
    """
    t = (angle - centre + np.pi) % (2.0 * np.pi) - np.pi
    pull = np.tanh(2.0 * t / half) * (1.0 - (t / np.pi) ** 2) ** 2
    return np.asarray(t - (half - HALF) * pull)
