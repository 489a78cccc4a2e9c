"""Features as a table: one row per turn and gage."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tirelib.core.flags import flag_names
from tirelib.measured.features.extract import Features

if TYPE_CHECKING:
    import pandas as pd

PER_GAGE = {
    "lead": "rad",
    "trail": "rad",
    "contact_angle": "rad",
    "cp1": "1",
    "cp2": "1",
    "tp": "1",
    "cp1_angle": "rad",
    "cp2_angle": "rad",
    "tp_angle": "rad",
    "rate_lead": "1/rad",
    "rate_trail": "1/rad",
    "e_vertical": "rad",
    "e_friction": "rad2",
    "skew": "rad",
    "mean": "1",
    "offset": "1",
    "offset_std": "1",
}
"""Columns of one turn and gage with their units."""
PER_TURN = {
    "time": "s",
    "period": "s",
    "omega": "rad/s",
    "speed": "m/s",
    "pressure": "Pa",
    "camber": "rad",
    "friction": "1",
    "tread_depth": "m",
    "tread_temperature": "K",
    "axis_shift": "rad",
    "angle_std": "1",
    "slip_std": "1",
}
"""Columns of one turn with their units."""


def feature_frame(features: Features, **extra: npt.ArrayLike) -> "pd.DataFrame":
    """Return one row per turn and gage, SI units, ISO axes.

    Parameters
    ----------
    features : Features
    **extra
        Further columns, constant or of shape (n,), for example ``run=3``.
    """
    import pandas as pd  # slow to import

    n, gages = len(features), features.lateral.size
    columns: dict[str, npt.ArrayLike | list[str]] = {
        name: np.repeat(value, gages) if np.ndim(value) else value for name, value in extra.items()
    }
    columns["axes"] = ["iso"] * (n * gages)
    columns["turn"] = np.repeat(np.arange(n), gages)
    columns["gage"] = np.tile(np.arange(1, gages + 1), n)
    columns["lateral"] = np.tile(features.lateral, n)
    for name in PER_TURN:
        columns[name] = np.repeat(getattr(features, name), gages)
    for name in PER_GAGE:
        columns[name] = getattr(features, name).ravel()
    columns["slope_rate_lead"] = np.repeat(rate_slope(features), gages)
    columns["flags"] = np.repeat([";".join(flag_names(f)) for f in features.flags.tolist()], gages)
    columns["gage_flags"] = [";".join(flag_names(f)) for f in features.gage_flags.ravel().tolist()]
    return pd.DataFrame(columns)


def rate_slope(features: Features) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Slope of the peak strain rate over lateral position (Fig. 4-6), [1/(rad m)].

    Least-squares line through the three middle gages, as in section 4.1.3. Shape (n,).
    """
    middle = np.sort(np.argsort(np.abs(features.lateral), kind="stable")[:3])
    y = features.lateral[middle] - features.lateral[middle].mean()
    return np.asarray(features.rate_lead[:, middle] @ y / (y @ y), dtype=np.float64)


def units() -> Mapping[str, str]:
    """Return the unit of every numeric column of `feature_frame`."""
    return {**PER_TURN, **PER_GAGE, "lateral": "m", "slope_rate_lead": "1/(rad m)"}
