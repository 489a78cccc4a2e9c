"""Gauss-Newton for the model of a problem, with effects or without.

The cost is that of one Gaussian: the residual in the covariance of noise, set points and of what
plain tires show beside their model, and the priors of the base and of the strengths.

    J = r' C^-1 r + sum (z_k / width_k)^2 + sum (s_j / range_j)^2
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.errors import ConvergenceError, TirelibError
from tirelib.infer.normal import Normal, Weighed
from tirelib.infer.plain import BASE, ROUGHLY, View
from tirelib.infer.problem import Point, Problem

MOST_STEPS = 30
SETTLED = 0.1
"""Step, in posterior standard deviations, below which a fit has settled."""
GAINS = 0.1
"""Fall of the cost, in units of a chi-square, below which a step is the last."""
LONGEST = 0.5
"""Longest move of a coordinate in one step."""
HARDEST = 1e4
"""Damping at which there is no way down."""

Spread = Mapping[str, float]
"""Variances of what plain tires show, by block."""


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """A fitted model, and everything that may explain what it leaves.

    Attributes
    ----------
    point : Point
    solved : object
        The problem's own solution.
    rows : mapping of name to shape (k, ...)
        "base" (strengths behind it), effects by name, the groups of the remainder, and "roughly
        NAME" for each effect of the model.
    widths : shape (n_coordinates,)
        Prior standard deviations of the block "base".
    covariance : shape (n_coordinates, n_coordinates)
        Of the coordinates.
    cost : float
        J at the point.
    """

    point: Point
    solved: Any
    rows: Mapping[str, FloatArray]
    widths: FloatArray
    covariance: FloatArray
    cost: float

    @property
    def names(self) -> tuple[str, ...]:
        """Of the model's effects."""
        return tuple(effect.name for effect in self.point.effects)

    @property
    def coordinates(self) -> FloatArray:
        """Coordinates of the base, and strengths in ranges, (n_coordinates,)."""
        return _coordinates(self.point)

    def view(self, problem: Problem, own: float) -> View:
        """Return the normal equations for one size of the misfit that each run has for itself."""
        whiten = problem.whitener(own)
        white, first = {}, 0
        every = whiten(np.concatenate(list(self.rows.values())))
        for name, rows in self.rows.items():
            white[name] = every[first : first + len(rows)]
            first += len(rows)
        normal = Normal.of(white, whiten(self.solved.rest))
        return View(own, normal, whiten.log_volume, every)

    def std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        effects = self.point.effects
        first = len(self.point.base) + sum(e.components for e in effects[:index])
        rows = slice(first, first + effects[index].components)
        return np.asarray(effects[index].scale * np.sqrt(np.diag(self.covariance)[rows]))


def posterior(
    problem: Problem,
    effects: Sequence[Effect],
    spread: Spread,
    own: float,
    *,
    near: Posterior | None = None,
    strengths: Sequence[FloatArray] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Posterior:
    """Fit the model with effects.

    Parameters
    ----------
    problem : Problem
    effects : sequence of Effect
    spread : mapping
        Variances of what plain tires show.
    own : float
        Size of each run's own misfit (`Problem.whitener`).
    near : Posterior, optional
        A fit nearby.
    strengths : sequence of shape (components,), optional
        From where the strengths start.
    progress : callable, optional

    Raises
    ------
    ConvergenceError
        If the steps do not settle.
    """
    base = problem.start.base if near is None else near.point.base
    begin = tuple(np.zeros(e.components) for e in effects) if strengths is None else strengths
    point = Point(base, tuple(effects), tuple(np.array(s, dtype=float) for s in begin))
    whiten = problem.whitener(own)
    widths = np.concatenate([problem.widths, np.ones(sum(e.components for e in effects))])
    solved = problem.solve(point, near.solved if near else None)
    slopes = problem.slopes(point, solved)
    has = {effect.name for effect in effects}
    if near is None:
        others = {**problem.signatures(point, solved), **problem.remainder(point, solved)}
    else:  # a metric nearby serves until the fit has settled
        others = {
            name: rows
            for name, rows in near.rows.items()
            if name != BASE and name not in has and not name.startswith(ROUGHLY)
        }
    white = whiten(np.concatenate(list(others.values())))
    ends = np.cumsum([len(rows) for rows in others.values()])[:-1]
    whitened = dict(zip(others, np.split(white, ends), strict=True))
    rest = whiten(solved.rest)
    damping, moved = 1e-3, np.inf
    for _ in range(MOST_STEPS):
        white_slopes = whiten(slopes)
        rows = np.concatenate([white_slopes, white])
        normal = Normal.of({BASE: white_slopes, **whitened}, rest)
        metric = Weighed(normal, normal.spread(spread))
        block = normal.blocks[BASE]
        here = _coordinates(point)
        gram = metric.gram[block, block] + np.diag(widths**-2)
        gradient = metric.right(normal.right)[block] - here / widths**2
        cost = _cost(metric, normal.right, normal.square, here, widths)
        deviation = np.sqrt(np.diag(np.linalg.inv(gram)))
        after, trial = np.inf, None
        while damping < HARDEST:
            dz = np.linalg.solve(gram + damping * np.diag(np.diag(gram)), gradient)
            dz = dz * min(1.0, LONGEST / float(np.abs(dz).max()))
            moved = float(np.abs(dz / deviation).max())
            trial = _tried(problem, point, dz, solved)
            if trial is not None:
                left = whiten(trial[1].rest)
                after = _cost(
                    metric, rows @ left, float(left @ left), _coordinates(trial[0]), widths
                )
                if after < cost + GAINS:
                    break
            damping = max(10.0 * damping, 1e-2)
        if trial is None or after >= cost + GAINS:
            break  # no way down: the bottom, or its edge
        (point, solved), rest = trial, left
        damping = max(0.1 * damping, 1e-9)
        if progress is not None:
            progress(f"fit of {', '.join(e.name for e in effects) or 'the base'}, cost {after:.0f}")
        if moved < SETTLED or cost - after < GAINS:
            break
        slopes = problem.slopes(point, solved)
    else:
        raise ConvergenceError(
            f"fit with {', '.join(e.name for e in effects) or 'no effect'}: the parameters still "
            f"move by {moved:.2g} standard deviations; the model does not fit these runs: look at "
            "them with `tirelib compare`",
            point,
            moved,
        )
    slopes = problem.slopes(point, solved)
    every = {BASE: slopes, **problem.signatures(point, solved), **problem.remainder(point, solved)}
    first = len(point.base)
    for effect in effects:
        every[ROUGHLY + effect.name] = problem.roughly(slopes[first : first + effect.components])
        first += effect.components
    normal = Normal.of(every, solved.rest, whiten)
    metric = Weighed(normal, normal.spread(spread))
    block = normal.blocks[BASE]
    covariance = np.asarray(np.linalg.inv(metric.gram[block, block] + np.diag(widths**-2)))
    cost = _cost(metric, normal.right, normal.square, _coordinates(point), widths)
    return Posterior(point, solved, every, widths, covariance, cost)


def _coordinates(point: Point) -> FloatArray:
    """Return the base's coordinates and the strengths in ranges."""
    ranges = [s / e.scale for e, s in zip(point.effects, point.strengths, strict=True)]
    return np.concatenate([point.base, *ranges])


def _tried(problem: Problem, point: Point, dz: FloatArray, solved: Any) -> tuple[Point, Any] | None:
    """Return the model a step away; None where it has no solution."""
    k = len(point.base)
    cuts = np.cumsum([e.components for e in point.effects])[:-1]
    steps = np.split(dz[k:], cuts) if point.effects else []
    strengths = tuple(
        s + e.scale * d for s, e, d in zip(point.strengths, point.effects, steps, strict=True)
    )
    there = Point(point.base + dz[:k], point.effects, strengths)
    try:
        return there, problem.solve(there, solved)
    except TirelibError:
        return None


def _cost(
    metric: Weighed, right: FloatArray, square: float, here: FloatArray, widths: FloatArray
) -> float:
    """Return J for a residual with these products."""
    left = square - float(right @ metric.mean(right))
    return left + float(np.sum((here / widths) ** 2))
