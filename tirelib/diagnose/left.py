"""Where on the turn a residual stands, and what it grows with."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.sectors import SECTORS, sectors_of
from tirelib.diagnose.refit import Refit
from tirelib.identify.error_bands import levels
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import predict

FLAT = 0.2
"""Power of a condition below which the residual is said not to change with it."""
_PLACES = {
    "contact": "in the contact",
    "entry edge": "at the entry of the contact",
    "exit edge": "at the exit of the contact",
    "entry flank": "before the contact",
    "exit flank": "behind the contact",
    "far side": "away from the contact",
}


@dataclass(frozen=True, slots=True)
class Left:
    """What a fitted model leaves.

    Attributes
    ----------
    white : shape (n_runs, n_phi)
        Whitened residual, model less measured.
    where, scaling : str
        In words.
    sectors : mapping of sector to float
        Share of the squares.
    powers : mapping of condition to float
        Powers of the conditions that vary with which a run's rms goes.
    """

    white: FloatArray
    where: str
    scaling: str
    sectors: Mapping[str, float]
    powers: Mapping[str, float]


def left_of(data: Data, model: Refit) -> Left:
    """Return what a fitted model leaves of the waveforms that it was fitted to."""
    white = model.whiten(model.waveform - data.strain)
    state = predict(
        model.values, data.points, model.changes, low_pass=data.low_pass,
        correction=model.correction,
    )  # fmt: skip
    assert state.contact is not None  # noqa: S101 - the chain sets it
    sector = sectors_of(state.contact.edges)
    squares = white**2
    shares = {
        name: float(squares[sector == k].sum() / squares.sum()) for k, name in enumerate(SECTORS)
    }
    first = max(shares, key=lambda name: shares[name])
    powers = _powers(data, np.sqrt(squares.mean(axis=1)))
    moves = [
        f"{'grows' if power > 0 else 'falls'} with {name} (power {power:+.1f})"
        for name, power in powers.items()
        if abs(power) >= FLAT
    ]
    return Left(
        white,
        f"{_PLACES[first]} ({100 * shares[first]:.0f} % of the squares)",
        " and ".join(moves) or "is alike in all runs",
        shares,
        powers,
    )


def _powers(data: Data, rms: FloatArray) -> dict[str, float]:
    """Return the powers of load, pressure and speed that tell the runs' rms."""
    names = [
        name
        for name in ("load", "pressure", "speed")
        if np.isfinite(getattr(data.points, name)).all()
        and (getattr(data.points, name) > 0.0).all()
        and levels(getattr(data.points, name)).max() > 0
    ]
    columns = [np.log(getattr(data.points, name)) for name in names]
    if len(rms) <= len(columns) + 1:
        return {}
    matrix = np.stack([np.ones(len(rms)), *columns], axis=1)
    found = np.linalg.lstsq(matrix, np.log(np.maximum(rms, 1e-12)), rcond=None)[0]
    return {name: float(found[k + 1]) for k, name in enumerate(names)}
