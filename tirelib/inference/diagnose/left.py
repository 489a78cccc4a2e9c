"""Where on the turn a residual stands, and what it grows with."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating
from tirelib.inference.compare.error import ModelError
from tirelib.inference.compare.sectors import SECTORS, sectors_of
from tirelib.inference.compare.sentences import PLACES
from tirelib.inference.identify.error_bands import levels
from tirelib.measured.waveforms import GRID

FLAT = 0.2
"""Power of a condition below which the residual is said not to change with it."""
LEAST_MISFIT_SHARE, LEAST_MISFIT = 1e-3, 1e-12
"""Size below which a misfit counts as this large: over the largest, and at all."""
SHARE_IN_RANGE = 0.7
"""Share of the squares that the told range of angles holds."""
CONDITIONS = ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")


@dataclass(frozen=True, slots=True)
class Power:
    """Power of a condition in a residual's rms, with a 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def half(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Left:
    """What a fitted model leaves.

    Attributes
    ----------
    white : shape (n_runs, n_phi)
        Model less measured in the unit of errors: whitened, or microstrain.
    where, scaling : str
        In words.
    span : tuple of float, [rad]
        Shortest range of angles with `SHARE_IN_RANGE` of the squares; the second end may lie past
        pi.
    sectors : mapping of sector to float
        Share of the squares.
    powers : mapping of condition to Power or None
        None where the plan does not vary it.
    edges : shape (n_runs, 2), [rad]
        Edges of the contact.
    """

    white: FloatArray
    where: str
    scaling: str
    span: tuple[float, float]
    sectors: Mapping[str, float]
    powers: Mapping[str, Power | None]
    edges: FloatArray


def left_of(error: ModelError, points: Operating, beyond: FloatArray | None = None) -> Left:
    """Return what a fitted model leaves of the waveforms that it was fitted to.

    Parameters
    ----------
    error : ModelError
    points : Operating
    beyond : shape (n_runs, n_phi), optional
        The part of the whitened residual that structure does not explain: place and scaling are
        those of it; of the whole residual if it is not given.
    """
    white = -error.white_of(error.rest)
    told, edges = white if beyond is None else beyond, error.prediction.edges
    sector = sectors_of(edges)
    squares = told**2
    total = max(float(squares.sum()), 1e-300)
    shares = {name: float(squares[sector == k].sum() / total) for k, name in enumerate(SECTORS)}
    first = max(shares, key=lambda name: shares[name])
    start, stop = _span(squares.mean(axis=0))
    powers = _powers(points, np.sqrt(squares.mean(axis=1)))
    return Left(
        white,
        f"{PLACES[first]} ({100 * shares[first]:.0f} % of the squares), most of it "
        f"{told_range(start, stop)}",
        told_powers(powers),
        (start, stop),
        shares,
        powers,
        edges,
    )


def told_range(start: float, stop: float) -> str:
    """Say a range of the wheel angle [rad] in -180 to 180 deg, as plots have it."""
    low, high = np.rad2deg(start), np.rad2deg(stop)
    return f"from {low:.0f} " + (
        f"to {high:.0f} deg" if high <= 180.0 else f"through 180 to {high - 360.0:.0f} deg"
    )


def told_powers(powers: Mapping[str, Power | None]) -> str:
    """Say powers whose interval leaves no doubt of the sign."""
    moves = [
        f"{'grows' if power.value > 0 else 'falls'} with {name.replace('_', ' ')} "
        f"(power {power.value:+.1f}, {power.low:+.1f} to {power.high:+.1f})"
        for name, power in powers.items()
        if power is not None and abs(power.value) >= FLAT and power.low * power.high > 0.0
    ]
    return " and ".join(moves) or "is the same in all runs"


def _span(squares: FloatArray) -> tuple[float, float]:
    """Return the shortest range of the turn that holds `SHARE_IN_RANGE` of some squares."""
    n = squares.size
    running = np.concatenate([[0.0], np.cumsum(np.tile(squares, 2))])
    need = SHARE_IN_RANGE * running[n]
    stop = np.searchsorted(running, running[:n] + need, side="left")
    first = int(np.argmin(stop - np.arange(n)))
    step = float(GRID[1] - GRID[0])
    return float(GRID[first]), float(GRID[first] + step * (stop[first] - first))


def _powers(points: Operating, rms: FloatArray) -> dict[str, Power | None]:
    """Return the powers of the conditions that tell the runs' rms, with intervals."""
    values = {name: np.asarray(getattr(points, name)) for name in CONDITIONS}
    varied = {name: np.abs(each) for name, each in values.items() if _varies(each)}
    return dict.fromkeys(CONDITIONS) | powers_of(varied, rms)


def powers_of(conditions: Mapping[str, FloatArray], size: FloatArray) -> dict[str, Power]:
    """Return the powers with which a misfit's size goes; none without enough numbers.

    Parameters
    ----------
    conditions : mapping of name to shape (n,)
        Positive.
    size : shape (n,)
        Not negative.
    """
    free = size.size - len(conditions) - 1
    if free < 1 or not conditions:
        return {}
    columns = [np.log(each) for each in conditions.values()]
    matrix = np.stack([np.ones(size.size), *columns], axis=1)
    response = np.log(np.maximum(size, max(LEAST_MISFIT_SHARE * float(size.max()), LEAST_MISFIT)))
    found = np.linalg.lstsq(matrix, response, rcond=None)[0]
    left = response - matrix @ found
    spread = np.linalg.pinv(matrix.T @ matrix) * float(left @ left) / free
    half = stats.t.ppf(0.975, free) * np.sqrt(np.maximum(np.diag(spread), 0.0))
    return {
        name: Power(float(p), float(p - h), float(p + h))
        for name, p, h in zip(conditions, found[1:], half[1:], strict=True)
    }


def _varies(values: FloatArray) -> bool:
    """Whether a condition has levels of one sign from which a power can be estimated."""
    if not np.isfinite(values).all() or (np.abs(values) < 1e-3).any():
        return False
    return bool(levels(np.abs(values)).max() > 0)
