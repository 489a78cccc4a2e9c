"""What a model leaves: where on the turn or over slip it stands, and what it grows with."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.effects.brush_state import BrushConditions
from tirelib.effects.state import Operating
from tirelib.inference.compare.error import ModelError
from tirelib.inference.compare.sectors import SECTORS, sectors_of
from tirelib.inference.compare.sentences import PLACES
from tirelib.inference.diagnose.forces.models import ForceFit
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.force_bench import ForceBench
from tirelib.inference.problems.force_plan import varies
from tirelib.inference.problems.forces import slip_of
from tirelib.measured.waveforms import GRID

FLAT = 0.2
"""Power of a condition below which the residual is said not to change with it."""
LEAST_MISFIT_SHARE, LEAST_MISFIT = 1e-3, 1e-12
"""Size below which a misfit counts as this large: over the largest, and at all."""
SHARE_IN_RANGE = 0.7
"""Share of the squares that the stated range of angles holds."""
CONDITIONS = ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")
BANDS = (
    (0.0, 1.0, "where most of the contact sticks"),
    (1.0, 3.0, "where sticking gives way"),
    (3.0, np.inf, "where all of the contact slides"),
)
"""Bands of C slip / (mu Fz): 3 is the slip from which all slides."""
GUESS_GAIN = 0.1
"""Share of the left squares that a guessed law has to take away on held-out points."""
_POWERS = ("load", "pressure", "speed")


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

    `beyond` (n_runs, n_phi) is the part of the whitened residual that structure does not explain:
    place and scaling are those of it; of the whole residual if it is not given.
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
    """Return the powers with which a misfit's size (n,) goes; none without enough numbers.

    Conditions are positive, of shape (n,) as well.
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


@dataclass(frozen=True, slots=True, eq=False)
class ForceLeft:
    """What a fitted model leaves.

    Attributes
    ----------
    residual : shape (n,), [N] or [N m]
        Model less measured.
    where, scaling : str
        In words.
    bands : mapping of band to float
        Share of the squares.
    powers : mapping of condition to Power
        With which the residual's size goes.
    guess : str or None
        A law that would take a part of it away, found by regression.
    """

    residual: FloatArray
    where: str
    scaling: str
    bands: Mapping[str, float]
    powers: Mapping[str, Power]
    guess: str | None


def force_left(model: ForceFit) -> ForceLeft:
    """Return what a fitted model leaves of the force that it was fitted to."""
    bench, residual = model.problem.bench, -model.rest
    # without the effects
    slip = slip_of(bench.state(model.values), model.problem.quantity)
    x = np.abs(slip)
    squares = residual**2
    total = max(float(squares.sum()), 1e-30)
    shares = {
        name: float(squares[(x >= low) & (x < high)].sum()) / total for low, high, name in BANDS
    }
    first = max(shares, key=lambda name: shares[name])
    powers = _force_powers(bench.conditions, np.abs(residual))
    moves = [
        f"{'grows' if power.value > 0 else 'falls'} with {name} "
        f"(power {power.value:+.1f} ± {power.half:.1f})"
        for name, power in powers.items()
        if abs(power.value) >= max(FLAT, power.half)
    ]
    return ForceLeft(
        residual,
        f"{first} ({100 * shares[first]:.0f} % of the squares)",
        " and ".join(moves) or "has the same size at all loads, pressures and speeds",
        shares,
        powers,
        _guess(bench, slip, residual),
    )


def _force_powers(at: BrushConditions, size: FloatArray) -> dict[str, Power]:
    names = [name for name in _POWERS if varies(at, name) and (getattr(at, name) > 0.0).all()]
    return powers_of({name: getattr(at, name) for name in names}, size)


def _guess(bench: ForceBench, x: FloatArray, residual: FloatArray) -> str | None:
    """Return the product of a slip term and a condition that explains most on other points."""
    if x.size < 40:
        return None
    at = bench.conditions
    soft = x / (1.0 + np.abs(x))
    slips = {
        "slip / (1 + |slip|)": soft,
        "slip |slip| / (1 + slip^2)": x * np.abs(x) / (1 + x**2),
        "slip exp(-|slip|)": x * np.exp(-np.abs(x)),
        "1": np.ones_like(x),
    }
    factors = {"1": np.ones_like(x), "order": at.order - 0.5}
    for name in _POWERS:
        if varies(at, name):
            factors[f"ln {name}"] = np.log(np.abs(getattr(at, name)))
    for name in ("temperature", "camber"):
        if varies(at, name):
            factors[name] = getattr(at, name) - float(np.mean(getattr(at, name)))
    load = at.load
    seen: BoolArray = np.asarray(bench.points.data.block % 2 == 0)
    if seen.all() or not seen.any():
        seen = np.arange(x.size) % 2 == 0
    best, name = GUESS_GAIN, ""
    for slip_name, slip in slips.items():
        for factor_name, factor in factors.items():
            column = load * slip * (factor - float(np.mean(factor)) * (factor_name[:2] == "ln"))
            gain = _gain(column, residual, seen)
            if gain > best:
                terms = [term for term in (slip_name, factor_name) if term != "1"]
                best, name = gain, f"Fz times {' times '.join(terms) or 'a constant'}"
    return f"{name}; takes away {100 * best:.0f} % of the squares" if name else None


def _gain(column: FloatArray, residual: FloatArray, seen: BoolArray) -> float:
    """Return the share of squares that a column takes away where it was not fitted."""
    if not np.any(column[seen]):
        return 0.0
    weight = float(column[seen] @ residual[seen]) / float(column[seen] @ column[seen])
    rest = residual[~seen] - weight * column[~seen]
    return 1.0 - float(rest @ rest) / max(float(residual[~seen] @ residual[~seen]), 1e-30)
