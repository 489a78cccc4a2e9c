"""How much of the error the model's structure is known to leave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg

from tirelib.arrays import FloatArray
from tirelib.compare.model import Model, Prediction
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.random_effects import Whitening
from tirelib.model.state import Operating
from tirelib.waveforms import GRID

LEAST_ERROR = 1.1
"""Error from which there is a misfit to be shared out."""


@dataclass(frozen=True, slots=True)
class Floor:
    """Structural floor as far as known.

    Attributes
    ----------
    value : float
        Error that the last identification left, in noise units; NaN where the model does not say.
        A model identified from these very data leaves what it leaves now, in proportion to `rms`.
    source : str
        history, identification, or empty.
    rms : float, [-]
        Rms strain that it left; NaN where unknown.
    smooth : float
        Error that stays when a smooth misfit of angle, load and pressure is taken out: no change
        of the model that acts smoothly can go below. NaN without noise.
    share : float
        Part of the excess error^2 - 1 that the smooth misfit explains; NaN for an error near 1.
    """

    value: float
    source: str
    rms: float
    smooth: float
    share: float


def floor_of(
    model: Model,
    data_hash: str,
    rest: FloatArray,
    prediction: Prediction,
    points: Operating,
    whiten: Whitening | None,
    raw: float,
) -> Floor:
    """Return what is known of the floor.

    Parameters
    ----------
    model : Model
    data_hash : str
        Of the campaign: an identification on other data is no floor here.
    rest : shape (n_runs, n_phi), [-]
        Measured less model of the counted runs.
    prediction, points
        Of the same runs.
    whiten : Whitening or None
        None without noise.
    raw : float, [-]
        Rms difference with the delay left in, as an identification leaves it.
    """
    value, source, rms = _from_file(model, data_hash)
    smooth, share = float("nan"), float("nan")
    if whiten is not None:
        before, smooth = _without_smooth(rest, prediction, points, whiten)
        if before > LEAST_ERROR:
            share = (before**2 - smooth**2) / (before**2 - 1.0)
        if np.isfinite(rms) and not np.isfinite(value):
            value = before * rms / raw
    return Floor(value, source, rms, smooth, share)


def _from_file(model: Model, data_hash: str) -> tuple[float, str, float]:
    """Return error, where it is from, and rms strain as the model's file has them."""
    rms = _number(model.provenance, "rms_microstrain") * 1e-6
    if any(entry.get("quantity", "strain") == "strain" for entry in model.history):
        value = last_error(model.history, "strain")
        return value, "history" if np.isfinite(value) else "", float("nan")
    if np.isfinite(rms) and model.provenance.get("data_sha256") == data_hash:
        return float("nan"), "identification", rms
    return float("nan"), "", float("nan")


def last_error(history: Sequence[Mapping[str, Any]], quantity: str) -> float:
    """Return the error in noise units after the last change for a quantity; NaN where unknown."""
    told = [entry for entry in history if entry.get("quantity", "strain") == quantity]
    return _number(told[-1], "error_after") if told else float("nan")


def _number(table: Mapping[str, Any], key: str) -> float:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) else float("nan")


def _without_smooth(
    rest: FloatArray, prediction: Prediction, points: Operating, whiten: Whitening
) -> tuple[float, float]:
    """Return the error as it is and with a smooth misfit taken out."""
    half = 0.5 * (prediction.edges[:, 1] - prediction.edges[:, 0])
    shapes = Discrepancy().columns(prediction.strain, half, points, GRID)
    rows = whiten(shapes).reshape(len(shapes), -1)
    white = whiten(rest).ravel()
    normal = rows @ rows.T + np.eye(len(rows))
    weights = linalg.cho_solve(linalg.cho_factor(normal), rows @ white)
    left = white - weights @ rows
    return float(np.sqrt(np.mean(white**2))), float(np.sqrt(np.mean(left**2)))
