"""A law guessed for what no effect of the catalogue explains, by sparse regression.

Terms are a shape over the wheel angle times powers of load, pressure and speed. They enter one
after the other, the one that takes away most first; how many stay is decided on levels of the
conditions that took no part in the fit. Such laws are often right in where and how a misfit grows
and wrong in why: they are a guess.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.effects.state import Operating
from tirelib.inference.diagnose.left import Power
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.random_effects import angle_slope
from tirelib.measured.waveforms import GRID

MOST_TERMS = 3
"""Terms of a guessed law at most."""
LEAST_GAIN = 0.03
"""Share of the held-out squares that a further term has to take away."""
WORTH = 0.3
"""Share of the held-out squares from which a law is reported at all."""
REFERENCE = {"load": 4000.0, "pressure": 2.0e5, "speed": 20.0}
POWERS = {"load": (-1.0, 1.0, 2.0), "pressure": (-1.0, 1.0), "speed": (1.0, 2.0)}
STEEPEST = 6.0
"""Largest power that is looked for."""
EDGE = 0.15
"""Width of an edge, in half contact angles."""


@dataclass(frozen=True, slots=True)
class Term:
    """A shape over the angle times powers of conditions.

    Attributes
    ----------
    powers : tuple of (condition, power)
    coefficient, std : float, [-]
        Strain at 4000 N, 2 bar and 20 m/s where the shape is one.
    """

    shape: str
    powers: tuple[tuple[str, float], ...]
    coefficient: float
    std: float


@dataclass(frozen=True, slots=True)
class Guess:
    """Terms of measured less model, and the share of held-out squares that they take away.

    Attributes
    ----------
    powers : mapping of condition to Power
        With which the terms' shapes go, all alike and free, of the conditions that vary.
    """

    terms: tuple[Term, ...]
    explained: float
    powers: Mapping[str, Power]

    @property
    def law(self) -> str:
        """The terms as one formula, in microstrain."""
        return " + ".join(_told(term) for term in self.terms)


def guess_law(
    rest: FloatArray,
    waveform: FloatArray,
    points: Operating,
    edges: FloatArray,
    turned: Callable[[FloatArray], FloatArray],
) -> Guess | None:
    """Return a law for a residual, or None if no sparse one holds on left-out levels.

    `rest` is measured less model and `waveform` the model's, (n_runs, n_phi), [-]; `edges` are
    those of the contact, (n_runs, 2), [rad]; `turned` takes waveforms (..., n_runs, n_phi) to what
    structure and fit leave of them, whitened.
    """
    names, powers, terms = _library(waveform, points, edges)
    columns, response = turned(terms), turned(rest[None])[0]
    size = np.sqrt(np.sum(columns**2, axis=(1, 2)))
    good = np.flatnonzero(size > 1e-6 * size.max())
    columns, folds = columns[good], _folds(points)
    if not folds:
        return None
    chosen: list[int] = []
    best = 0.0
    while len(chosen) < MOST_TERMS:
        further = _next(columns, response, chosen)
        told = _held_out(columns, response, [*chosen, further], folds)
        if told < best + LEAST_GAIN:
            break
        chosen.append(further)
        best = told
    if best < WORTH:
        return None
    matrix = columns[chosen].reshape(len(chosen), -1)
    inverse = np.linalg.inv(matrix @ matrix.T)
    weights = inverse @ (matrix @ response.ravel())
    left = response.ravel() - weights @ matrix
    # neighbouring angles are no independent samples: as many as there are runs times ten
    free = max(10 * len(response) - len(chosen), 1)
    spread = np.sqrt(np.diag(inverse) * float(left @ left) / free)
    found = tuple(
        Term(names[k], powers[k], float(w), float(s))
        for k, w, s in zip(good[chosen], weights, spread, strict=True)
    )
    shapes = {term.shape for term in found}
    plain = [i for i, name in enumerate(names) if name in shapes and not powers[i]]
    return Guess(found, best, _exponents(found, terms[plain], points, response, turned))


def _exponents(
    found: Sequence[Term],
    shapes: FloatArray,
    points: Operating,
    response: FloatArray,
    turned: Callable[[FloatArray], FloatArray],
) -> dict[str, Power]:
    """Return the powers of the conditions with which some shapes go, with 95 % intervals.

    The fit has taken up what is alike in all runs, so the residual itself changes its sign with a
    condition; the shapes times powers go through the same fit before they are held against it.
    """
    names = _varied(points)
    start = np.array([dict(found[0].powers).get(name, 0.0) for name in names])

    def left(power: FloatArray) -> FloatArray:
        factor = _factor(points, list(zip(names, power, strict=True)))
        columns = turned(shapes * factor[:, None]).reshape(len(shapes), -1)
        weights = np.linalg.lstsq(columns.T, response.ravel(), rcond=None)[0]
        rest: FloatArray = response.ravel() - weights @ columns
        return rest

    fit = optimize.least_squares(left, start, bounds=(-STEEPEST, STEEPEST), max_nfev=15)
    free = max(10 * len(response) - len(shapes) - len(names), 1)
    jacobian = np.asarray(fit.jac, dtype=np.float64)
    spread = np.linalg.pinv(jacobian.T @ jacobian) * 2.0 * float(fit.cost) / free
    half = 1.96 * np.sqrt(np.maximum(np.diag(spread), 0.0))
    return {
        name: Power(float(p), float(p - h), float(p + h))
        for name, p, h in zip(names, fit.x, half, strict=True)
    }


def _library(
    waveform: FloatArray, points: Operating, edges: FloatArray
) -> tuple[list[str], list[tuple[tuple[str, float], ...]], FloatArray]:
    """Return names, powers and waveforms of all terms."""
    half = 0.5 * (edges[:, 1:] - edges[:, :1])
    x = (GRID[None] - edges.mean(axis=1, keepdims=True)) / half
    one = np.ones((len(waveform), 1))
    turns = {"cos": np.cos, "sin": np.sin}
    shapes = {
        **{f"{k}({n} phi)": f(n * GRID)[None] * one for n in (1, 2) for k, f in turns.items()},
        "in the contact": 0.5 * (np.tanh((x + 1.0) / EDGE) - np.tanh((x - 1.0) / EDGE)),
        "at the entry": np.exp(-(((x + 1.0) / (2.0 * EDGE)) ** 2)),
        "at the exit": np.exp(-(((x - 1.0) / (2.0 * EDGE)) ** 2)),
        "before the contact": np.exp(-(((x + 2.0) / 0.7) ** 2)),
        "behind the contact": np.exp(-(((x - 2.0) / 0.7) ** 2)),
        "strain/1000 ustrain": waveform / 1e-3,
        "(strain/1000 ustrain)^2": (waveform / 1e-3) ** 2,
        "(strain/1000 ustrain)^3": (waveform / 1e-3) ** 3,
        "slope of strain/1000 ustrain": angle_slope(waveform) / 1e-3,
    }
    factors: list[tuple[tuple[str, float], ...]] = [()]
    varied = _varied(points)
    factors += [((name, power),) for name in varied for power in POWERS[name]]
    factors += [
        ((a, p), (b, q))
        for i, a in enumerate(varied)
        for b in varied[i + 1 :]
        for p in POWERS[a]
        for q in POWERS[b]
    ]
    rows = [
        (shape - shape.mean(axis=1, keepdims=True)) * _factor(points, factor)[:, None]
        for shape in shapes.values()
        for factor in factors
    ]
    return [name for name in shapes for _ in factors], factors * len(shapes), np.array(rows)


def _varied(points: Operating) -> list[str]:
    values = {name: getattr(points, name) for name in POWERS}
    known = {n: v for n, v in values.items() if np.isfinite(v).all() and (v > 0).all()}
    return [name for name, value in known.items() if levels(value).max() > 0]


def _factor(points: Operating, powers: Sequence[tuple[str, float]]) -> FloatArray:
    out = np.ones(len(points))
    for name, power in powers:
        out = out * (getattr(points, name) / REFERENCE[name]) ** power
    return out


def _folds(points: Operating) -> list[BoolArray]:
    """Return the runs of each level of each condition, left out one level at a time."""
    out = []
    for name in _varied(points):
        level: IntArray = levels(getattr(points, name))
        out += [level == k for k in range(int(level.max()) + 1)]
    return [fold for fold in out if 0 < fold.sum() < len(points)]


def _next(columns: FloatArray, response: FloatArray, chosen: Sequence[int]) -> int:
    """Return the term that takes away most of what the chosen ones leave."""
    flat = columns.reshape(len(columns), -1)
    rest, own = response.ravel(), flat
    if chosen:
        basis = np.linalg.qr(flat[list(chosen)].T)[0]
        rest = rest - basis @ (basis.T @ rest)
        own = flat - (flat @ basis) @ basis.T
    size = np.sum(own**2, axis=1)
    gain = (own @ rest) ** 2 / np.maximum(size, 1e-9 * size.max())
    gain[list(chosen)] = -1.0
    return int(np.argmax(gain))


def _held_out(
    columns: FloatArray, response: FloatArray, chosen: Sequence[int], folds: Sequence[BoolArray]
) -> float:
    """Return the share of left-out squares that terms take away, fitted without those runs."""
    left, whole = 0.0, 0.0
    for out in folds:
        train = columns[list(chosen)][:, ~out].reshape(len(chosen), -1)
        weights = np.linalg.lstsq(train.T, response[~out].ravel(), rcond=None)[0]
        rest = response[out] - np.tensordot(weights, columns[list(chosen)][:, out], axes=1)
        left += float(np.sum(rest**2))
        whole += float(np.sum(response[out] ** 2))
    return 1.0 - left / whole if whole > 0.0 else 0.0


def _told(term: Term) -> str:
    units = {"load": "4000 N", "pressure": "2 bar", "speed": "20 m/s"}
    text = f"{1e6 * term.coefficient:.3g} ustrain * [{term.shape}]"
    for name, power in term.powers:
        text += f" * ({name}/{units[name]})^{power:g}"
    return text
