"""How much of the error the model's structure is known to leave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating
from tirelib.inference.compare.error import ModelError
from tirelib.inference.compare.model import Prediction, TireModel
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.random_effects import Whitening
from tirelib.measured.waveforms import GRID

LEAST_ERROR = 1.1
"""Error from which there is a misfit to be shared out."""


@dataclass(frozen=True, slots=True)
class Floor:
    """Structural floor as far as known, in units of the noise.

    Attributes
    ----------
    value : float
        Part of the error that noise and the tire's structure explained when the model was last
        changed on these data (`tirelib.inference.diagnose.floor`); NaN where its history does not
        say.
    smooth : float
        Error that stays when a smooth misfit of angle, load and pressure is taken out: no change
        of the model that acts smoothly can go below. NaN without noise.
    share : float
        Part of the excess error^2 - 1 that the smooth misfit explains; NaN for an error near 1.
    """

    value: float
    smooth: float
    share: float


def floor_of(model: TireModel, data_hash: str, error: ModelError, points: Operating) -> Floor:
    """Return what is known of the floor.

    Parameters
    ----------
    data_hash : str
        Hash of the campaign: a floor on other data is none here.
    error : ModelError
        Error on the counted runs.
    points : Operating
        The same runs.
    """
    smooth, share = float("nan"), float("nan")
    if error.whiten is not None:
        smooth = _without_smooth(error.rest, error.prediction, points, error.whiten)
        if error.value > LEAST_ERROR:
            share = (error.value**2 - smooth**2) / (error.value**2 - 1.0)
    return Floor(last_floor(model.history, "strain", data_hash), smooth, share)


def last_floor(history: Sequence[Mapping[str, Any]], quantity: str, data_hash: str) -> float:
    """Return the floor in noise units by the last change for a quantity.

    NaN where the history does not say it, or says it of other data.
    """
    told = [entry for entry in history if entry.get("quantity", "strain") == quantity]
    if not told or told[-1].get("data_sha256") != data_hash:
        return float("nan")
    value = told[-1].get("floor")
    return float(value) if isinstance(value, int | float) else float("nan")


def _without_smooth(
    rest: FloatArray, prediction: Prediction, points: Operating, whiten: Whitening
) -> float:
    """Return the error with a smooth misfit taken out."""
    half = 0.5 * (prediction.edges[:, 1] - prediction.edges[:, 0])
    shapes = Discrepancy().columns(prediction.strain, half, points, GRID)
    rows = whiten(shapes).reshape(len(shapes), -1)
    white = whiten(rest).ravel()
    normal = rows @ rows.T + np.eye(len(rows))
    weights = linalg.cho_solve(linalg.cho_factor(normal), rows @ white)
    left = white - weights @ rows
    return float(np.sqrt(np.mean(left**2)))
