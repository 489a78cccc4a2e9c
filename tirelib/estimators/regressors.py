"""Regressors: few numbers per turn, from the features of the gages that work.

A quantity q read at several lateral positions y is described by a straight line fitted over the
gages, q = q0 + q1 y / y_max: its **level** q0 is even, its **slope** q1 odd in slip angle and
camber. Fitted lines also serve when a gage is out. Strains are divided by the mean tension inside
the contact, so the gain that all gages share (temperature of the bridge, supply) drops out.
"""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.measured.features.extract import Features

EVEN = ("contact_angle", "compression", "traction", "tension")
"""Regressors that keep their sign when left and right change places."""
ODD = ("cp1_slope", "cp2_slope", "angle_slope", "tp_slope")
"""Regressors that change their sign when left and right change places."""
SHAPE = (
    "angle_bow",
    "tp_bow",
    "cp1_bow",
    "cp2_bow",
    "fullness",
    "skew",
    "steepness",
    "steepness_change",
    "lead_bend",
    "trail_bend",
)
"""Even regressors of the contact's shape, over its width and along it."""
TWISTS = ("angle_twist", "cp1_twist", "cp2_twist", "tp_twist")
"""Odd regressors: what a cubic over the lateral position has of a feature beyond level to bow."""
WAVES = ("angle_wave", "cp1_wave", "cp2_wave", "tp_wave")
"""Even ones: what a quartic has. No estimate uses either; they tell whether gages agree."""
SIDED = (*ODD, *TWISTS)
CONDITIONS = ("pressure", "speed", "camber")


def compute_regressors(features: Features, gages: Sequence[int]) -> dict[str, FloatArray]:
    """Return the regressors of each turn.

    Parameters
    ----------
    features : Features
    gages : sequence of int
        Indices of the gages to use, at least two.

    Returns
    -------
    dict of arrays, shape (n,)
        ``contact_angle`` [rad] mean contact angle; ``compression`` mean of CP1 and CP2 over TP;
        ``traction`` (CP1 - CP2) / TP; ``tension`` mean TP [strain]; ``cp1_slope``, ``cp2_slope``,
        ``tp_slope`` slopes over TP; ``angle_slope`` [rad]; ``omega`` [rad/s] and the conditions.
        The shape gives ``angle_bow`` [rad], ``tp_bow``, ``cp1_bow``, ``cp2_bow`` over TP, NaN for
        fewer than three gages; ``fullness`` E_vertical over TP [rad], ``skew`` [rad]; ``steepness``
        mean of the peak rates at both edges over TP and ``steepness_change`` leading less trailing
        [1/rad]; ``lead_bend``, ``trail_bend`` from each edge to its compressive peak [rad].
        ``angle_twist`` to ``tp_wave``: what is left over the width, NaN for fewer than four
        (twists) and five gages (waves).
    """
    use = list(gages)
    y = features.lateral[use]
    places = tuple((y / np.abs(features.lateral).max()).tolist())
    line = _fitted(places, 1)

    def level_slope(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        fitted = values[:, use] @ line.T
        return fitted[:, 0], fitted[:, 1]

    def level(values: FloatArray) -> FloatArray:
        return np.asarray(values[:, use] @ line[0], dtype=np.float64)

    def highest(values: FloatArray, degree: int) -> FloatArray:
        if len(use) <= degree:
            return np.full(len(features), np.nan)
        return np.asarray(values[:, use] @ _fitted(places, degree)[degree], dtype=np.float64)

    def bow(values: FloatArray) -> FloatArray:
        return highest(values, 2)

    scale = features.tp[:, use].mean(axis=1)
    angle, angle_slope = level_slope(features.contact_angle)
    cp1, cp1_slope = level_slope(features.cp1)
    cp2, cp2_slope = level_slope(features.cp2)
    _, tp_slope = level_slope(features.tp)
    left = {
        f"{name}_{what}": highest(values, degree) / unit
        for what, degree in (("twist", 3), ("wave", 4))
        for name, values, unit in (
            ("angle", features.contact_angle, 1.0),
            ("cp1", features.cp1, scale),
            ("cp2", features.cp2, scale),
            ("tp", features.tp, scale),
        )
    }
    return {
        "contact_angle": angle,
        "compression": 0.5 * (cp1 + cp2) / scale,
        "traction": (cp1 - cp2) / scale,
        "tension": scale,
        "cp1_slope": cp1_slope / scale,
        "cp2_slope": cp2_slope / scale,
        "angle_slope": angle_slope,
        "tp_slope": tp_slope / scale,
        "angle_bow": bow(features.contact_angle),
        "tp_bow": bow(features.tp) / scale,
        "cp1_bow": bow(features.cp1) / scale,
        "cp2_bow": bow(features.cp2) / scale,
        "fullness": level(features.e_vertical) / scale,
        "skew": level(features.skew),
        "steepness": 0.5 * level(features.rate_lead - features.rate_trail) / scale,
        "steepness_change": level(features.rate_lead + features.rate_trail) / scale,
        "lead_bend": level(features.lead - features.cp1_angle),
        "trail_bend": level(features.cp2_angle - features.trail),
        **left,
        "omega": features.omega,
        "pressure": features.pressure,
        "speed": features.speed,
        "camber": features.camber,
        "friction": features.friction,
        "tread_depth": features.tread_depth,
        "tread_temperature": features.tread_temperature,
    }


@cache
def _fitted(y: tuple[float, ...], degree: int) -> FloatArray:
    """Return the matrix, shape (degree + 1, n), that fits a polynomial over the positions y."""
    return np.asarray(np.linalg.pinv(np.vander(np.array(y), degree + 1, increasing=True)))


def select(regressors: Mapping[str, FloatArray], rows: BoolArray) -> dict[str, FloatArray]:
    """Return the given rows of every regressor."""
    return {name: values[rows] for name, values in regressors.items()}
