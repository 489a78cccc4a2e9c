"""The range in which each regressor and each quantity was calibrated, and the slack beyond it."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.estimators.chain import Chain
from tirelib.estimators.polynomial import Cloud, Polynomial, Range
from tirelib.estimators.regressors import ODD, SHAPE

SLACK = {
    "contact_angle": 0.01,
    "compression": 0.03,
    "traction": 0.03,
    "cp1_slope": 0.02,
    "cp2_slope": 0.02,
    "tp_slope": 0.02,
    "angle_slope": 0.004,
    "utilisation": 0.02,
    "camber": np.deg2rad(0.5),
    "kappa": 0.003,
    "angle_bow": 0.004,
    "tp_bow": 0.02,
    "cp1_bow": 0.01,
    "cp2_bow": 0.01,
    "fullness": 0.01,
    "skew": 0.0005,
    "steepness": 0.1,
    "steepness_change": 0.1,
    "lead_bend": 0.01,
    "trail_bend": 0.01,
}
"""Least distance (SI) beyond the calibrated range that is still taken as calibrated."""
LEAST_TRACTION = 0.08
"""Range of the traction regressor above which traction was varied on purpose."""
LEAST_HALF_RANGE = 0.02
"""Floor of the scale with which combinations are compared."""
REACH = (0.1, 0.2)
"""Least and largest distance from a calibrated combination, in half ranges."""
AROUND = 0.4
"""Distance within which calibrated combinations count that lie all round, in half ranges."""
MARGIN = 0.05
"""The same for a regressor, as a share of the range: beyond, the leverage widens the deviation."""
OWN_MARGIN = 0.01
"""The same for the quantity itself and the utilisation: twice a set point's scatter of 0.5 %."""
MIRRORED = (*ODD, "camber")
"""What turns its sign in the mirror image: calibrated on one side, it is on the other as well."""
UPRIGHT = float(np.deg2rad(0.05))
"""Camber beyond its range where no model knows it, [rad]: three times the scatter of set points."""
GAIN_SLACK = 0.3
"""Share by which the tension may leave its range: gains drift, but a wrong unit is caught."""


def with_ranges(
    chain: Chain, values: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]
) -> Chain:
    """Add the calibrated range of every regressor that decides on validity."""

    def limits(name: str, *, needed: bool = True) -> Range:
        x = values[name]
        low, high = float(np.nanmin(x)), float(np.nanmax(x))
        if name in MIRRORED:
            low, high = min(low, -high), max(high, -low)
        slack = GAIN_SLACK * high if name == "tension" else SLACK[name]
        slack = slack if needed else UPRIGHT
        margin = OWN_MARGIN if name == "utilisation" else MARGIN
        return Range(name, low, high, max(slack, margin * (high - low)), needed)

    names = ("contact_angle", "compression", "traction", "tension", *ODD)
    shape = tuple(limits(name) for name in names)
    if np.isfinite(values["camber"]).any():
        shape = (*shape, limits("camber", needed=_uses(chain, "camber")))
    angle = (limits("utilisation"),) if chain.angle is not None else ()

    def carried(*models: Polynomial | None) -> tuple[Range, ...]:
        used = {v.name for model in models if model is not None for v in model.variables}
        return tuple(limits(name) for name in SHAPE if name in used)

    def own(quantity: str, measured: str) -> tuple[Range, ...]:
        if not chain.has(quantity):
            return ()
        x = truth[measured]
        low, high = float(np.nanmin(x)), float(np.nanmax(x))
        slack = max(SLACK.get(quantity, 0.0), OWN_MARGIN * (high - low))
        return (Range(quantity, low, high, slack),)

    driven = bool(np.ptp(values["traction"]) >= LEAST_TRACTION)
    rolling = own("kappa", "slip_ratio") if driven else ()
    # a radius that does not know the load holds for the contact at which it was read
    if chain.radius is not None and "load" not in (v.name for v in chain.radius.variables):
        rolling = (*rolling, limits("contact_angle"))

    guards = {
        "Fz": (*shape, *carried(chain.load), *own("Fz", "Fz")),
        "Fy": (*shape, *carried(chain.force), *own("Fy", "Fy")),
        "alpha": (*shape, *carried(chain.load, chain.force), *angle, *own("alpha", "slip_angle")),
        "kappa": rolling,
    }
    return replace(chain, guards=guards, cloud=_cloud(values))


def _cloud(values: Mapping[str, FloatArray]) -> Cloud | None:
    """Return the combinations of traction and CP1 slope; None where traction was not varied."""
    names = ("traction", "cp1_slope")
    x = np.stack([values[name] for name in names], axis=1)
    if np.ptp(values["traction"]) < LEAST_TRACTION:
        return None
    scale = np.maximum(0.5 * np.ptp(x, axis=0), LEAST_HALF_RANGE)
    points = x / scale
    apart = np.linalg.norm(points[:, None, :] - points, axis=2)
    np.fill_diagonal(apart, np.inf)
    gap = float(np.quantile(apart.min(axis=1), 0.9))
    reach = float(np.clip(1.5 * gap, *REACH))
    return Cloud(names, scale, points, reach, AROUND, mirrored=True)


def _uses(chain: Chain, name: str) -> bool:
    """Tell whether any model of the chain needs a regressor."""
    models = [chain.load, chain.force, chain.angle.polynomial if chain.angle else None]
    return any(name in [v.name for v in model.variables] for model in models if model is not None)
