"""A step of a fit that lowers the cost as its slopes promise, or a shorter one that does."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import TirelibError
from tirelib.inference.statistics.problem import Model, Point
from tirelib.inference.statistics.quadratic import Quadratic

LEAST_FALL = 0.1
"""Share of what a step promises that it has to bring, or a shorter one is tried."""
GOOD = 0.5
"""Share below which the next step is damped."""
FIRST = 0.1
"""Damping to begin with, relative to the curvature by each coordinate."""
HARDEST = 1e4
"""Damping at which there is no way down."""

Whiten = Callable[[FloatArray], FloatArray]
"""Turns rows (k, ...) into whitened ones (k, n)."""


@dataclass(frozen=True, slots=True, eq=False)
class Lower:
    """A point with a lower cost: whitened residual, longest move in deviations, next damping."""

    point: Point
    solved: Any
    rest: FloatArray
    cost: float
    moved: float
    damping: float


def downhill(
    problem: Model,
    here: Quadratic,
    point: Point,
    solved: Any,
    whiten: Whiten,
    damping: float,
    own: float | FloatArray = 0.0,
) -> Lower | None:
    """Return a point whose cost is lower as promised, by ever shorter steps; None if none is.

    All coordinates share `damping`. To it each coordinate adds its `own`, (n_coordinates,). A law
    may end where its range does: where a step has no solution, one is tried that stays within the
    ranges of strengths.
    """
    inside = _inside(here, point)
    parabolas = (here, inside) if (inside.step() != here.step()).any() else (here,)
    while damping < HARDEST:
        for dz in (each.step(damping + own) for each in parabolas):
            tried = _tried(problem, point, dz, solved)
            if tried is None:
                continue
            rest = whiten(tried[1].rest)
            cost = here.cost_at(tried[0].coordinates, rest)
            promised = here.fall(dz)
            if here.cost - cost > LEAST_FALL * promised:
                moved = float(np.abs(dz / here.deviation).max())
                good = here.cost - cost >= GOOD * promised
                after = 0.1 * damping if good else max(damping, FIRST)
                return Lower(*tried, rest, cost, moved, after)
            break
        damping = max(10.0 * damping, FIRST)
    return None


def _inside(here: Quadratic, point: Point) -> Quadratic:
    """Return the cost with strengths that stay in their ranges, or where they are."""
    first, least, most = len(point.base), *(end.copy() for end in here.ends)
    for effect in point.effects:
        rows = slice(first, first + effect.components)
        low, high = effect.low / effect.scale, effect.high / effect.scale
        least[rows] = np.maximum(least[rows], np.minimum(low, here.here[rows]))
        most[rows] = np.minimum(most[rows], np.maximum(high, here.here[rows]))
        first = rows.stop
    return replace(here, ends=(least, most))


def _tried(problem: Model, point: Point, dz: FloatArray, solved: Any) -> tuple[Point, Any] | None:
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
