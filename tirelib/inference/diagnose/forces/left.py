"""What no effect explains: where over slip it stands, what it grows with, a guess at its law."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.effects.brush_state import BrushConditions
from tirelib.inference.diagnose.forces.fit import ForceFit, MeasuredForce
from tirelib.inference.diagnose.left import FLAT, Power, powers_of
from tirelib.inference.problems.force_plan import varies
from tirelib.inference.problems.forces import slip_of

BANDS = (
    (0.0, 1.0, "where most of the contact sticks"),
    (1.0, 3.0, "where sticking gives way"),
    (3.0, np.inf, "where all of the contact slides"),
)
"""Bands of C slip / (mu Fz): 3 is the slip from which all slides."""
GUESS_GAIN = 0.1
"""Share of the left squares that a guessed law has to take away on held-out points."""
_POWERS = ("load", "pressure", "speed")


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


def left_of(problem: MeasuredForce, model: ForceFit) -> ForceLeft:
    """Return what a fitted model leaves of the force that it was fitted to."""
    residual = model.predicted - problem.measured
    # without the effects
    x = np.abs(slip_of(problem.bench.state(model.values), problem.quantity))
    squares = residual**2
    total = max(float(squares.sum()), 1e-30)
    shares = {
        name: float(squares[(x >= low) & (x < high)].sum()) / total for low, high, name in BANDS
    }
    first = max(shares, key=lambda name: shares[name])
    powers = _powers(problem.bench.conditions, np.abs(residual))
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
        _guess(problem, model, residual),
    )


def _powers(at: BrushConditions, size: FloatArray) -> dict[str, Power]:
    names = [name for name in _POWERS if varies(at, name) and (getattr(at, name) > 0.0).all()]
    return powers_of({name: getattr(at, name) for name in names}, size)


def _guess(problem: MeasuredForce, model: ForceFit, residual: FloatArray) -> str | None:
    """Return the product of a slip term and a condition that explains most on other points."""
    if len(problem) < 40:
        return None
    at, x = problem.bench.conditions, slip_of(problem.bench.state(model.values), problem.quantity)
    soft = x / (1.0 + np.abs(x))
    slips = {
        "slip / (1 + |slip|)": soft,
        "slip |slip| / (1 + slip^2)": x * np.abs(x) / (1 + x**2),
        "slip exp(-|slip|)": x * np.exp(-np.abs(x)),
        "1": np.ones_like(x),
    }
    factors = {"1": np.ones_like(x), "order": at.order - 0.5}
    for name in ("load", "pressure", "speed"):
        if varies(at, name):
            factors[f"ln {name}"] = np.log(np.abs(getattr(at, name)))
    for name in ("temperature", "camber"):
        if varies(at, name):
            factors[name] = getattr(at, name) - float(np.mean(getattr(at, name)))
    load = at.load
    seen: BoolArray = np.asarray(problem.block % 2 == 0)
    if seen.all() or not seen.any():
        seen = np.arange(len(problem)) % 2 == 0
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
