"""Gauss-Newton for the model of a problem, with effects or without.

The cost is that of one Gaussian: the residual in the covariance of noise, set points and of what
plain tires show beside their model, and the priors of the base and of the strengths.

    J = r' C^-1 r + sum (z_k / width_k)^2 + sum (s_j / range_j)^2 + sum (a_j / sigma_j)^2

with strengths s of the model's effects and a of all others, sigma that of plain tires.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ConvergenceError
from tirelib.effects import Effect
from tirelib.inference.statistics.downhill import FIRST, Whiten, downhill
from tirelib.inference.statistics.normal import LEAST_VARIANCE, Normal, Weighed
from tirelib.inference.statistics.plain import BASE, ROUGHLY
from tirelib.inference.statistics.problem import Model, Point, Problem
from tirelib.inference.statistics.quadratic import Ends, Quadratic
from tirelib.inference.statistics.views import Views

MOST_STEPS = 150
"""Steps of a fit at most. Along the edge of a sliding tread one takes 84."""
SETTLED = 0.1
"""Fall of the cost that a step has to promise, or a fit has settled, in units of a chi-square: as
much as a number that moves by a third of its standard deviation. Where a model leaves more than a
unit of each number, the unit grows with it."""
ROUGH, ROUNDS = 5.0, 5
"""`SETTLED` where errors are asked for and no strengths, or a whitening follows the fit; and most
times that it does."""
STILL = 0.1
"""Move of a strength of the model's effects, in standard deviations, below which it has settled."""
IDLE = 4
"""Steps in a row that bring less than `SETTLED`, whatever they promise, after which a fit has
settled: where a tread begins to slide, a slope holds on one side only and promises too much."""
PATIENT = 20
"""Steps after which each coordinate is damped by itself: few fits take as many, and those that do
have met a kink."""
FAR, LOOSE = 10.0, 0.03
"""A model that leaves more than `FAR` of what noise leaves is settled by steps that bring less than
`LOOSE` of that surplus: it lacks something strong, and how near it comes to the runs without that
decides nothing."""
WHITENING_MOVE, WHITENING_STEPS = 1.0, 25
"""Move of a coordinate, in standard deviations, below which a whitening that follows the fit is
kept, for it hardly changes any more; and steps after which it is kept in any case: following the
solution, a fit may go in circles."""

Spread = Mapping[str, float]
"""Variances of what plain tires show, by block."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """A fitted model, and everything that may explain what it leaves.

    Attributes
    ----------
    point : Point
        The effects of the model first, then every other effect at what this tire shows of it.
    count : int
        Effects of the model.
    solved : object
        The problem's own solution.
    rest : shape (...)
        What the model would leave with the base where it starts and without any effect, by its
        slopes: all coefficients of the rows are counted from there.
    rows : mapping of name to shape (k, ...)
        "base" (strengths of the model's effects behind it), further effects by name, the groups of
        the remainder, and "roughly NAME" for each effect of the model: errors of its law as large
        as what it does.
    widths : shape (n_coordinates,)
        Prior standard deviations of the block "base".
    covariance : shape (n_coordinates, n_coordinates)
        Covariance of the block's coordinates.
    cost : float
        J at the point.
    short : float
        By how much J may fall further.
    far : bool
        Whether the model leaves more than `FAR` of what noise leaves.
    seen : mapping of effect to float
        Squares of what effects do that neither the base nor shapes of plain tires can take, in
        units of the noise: of the model's effects as strong as they are, of others by the number,
        one range strong.
    lookalike : float
        How much of what a law does may be an error that looks like any one other effect.
    """

    point: Point
    count: int
    solved: Any
    rest: FloatArray
    rows: Mapping[str, FloatArray]
    widths: FloatArray
    covariance: FloatArray
    cost: float
    short: float
    far: bool
    seen: Mapping[str, float]
    lookalike: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects of the model."""
        return self.point.effects[: self.count]

    @property
    def strengths(self) -> tuple[FloatArray, ...]:
        """Their strengths, in their units."""
        return self.point.strengths[: self.count]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the model's effects."""
        return tuple(effect.name for effect in self.effects)

    @cached_property
    def sizes(self) -> dict[str, float]:
        """Mean squares of the rows of everything that plain tires may show, by block.

        The model's own effects are among them, so that hypotheses of other effects have the same
        average of all blocks (`Family.spread`).
        """
        return _sizes(self.rows, self.effects)

    @property
    def sides(self) -> dict[str, float]:
        """Signs of effects of one number whose range lies on one side of zero, by name."""
        one = (e for e in self.point.effects if e.components == 1 and e.low * e.high == 0.0)
        return {effect.name: effect.toward for effect in one}

    @property
    def gage(self) -> frozenset[str]:
        """Names of all effects that act at the gage, whether the model has them or not."""
        return frozenset(e.name for e in self.point.effects if e.hook == "gage")

    def strength(self, name: str) -> FloatArray | None:
        """Return the strength of an effect, of the model or beside it; None if it has none."""
        pairs = zip(self.point.effects, self.point.strengths, strict=True)
        return next((strength for effect, strength in pairs if effect.name == name), None)

    def begins(self, effect: Effect) -> bool:
        """Return whether a fit nearby that adds this effect starts it elsewhere than here."""
        return bool(effect.start) and effect.name not in self.names

    def slopes_at(self, point: Point) -> FloatArray:
        """Return the slopes of this fit by the coordinates of a point with the same effects."""
        base, first = len(self.point.base), len(self.point.base)
        by = {}
        for effect in self.effects:
            by[effect.name] = self.rows[BASE][first : first + effect.components]
            first += effect.components
        by |= {effect.name: self.rows[effect.name] for effect in self.point.effects[self.count :]}
        return np.concatenate([self.rows[BASE][:base], *(by[e.name] for e in point.effects)])

    def views(self, problem: Problem, sizes: Sequence[float]) -> Views:
        """Return the normal equations for sizes of the misfit that each run has for itself."""
        return Views(self.rows, self.rest, problem.whitener, sizes)

    def std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        scale = self.point.effects[index].scale
        return np.asarray(scale * np.sqrt(np.diag(self.covariance)[self.place(index)]))

    def place(self, index: int) -> slice:
        """Return where the strengths of one of the model's effects stand in the block "base"."""
        effects = self.point.effects
        first = len(self.point.base) + sum(e.components for e in effects[:index])
        return slice(first, first + effects[index].components)


def posterior(
    problem: Model,
    effects: Sequence[Effect],
    spread: Spread,
    whiten: Whiten,
    *,
    follow: Callable[[Any], Whiten] | None = None,
    near: Posterior | None = None,
    start: Point | None = None,
    damping: float = 0.0,
    settled: float = SETTLED,
    loose_from: float = np.inf,
    progress: Callable[[str], None] | None = None,
) -> Posterior:
    """Fit the model with effects.

    Every other effect that the plan may show is fitted as well, to what plain tires show of it: at
    a noise of some thousandths of the strain their laws are not linear.

    Parameters
    ----------
    problem : Model
    effects : sequence of Effect
    spread : mapping
        Variances of what plain tires show.
    whiten : callable
        Turns rows (k, ...) into whitened ones (k, n), for instance `Problem.whitener`.
    follow : callable, optional
        Gives a whitening about a solution. It is asked for until a step moves every coordinate by
        less than `WHITENING_MOVE`, or after `WHITENING_STEPS` steps; the given whitening is the
        first one.
    near : Posterior, optional
        A fit nearby.
    start : Point, optional
        From where the fit starts, with the strengths of its first effects; the fit nearby or the
        problem's start, without effects, by default.
    damping : float
        Damping of the first step, relative to the curvature by each coordinate.
    settled : float
        Fall of the cost that a step has to promise.
    loose_from : float
        What a model leaves, over what noise leaves, from which on its fit has settled as soon as a
        step promises less than `LOOSE` of the surplus.
    progress : callable, optional

    Raises
    ------
    ConvergenceError
        If the steps do not settle.
    """
    names = {effect.name for effect in effects}
    others = [effect for effect in problem.living if effect.name not in names]
    point = _start(problem, effects, others, near, start)
    width, ends = _widths(problem, effects, others, spread), _ends(problem, effects, others)
    solved = problem.solve(point, near.solved if near else None)
    known = None
    if near is not None and start is None and not any(map(near.begins, effects)):
        known = near.slopes_at(point)
    slopes = problem.slopes(point, solved) if known is None else known
    exact = known is None or (near is not None and near.point.effects == point.effects)
    whitened, rest = _white(whiten, problem.remainder(point, solved)), whiten(solved.rest)
    asked = slice(len(point.base), len(width) - sum(e.components for e in others))
    idle, moved = 0, np.inf
    last, own = np.zeros(len(width)), np.zeros(len(width))
    for count in range(MOST_STEPS):
        if follow is not None and 0 < count <= WHITENING_STEPS and moved > WHITENING_MOVE:
            whiten = follow(solved)
            whitened, rest = _white(whiten, problem.remainder(point, solved)), whiten(solved.rest)
        rows = {BASE: whiten(slopes), **whitened}
        here = Quadratic.about(rows, rest, point.coordinates, width, spread, ends)
        dz, cost = here.step(), here.cost
        promised = here.fall(dz)
        unit = max(1.0, cost / rest.size)
        little = max(settled * unit, LOOSE * (cost - loose_from * rest.size))
        there = promised < little
        there = there and bool((np.abs(dz[asked]) < STILL * here.deviation[asked]).all())
        lower = None if there else downhill(problem, here, point, solved, whiten, damping, own)
        if lower is None:
            # the bottom, or its edge: slopes of a point nearby do not tell
            if exact:
                break
            slopes, exact, damping = problem.slopes(point, solved), True, 0.0
            continue
        move = lower.point.coordinates - point.coordinates
        if count >= PATIENT:
            own = _own_damping(own, move * last < 0.0)
        last = move
        point, solved, rest = lower.point, lower.solved, lower.rest
        moved, damping = lower.moved, lower.damping
        brings = max(little, SETTLED * unit, LOOSE * (cost - FAR * rest.size))
        idle = idle + 1 if cost - lower.cost < brings else 0
        if idle == IDLE:
            cost = lower.cost
            break
        if progress is not None:
            progress(f"fitting {_model(effects)}, step {count + 1}, cost {lower.cost:.0f}")
        slopes, exact = problem.slopes(point, solved, near=True), False
    else:
        raise ConvergenceError(
            f"fit of {_model(effects)}: after {MOST_STEPS} "
            f"steps the cost still falls by {promised:.2g}; the model does not fit these runs: "
            "look at them with `tirelib compare`",
            point,
            promised,
        )
    every, slopes = explaining(problem, point, solved, len(effects))
    count = len(every[BASE])
    rest_from_start = solved.rest + np.tensordot(point.coordinates, slopes, axes=1)
    normal = Normal.of(every, solved.rest, whiten)
    metric = Weighed(normal, normal.spread(spread))
    block = normal.blocks[BASE]
    covariance = np.asarray(np.linalg.inv(metric.gram[block, block] + np.diag(width[:count] ** -2)))
    return Posterior(
        point,
        len(effects),
        solved,
        rest_from_start,
        every,
        width[:count],
        covariance,
        cost,
        little,
        bool(cost > FAR * rest.size),
        _seen(normal, point, width[:count], spread, len(effects)),
        problem.lookalike,
    )


def _own_damping(own: FloatArray, turned: BoolArray) -> FloatArray:
    """Return each coordinate's own damping, more of it where its last step has turned round.

    A coordinate whose cost has a kink, as a crown whose strips meet the road one after the other,
    goes to and fro over it, and would hold all others back.
    """
    return np.where(turned, np.maximum(10.0 * own, FIRST), 0.5 * own)


def explaining(
    problem: Model, point: Point, solved: Any, count: int
) -> tuple[dict[str, FloatArray], FloatArray]:
    """Return everything that may explain what a model leaves, and the slopes of all coordinates.

    The model has the first `count` of the point's effects. The rows are those of `Posterior.rows`.
    """
    slopes = problem.slopes(point, solved)
    own, others = point.effects[:count], point.effects[count:]
    first = len(point.base) + sum(e.components for e in own)
    every = {BASE: slopes[:first]}
    for effect in others:
        every[effect.name] = slopes[first : first + effect.components]
        first += effect.components
    every |= problem.remainder(point, solved)
    for effect, errors in zip(own, problem.roughly(point, solved, slopes, count), strict=True):
        if not effect.exact:
            every[ROUGHLY + effect.name] = errors
    return every, slopes


def _seen(
    normal: Normal, point: Point, widths: FloatArray, spread: Spread, count: int
) -> dict[str, float]:
    """Return `Posterior.seen` of a point whose first `count` effects are the model's."""
    first, own = len(point.base), point.effects[:count]
    shapes = {name: variance for name, variance in spread.items() if "," in name}
    variance = normal.spread(shapes)
    variance[:first] = widths[:first] ** 2
    gram = Weighed(normal, variance).gram
    out = {}
    for effect, size in zip(own, point.ranges, strict=False):
        rows = slice(first, first + len(size))
        out[effect.name], first = float(size @ gram[rows, rows] @ size), rows.stop
    return out | {
        effect.name: float(np.mean(np.diag(gram)[normal.blocks[effect.name]]))
        for effect in point.effects[count:]
    }


def sizes_at_start(problem: Model) -> dict[str, float]:
    """Return mean squares of rows as `Posterior.sizes`, of the model where a fit starts."""
    point = _start(problem, (), [*problem.start.effects, *problem.living], None, problem.start)
    solved = problem.solve(point)
    rows, _ = explaining(problem, point, solved, len(problem.start.effects))
    return _sizes(rows, problem.start.effects)


def _sizes(rows: Mapping[str, FloatArray], own: Sequence[Effect]) -> dict[str, float]:
    """Return mean squares of rows; those of the model's own effects end the block of the base."""
    first = len(rows[BASE]) - sum(effect.components for effect in own)
    each: dict[str, FloatArray] = {}
    for effect in own:
        each[effect.name] = rows[BASE][first : first + effect.components]
        first += effect.components
    each |= {k: v for k, v in rows.items() if k != BASE and not k.startswith(ROUGHLY)}
    return {name: float(np.mean(block**2)) for name, block in each.items()}


def _white(whiten: Whiten, rows: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return named rows whitened."""
    ends = np.cumsum([len(block) for block in rows.values()])[:-1]
    return dict(zip(rows, np.split(whiten(np.concatenate(list(rows.values()))), ends), strict=True))


def _start(
    problem: Model,
    effects: Sequence[Effect],
    others: Sequence[Effect],
    near: Posterior | None,
    start: Point | None,
) -> Point:
    """Return the point from which a fit starts."""
    given, every = list(start.strengths if start else ()), [*effects, *others]
    for k, effect in enumerate(every[len(given) :], len(given)):
        known = None if near is None else near.strength(effect.name)
        if k < len(effects) and effect.start and (near is None or near.begins(effect)):
            known = np.array(effect.start)
        given.append(np.zeros(effect.components) if known is None else known)
    if start is None:
        start = problem.start if near is None else near.point
    return Point(start.base, tuple(every), tuple(np.array(s, dtype=float) for s in given))


def _widths(
    problem: Model, effects: Sequence[Effect], others: Sequence[Effect], spread: Spread
) -> FloatArray:
    """Return the standard deviations of all coordinates' priors."""
    each = [problem.widths, np.ones(sum(e.components for e in effects))]
    each += [
        np.full(e.components, np.sqrt(max(spread.get(e.name, 0.0), LEAST_VARIANCE))) for e in others
    ]
    return np.concatenate(each)


def _ends(problem: Model, effects: Sequence[Effect], others: Sequence[Effect]) -> Ends:
    """Return the ends of all coordinates: the base's, and what a tire shows is within its range."""
    low, high = problem.ends
    free = np.full(sum(effect.components for effect in effects), np.inf)
    lows, highs = [low, -free], [high, free]
    for effect in others:
        lows.append(np.full(effect.components, effect.low / effect.scale))
        highs.append(np.full(effect.components, effect.high / effect.scale))
    return np.concatenate(lows), np.concatenate(highs)


def _model(effects: Sequence[Effect]) -> str:
    names = " and ".join(effect.name for effect in effects)
    return f"the model with {names}" if names else "the base model"
