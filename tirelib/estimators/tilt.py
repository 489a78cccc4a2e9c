"""A camber that a lateral force does not know: its prior, what the strain says, what it leaves.

A camber and a lateral force both lift one shoulder of the contact. A calibration at one camber
takes the one for the other, so that Fy is wrong by `FORCE` per radian. But a camber changes the
contact angle across the width more than a force does that distorts the contact as much: by `SLOPE`
per radian. What the slope of the contact angle leaves unexplained therefore tells the camber,
together with a prior for a wheel of which nobody says how it stands.

The constants are those of tires of the rig, ``python build/camber_doubt.py``; half and double of
each are in ``docs/theory/estimate_numbers.md``.
"""

import numpy as np

from tirelib.core.arrays import FloatArray

USUAL = float(np.deg2rad(2.0))
"""Standard deviation of a camber that nobody gives, [rad]: makers set their cars to -1.8 to 0.75
deg, tolerances included (service manuals of Toyota Echo 2003, Cadillac CTS 2004, Chevrolet Camaro
2014, Dodge Stratus 2000); three cars (CommonRoad's vehicles 1 to 3) lean by 1.6 to 2.4 deg more in
a turn of 0.3 g; a rig stands upright. Where the strain tells the camber it decides nothing."""
FORCE, LOAD, POWER = float(700.0 / np.deg2rad(1.0)), 4000.0, 0.33
"""Error of Fy per radian of camber, [N/rad], at a load [N], and the power of the load in it."""
SLOPE = -0.36
"""Slope of the contact angle over lateral position, in the units of the regressor `angle_slope`,
per radian of camber, at the same lateral distortion."""
READ_DOUBT = 0.25
"""Relative standard deviation of the force that is taken off for a camber that was read: tires
differ in `FORCE` over `SLOPE`."""
LEAST_LOAD = 100.0
"""The error at a smaller load is that at this one, [N]."""


def force_per_camber(load: FloatArray) -> FloatArray:
    """Return the error of Fy per radian of camber, [N/rad], shape (n,)."""
    return np.asarray(FORCE * (np.maximum(load, LEAST_LOAD) / LOAD) ** POWER)


def part_of_force(
    camber: FloatArray,
    load: FloatArray,
    ends: tuple[float, float] | None,
    left: tuple[FloatArray, FloatArray] | None,
) -> tuple[FloatArray, FloatArray]:
    """Return the part of Fy that is a camber's and its standard deviation, [N].

    Both are zero where the camber is a calibrated one.

    Parameters
    ----------
    camber, load : arrays, shape (n,), [rad], [N]
        NaN: a camber that nobody gives.
    ends : (low, high), [rad], or None
        Cambers of the calibration.
    left : (rest, noise) or None
        For `read`.
    """
    per_camber, nothing = force_per_camber(load), np.zeros_like(camber)
    away = nothing
    if ends is not None:
        away = np.abs(np.nan_to_num(camber - np.clip(camber, *ends)))
    unknown = np.isnan(camber)
    if not unknown.any():
        return nothing, per_camber * away
    leaning, std = (nothing, np.full_like(camber, USUAL)) if left is None else read(*left)
    std = np.hypot(std, READ_DOUBT * leaning)
    return np.where(unknown, per_camber * leaning, 0.0), per_camber * np.where(unknown, std, away)


def read(rest: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the camber and its standard deviation, [rad], each of shape (n,).

    Parameters
    ----------
    rest, noise : arrays, shape (n,)
        What the slope of the contact angle leaves unexplained, and the standard deviation of that
        without any camber; NaN where it says nothing.

    Examples
    --------
    >>> camber, std = read(np.array([SLOPE * 0.02, np.nan]), np.array([0.0036, 0.0036]))
    >>> camber.round(4).tolist(), std.round(4).tolist()
    ([0.0185, -0.0], [0.0096, 0.0349])
    """
    seen = np.isfinite(rest) & np.isfinite(noise)
    weight = np.where(seen, (SLOPE * USUAL / np.where(seen, noise, 1.0)) ** 2, 0.0)
    share = weight / (1.0 + weight)
    return share * np.where(seen, rest, 0.0) / SLOPE, USUAL / np.sqrt(1.0 + weight)
