"""Extremes of a simulated strain and of its rate, between the angles of their grid."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Peaks:
    """Extremes of strain and strain rate, each of shape (n_points,).

    Attributes
    ----------
    cp1, tp, cp2 : strain of the compressive peaks before and after, and of the largest tension
    rate_lead, rate_trail : [1/rad]
        Largest and smallest strain rate.
    cp1_angle, tp_angle, cp2_angle, rate_lead_angle, rate_trail_angle : [rad]
    """

    cp1: FloatArray
    tp: FloatArray
    cp2: FloatArray
    rate_lead: FloatArray
    rate_trail: FloatArray
    cp1_angle: FloatArray
    tp_angle: FloatArray
    cp2_angle: FloatArray
    rate_lead_angle: FloatArray
    rate_trail_angle: FloatArray


def extreme(phi: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return angle and value of the maximum along the last axis, by a parabola on a uniform grid.

    At the ends of the grid, or beside a value that is not finite, the sample itself is returned.

    Examples
    --------
    >>> phi = np.linspace(-1.0, 1.0, 21)
    >>> angle, value = extreme(phi, 3.0 - (phi - 0.123) ** 2)
    >>> round(float(angle), 6), round(float(value), 6)
    (0.123, 3.0)
    """
    top: IntArray = np.argmax(values, axis=-1)
    inner = np.clip(top, 1, phi.size - 2)[..., None]
    left, mid, right = (np.take_along_axis(values, inner + k, axis=-1)[..., 0] for k in (-1, 0, 1))
    fits = np.isfinite(left) & np.isfinite(mid) & np.isfinite(right) & (top == inner[..., 0])
    left, mid, right = (np.where(fits, x, 0.0) for x in (left, mid, right))
    bend = left - 2.0 * mid + right
    share = np.divide(0.5 * (left - right), bend, out=np.zeros_like(mid), where=bend < 0.0)
    best = np.take_along_axis(values, top[..., None], axis=-1)[..., 0]
    angle: FloatArray = phi[top] + share * (phi[1] - phi[0])
    value: FloatArray = np.where(fits, mid - 0.25 * (left - right) * share, best)
    return angle, value


def find_peaks(phi: FloatArray, strain: FloatArray, rate: FloatArray, edges: FloatArray) -> Peaks:
    """Return the extremes of strain and strain rate, (n_points, n_phi), on a uniform grid."""
    middle = edges.mean(axis=1)[:, None]
    before, after = phi <= middle, phi >= middle
    cp1 = extreme(phi, np.where(before, -strain, -np.inf))
    cp2 = extreme(phi, np.where(after, -strain, -np.inf))
    tp, up, down = (extreme(phi, x) for x in (strain, rate, -rate))
    return Peaks(-cp1[1], tp[1], -cp2[1], up[1], -down[1], cp1[0], tp[0], cp2[0], up[0], down[0])
