"""What a single turn scatters about the mean of its run: the floor of every uncertainty."""

from dataclasses import replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.estimators.chain import Chain
from tirelib.estimators.polynomial import Polynomial


def with_floor(
    chain: Chain, regressors: dict[str, FloatArray], unit: IntArray, rows: BoolArray
) -> Chain:
    """Return the chain with what a single turn scatters about the mean of its run.

    Parameters
    ----------
    chain : Chain
    regressors : mapping of arrays, shape (n_turns,)
    unit : shape (n_turns,)
        Number of the run of each turn.
    rows : shape (n_turns,)
        Turns that count.
    """
    estimates, radius = chain.predict(regressors)

    def scatter(value: FloatArray) -> float:
        good = rows & np.isfinite(value)
        if not good.any():
            return 0.0
        count = np.bincount(unit[good])
        mean = np.bincount(unit[good], weights=value[good]) / np.maximum(count, 1)
        freedom = good.sum() - (count > 0).sum()
        rest = value[good] - mean[unit[good]]
        return float(np.sqrt((rest**2).sum() / freedom)) if freedom > 0 else 0.0

    def floored(model: Polynomial | None, value: FloatArray) -> Polynomial | None:
        return None if model is None else replace(model, floor=scatter(value))

    none = np.full(radius.shape, np.nan)
    angle = chain.angle
    if angle is not None:
        load = estimates["Fz"].value if "Fz" in estimates else chain.mean_load
        angle = replace(
            angle, blur=float(np.hypot(angle.blur, scatter(estimates["Fy"].value / load)))
        )
    turning = radius
    if "kappa" in estimates:
        with np.errstate(invalid="ignore", divide="ignore"):
            turning = estimates["kappa"].value * regressors["speed"] / regressors["omega"]
    return replace(
        chain,
        load=floored(chain.load, estimates["Fz"].value if "Fz" in estimates else none),
        radius=floored(chain.radius, turning),
        force=floored(chain.force, estimates["Fy"].value if "Fy" in estimates else none),
        angle=angle,
    )
