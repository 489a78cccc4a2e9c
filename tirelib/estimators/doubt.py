"""What an uncertain wheel angle and an uncertain offset leave uncertain in an estimate.

Both come with each turn (`Features.angle_std`, `Features.offset_std`). Features are moved along
them, and what the chain of estimators makes of the moved ones is compared with what it makes of
those that were read; so regressors, polynomials and links need to know nothing of it.
"""

from dataclasses import fields, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.measured.features.extract import Features

ANGLE_STEP = 1e-3
"""Relative step of the wheel angle's scale for the slope over it: small, far above rounding."""
_ANGLES = ("lead", "trail", "cp1_angle", "cp2_angle", "tp_angle", "e_vertical", "skew")
_RATES = ("rate_lead", "rate_trail")
_STRAINS = ("cp1", "cp2", "tp", "mean")


def with_moved(features: Features) -> Features:
    """Return the turns, then the same with longer angles, then the same with a higher offset."""
    scale = 1.0 + ANGLE_STEP
    longer = {name: getattr(features, name) * scale for name in _ANGLES}
    longer |= {name: getattr(features, name) / scale for name in _RATES}
    longer["e_friction"] = features.e_friction * scale**2
    step = features.offset_std
    higher = {name: getattr(features, name) - step for name in _STRAINS}
    higher["offset"] = features.offset + step
    higher["e_vertical"] = features.e_vertical - step * features.contact_angle
    parts = (features, replace(features, **longer), replace(features, **higher))
    joined = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(Features)
        if field.name != "lateral"
    }
    return Features(lateral=features.lateral, **joined)


def moved_by(value: FloatArray, angle_std: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what one standard deviation of the angle, and of the offset, moves a value by.

    Parameters
    ----------
    value : array, shape (3 n, ...)
        What was computed from the features of `with_moved`.
    angle_std : array, shape (n,), [1]

    Returns
    -------
    by angle, by offset : arrays, shape (n, ...)
    """
    here, longer, higher = value.reshape(3, -1, *value.shape[1:])
    share = angle_std.reshape(-1, *(1,) * (value.ndim - 1)) / ANGLE_STEP
    return (longer - here) * share, higher - here


def doubt(value: FloatArray, angle_std: FloatArray) -> FloatArray:
    """Return the standard deviation that angle and offset leave, shape (n,); as `moved_by`."""
    return np.hypot(*moved_by(value, angle_std))
