"""A confidence set of hypotheses: which effects, if any, may be missing.

A hypothesis is a set of effects. It is held against everything else that might be there: each
further effect, and more of each group of smooth shapes than plain tires have. The statistic is the
largest log evidence of any of these beside the hypothesis,

    T(H) = max over a of log p(r | H and a) - log p(r | H),

to first order about H for every a, and by its own fit for those effects that first order finds
likeliest: a base that has bent itself to a strong effect is too far from the truth for first order.
and Its p-value is the rank of T among plain tires with the hypothesis planted in the user's plan:
for each family of tires by itself, judged by what its other tires show; the largest p over the
families counts, so that a tire that is like any one of them is covered. Every hypothesis with
p > alpha is in the set. Its smallest members are what the data say (Ferrari and Yang 2015): none in
it, nothing is missing; one smallest member, that is what is missing; several, they cannot be told
apart; none at all, something unknown is there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.infer.normal import Weighed, beside, evidence
from tirelib.infer.plain import BASE, FOLDS, ROUGHLY, Family, View, pooled
from tirelib.infer.posterior import Posterior, posterior
from tirelib.infer.problem import Problem

PRIOR = 0.5
"""Standard deviation of a further effect's strength, in ranges."""
MORE = 8.0
"""Variance of a group of shapes beyond that of plain tires, over theirs."""
SIZES = 2.0 ** np.arange(-2, 2)
"""Sizes of what one tire shows over what its family shows, among which its likelihood chooses. A
tire that leaves little shows a weak effect; one that leaves far more than its family has something
unknown, so that twice as much is the most that is excused."""
SIZE_STD = 1.5
"""Standard deviation of the logarithm of this size."""
OWN = tuple(0.0005 * 2.0 ** np.arange(6))
"""Sizes of the misfit that each run has for itself, over its rms strain, among which its likelihood
chooses."""
LAW = 0.15
"""Relative standard deviation by which a law is off as conditions change."""
SINGLES, PARTNERS, LEADERS = 6, 3, 3
"""Hypotheses that are fitted exactly: single effects, partners of each leader, and leaders."""
LEAVES = 0.5
"""Share of the evidence against a hypothesis that a further effect may leave, to first order."""
MOST = 3
"""Effects of a hypothesis at most."""
SLACK = 2.0
"""Standard deviations by which a strength may leave its range, those of its law included."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A set of effects with its test.

    Attributes
    ----------
    fit : Posterior
    statistic : float
        T, [nats].
    against : str
        Which effect or shape it is of.
    p, p_std : float
    free_p : float
        The same, with laws that may be off by as much as themselves.
    plausible : bool
        Whether the strengths lie in their ranges.
    evidence : mapping of name to float
        Log evidence of every further effect beside it, [nats].
    limit : float
        T that plain tires exceed with the false-alarm probability.
    left : mapping of name to float
        Largest T, less this limit, that first order leaves beside each further effect.
    seen, level, strict : shape (n_families,)
        T to first order, and log likelihood of the fit with laws that are roughly right and with
        laws that are right, by family, [nats].
    largest : tuple of shape (n_tires,)
        T of plain tires with this hypothesis planted, by family.
    """

    fit: Posterior
    statistic: float
    against: str
    p: float
    p_std: float
    free_p: float
    plausible: bool
    evidence: dict[str, float]
    limit: float
    left: dict[str, float]
    seen: FloatArray
    level: FloatArray
    strict: FloatArray
    largest: tuple[FloatArray, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects."""
        return self.fit.names


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What the confidence set says.

    Attributes
    ----------
    kind : str
        none, named, indistinguishable, form_inadequate or unknown.
    sets : tuple of tuple of str
        Smallest members, best first; empty for none and unknown.
    best : Hypothesis
        That the verdict's model is made of.
    base : Hypothesis
        No further effect.
    tried : tuple of Hypothesis
        All that were fitted exactly.
    alpha : float
    """

    kind: str
    sets: tuple[tuple[str, ...], ...]
    best: Hypothesis
    base: Hypothesis
    tried: tuple[Hypothesis, ...]
    alpha: float


Sized = tuple[FloatArray, FloatArray, FloatArray, list[FloatArray]]
"""B C^-1 B', B C^-1 r, log densities and what is more by block, at one size."""


class Null:
    """A fitted hypothesis among the plain tires of one family.

    What a tire leaves over what its family leaves (its size), and the misfit that each run has for
    itself, are taken at their likeliest, by themselves without a further effect and with it: some
    tires leave much of everything, some little, and a hidden effect must pass neither for a tire
    that leaves much nor for runs that differ.

    Parameters
    ----------
    problem : Problem
    views : sequence of View
        Normal equations about the fit at every size of a run's own misfit.
    rows : shape (m, ...)
        What they are made of.
    family : Family
    allowed : mapping of block to variance
        What the hypothesis leaves open beside what plain tires show.
    """

    def __init__(
        self,
        problem: Problem,
        views: Sequence[View],
        rows: FloatArray,
        family: Family,
        allowed: Mapping[str, float | FloatArray],
    ) -> None:
        normal = views[0].normal
        self.views, self.family, self.allowed = views, family, allowed
        self.names = [
            name
            for name in normal.blocks
            if name != BASE and not name.startswith(ROUGHLY) and name not in allowed
        ]
        self.blocks = [normal.blocks[name] for name in self.names]
        random = np.random.default_rng(len(family))
        planted = family.on(normal)
        for name, variance in allowed.items():
            if name.startswith(ROUGHLY):
                block = normal.blocks[name]
                size = (len(family), block.stop - block.start)
                planted[:, block] = np.sqrt(variance) * random.standard_normal(size)
        whiten = problem.whitener(self.likeliest(allowed)[1])
        tires = whiten.coloured(random.standard_normal((len(family), normal.count)))
        tires = tires + np.tensordot(planted, rows, axes=1)
        self.tires_at = []
        for view in views:
            white = problem.whitener(view.own)(tires)
            self.tires_at.append((view.white @ white.T, np.sum(white**2, axis=1)))

    def likeliest(self, allowed: Mapping[str, float | FloatArray]) -> tuple[float, float]:
        """Return the largest log likelihood, [nats], and the size of a run's own misfit there."""
        typical, found = self.family.spread(), []
        for view in self.views:
            for size in SIZES:
                diagonal = view.normal.spread({**_sized(typical, size), **allowed})
                likelihood = Weighed(view.normal, diagonal).log_likelihood()
                found.append((likelihood + view.log_volume + _size_prior(size), view.own))
        return max(found)

    @cached_property
    def _seen(self) -> list[Sized]:
        """The measured residual at every size."""
        here = [(v.normal.right[:, None], np.array([v.normal.square])) for v in self.views]
        return self._at_sizes(None, here)

    def _at_sizes(
        self, without: int | None, right: Sequence[tuple[FloatArray, FloatArray]]
    ) -> list[Sized]:
        """Return what is made of residuals at every size.

        `right` holds B r, (m, k), and r' r, (k,), of k residuals for every view.
        """
        typical, out = self.family.spread(without), []
        for view, (turned, square) in zip(self.views, right, strict=True):
            for size in SIZES:
                diagonal = view.normal.spread({**_sized(typical, size), **self.allowed})
                weighed = Weighed(view.normal, diagonal)
                more = [
                    MORE * diagonal[block]
                    if "," in name
                    else np.full(block.stop - block.start, PRIOR**2)
                    for name, block in zip(self.names, self.blocks, strict=True)
                ]
                likelihood = weighed.gain(turned) - 0.5 * square
                likelihood = likelihood + view.log_volume + _size_prior(size)
                out.append((weighed.gram, weighed.right(turned), likelihood, more))
        return out

    def _of(self, sizes: Sequence[Sized]) -> FloatArray:
        """Return the log evidence of every effect and shape for k residuals, (n_names, k)."""
        plain, missing = [], []
        for gram, turned, likelihood, more in sizes:
            plain.append(likelihood)
            missing.append(likelihood + evidence(gram, turned, self.blocks, more))
        return np.asarray(np.max(missing, axis=0) - np.max(plain, axis=0))

    def level(self) -> float:
        """Return the largest log likelihood of the hypothesis, [nats]."""
        return max(float(each[2][0]) for each in self._seen)

    def seen(self) -> FloatArray:
        """Return the log evidence of every effect and shape beside the hypothesis, (n_names,)."""
        return self._of(self._seen)[:, 0]

    def beside(self) -> dict[str, float]:
        """Return the largest evidence against the hypothesis with each further effect, [nats]."""
        out = {}
        for k, name in enumerate(self.names):
            if "," in name:
                continue
            plain, missing = [], []
            for gram, turned, likelihood, more in self._seen:
                one = evidence(gram, turned, self.blocks[k : k + 1], more[k : k + 1])[0]
                with_it = beside(gram, turned, self.blocks[k], more[k])
                plain.append(likelihood + one)
                missing.append(plain[-1] + evidence(*with_it, self.blocks, more))
            found = np.max(missing, axis=0) - np.max(plain, axis=0)
            out[name] = float(np.delete(found[:, 0], k).max())
        return out

    def largest(self) -> FloatArray:
        """Return the largest log evidence of each plain tire by the others, (n_tires,)."""
        out = np.zeros(len(self.family))
        for fold in range(FOLDS):
            part = self.family.fold == fold
            if part.any():
                right = [(turned[:, part], square[part]) for turned, square in self.tires_at]
                out[part] = self._of(self._at_sizes(fold, right)).max(axis=0)
        return out


def judged(
    problem: Problem,
    fit: Posterior,
    families: Sequence[Family],
    alpha: float,
    *,
    own_effects: int,
) -> Hypothesis:
    """Return a fitted hypothesis with its statistic and p-value.

    Parameters
    ----------
    own_effects : int
        How many of the fit's effects the model had already: they are part of it.
    """
    views = [fit.view(problem, own) for own in OWN]
    rows = np.concatenate(list(fit.rows.values()))
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    widths: dict[str, float | FloatArray] = {BASE: wide}
    allowed = {**widths, **_law_errors(fit, 1.0)}
    nulls = [Null(problem, views, rows, family, allowed) for family in families]
    seen = [null.seen() for null in nulls]
    largest = [null.largest() for null in nulls]
    each = [_rank(float(s.max()), t) for s, t in zip(seen, largest, strict=True)]
    best = int(np.argmax(each))
    free = each[best]
    if fit.effects and free <= alpha:
        allowed = {**widths, **_law_errors(fit, 1.0 / LAW)}
        for family in families:
            null = Null(problem, views, rows, family, allowed)
            free = max(free, _rank(float(null.seen().max()), null.largest()))
    top = int(np.argmax(seen[best]))
    limits = [float(np.quantile(each, 1.0 - alpha)) for each in largest]
    left: dict[str, float] = {}
    if each[best] <= alpha:
        every = [null.beside() for null in nulls]
        left = {
            name: min(one[name] - limit for one, limit in zip(every, limits, strict=True))
            for name in every[best]
        }
    return Hypothesis(
        fit,
        float(seen[best][top]),
        nulls[best].names[top],
        each[best],
        _std(each[best], len(families[best])),
        free,
        plausible(fit, own_effects),
        dict(zip(nulls[best].names, seen[best].tolist(), strict=True)),
        limits[best],
        left,
        np.array([float(each.max()) for each in seen]),
        np.array([null.level() for null in nulls]),
        np.array([null.likeliest(widths)[0] for null in nulls]),
        tuple(largest),
    )


def against_fits(hypothesis: Hypothesis, others: Sequence[Hypothesis]) -> Hypothesis:
    """Return a hypothesis with its p-value where other fits stand against it too.

    One that lacks some of its effects stands for the fit with both, which is at least as likely.
    The laws of the others count as right: what a rough law may add is not theirs.
    """
    names = set(hypothesis.names)
    more = [other for other in others if not set(other.names) <= names and other.plausible]
    if not more:
        return hypothesis
    gains = np.array([other.strict - hypothesis.level for other in more])
    statistic = np.maximum(hypothesis.seen, gains.max(axis=0))
    each = [_rank(float(t), tires) for t, tires in zip(statistic, hypothesis.largest, strict=True)]
    best = int(np.argmax(each))
    against, free = hypothesis.against, hypothesis.free_p
    if statistic[best] > hypothesis.seen[best]:
        free = min(free, each[best])
        strongest = more[int(np.argmax(gains[:, best]))]
        against = ", ".join(name for name in strongest.names if name not in names)
    return replace(
        hypothesis,
        statistic=float(statistic[best]),
        against=against,
        p=each[best],
        p_std=_std(each[best], len(hypothesis.largest[best])),
        free_p=free,
    )


def _sized(typical: Mapping[str, float], size: float) -> dict[str, float]:
    """Return variances of a tire that leaves so much more than its family does."""
    return {name: size**2 * variance for name, variance in typical.items()}


def _size_prior(size: float) -> float:
    """Return the log density of a tire's size, up to a constant."""
    return float(-0.5 * (np.log(size) / SIZE_STD) ** 2)


def _rank(seen: float, largest: FloatArray) -> float:
    """Return the share of plain tires, this one among them, that have as much."""
    return float((1 + np.sum(largest >= seen)) / (len(largest) + 1))


def _std(p: float, count: int) -> float:
    """Return the standard deviation of a p-value from so many tires."""
    return max(float(np.sqrt(p * (1.0 - p) / count)), 1.0 / (count + 1))


def _law_errors(fit: Posterior, looser: float) -> dict[str, float]:
    """Return variances of the blocks of laws that are but roughly right."""
    out = {}
    for effect, strength in zip(fit.effects, fit.strengths, strict=True):
        size = float(np.linalg.norm(strength)) / effect.scale
        out[ROUGHLY + effect.name] = (looser * LAW * size) ** 2
    return out


def plausible(fit: Posterior, own_effects: int) -> bool:
    """Return whether the strengths of the further effects lie in their ranges."""
    for k, effect in enumerate(fit.effects):
        slack = SLACK * np.hypot(fit.std(k), LAW * np.linalg.norm(fit.strengths[k]))
        low, high = effect.low - slack, effect.high + slack
        inside = (fit.strengths[k] >= low) & (fit.strengths[k] <= high)
        if k >= own_effects and not inside.all():
            return False
    return True


def select(
    problem: Problem,
    families: Sequence[Family],
    *,
    false_alarm: float = 0.05,
    progress: Callable[[str], None] | None = None,
) -> Verdict:
    """Return which effects, if any, a model lacks.

    Parameters
    ----------
    problem : Problem
    families : sequence of Family
        Plain tires.
    false_alarm : float
        Probability with which a plain tire of any of the families is said to lack something.
    progress : callable, optional
    """
    spread, own = pooled(families), max(family.own for family in families)
    had = problem.start.effects
    effects = {effect.name: effect for effect in problem.living}
    tried: dict[frozenset[str], Hypothesis | None] = {}

    def at(names: Sequence[str], near: Hypothesis | None) -> Hypothesis | None:
        key = frozenset(names)
        if key not in tried:
            more = [effects[name] for name in names]
            try:
                fit = posterior(
                    problem,
                    [*had, *more],
                    spread,
                    own,
                    near=None if near is None else near.fit,
                    strengths=_start(problem, near, more, own, spread),
                    progress=progress,
                )
                tried[key] = judged(problem, fit, families, false_alarm, own_effects=len(had))
            except TirelibError:
                tried[key] = None
        return tried[key]

    first = posterior(problem, had, spread, own, strengths=problem.start.strengths)
    base = judged(problem, first, families, false_alarm, own_effects=len(had))

    def done(kind: str, members: Sequence[Hypothesis]) -> Verdict:
        best = members[0] if members else base
        sets = tuple(_added(member, len(had)) for member in members) if members else ()
        every = tuple(each for each in tried.values() if each is not None)
        return Verdict(kind, sets, best, base, every, false_alarm)

    likeliest = _leading(base, effects)[:SINGLES]
    level = [at((name,), base) for name in likeliest]
    fitted = [h for h in level if h is not None and h.plausible]
    base = _settled(problem, base, fitted, families, false_alarm, spread, own, len(had))
    tried[frozenset()] = base
    base = against_fits(base, fitted)
    if base.p > false_alarm:
        return done("none", ())
    names = [name for name in _further(base, effects, SINGLES, LEADERS) if name not in likeliest]
    level += [at((name,), base) for name in names]
    for size in range(1, MOST + 1):
        # two leaders may lead to one and the same set
        every = [h for h in tried.values() if h is not None]
        fitted = [against_fits(h, every) for h in dict.fromkeys(level) if h is not None]
        fitted.sort(key=lambda h: -float(h.level.max()))
        members = [h for h in fitted if h.plausible and h.p > false_alarm]
        if members:
            return done("named" if len(members) == 1 else "indistinguishable", members)
        if size == MOST:
            break
        level = []
        for leader in [h for h in fitted if h.plausible][: LEADERS if size == 1 else 1]:
            added = _added(leader, len(had))
            for partner in _further(leader, effects, PARTNERS, 0):
                level.append(at((*added, partner), leader))
    free = [h for h in tried.values() if h is not None and h.fit.names[len(had) :]]
    free = [h for h in free if h.plausible and h.free_p > false_alarm]
    if free:
        fewest = min(len(h.names) for h in free)
        return done(
            "form_inadequate",
            sorted((h for h in free if len(h.names) == fewest), key=lambda h: h.fit.cost)[:1],
        )
    return done("unknown", ())


def _settled(
    problem: Problem,
    base: Hypothesis,
    others: Sequence[Hypothesis],
    families: Sequence[Family],
    alpha: float,
    spread: dict[str, float],
    own: float,
    had: int,
) -> Hypothesis:
    """Return the base, fitted again from the likeliest of other fits if that is likelier."""
    if not others:
        return base
    best = max(others, key=lambda h: float(h.strict.max()))
    if float((best.strict - base.level - base.seen).max()) < 0.5 * base.limit:
        return base
    start = problem.start
    try:
        fit = posterior(
            problem, start.effects, spread, own, near=best.fit, strengths=start.strengths
        )
    except TirelibError:
        return base
    again = judged(problem, fit, families, alpha, own_effects=had)
    return again if float(again.level.max()) > float(base.level.max()) else base


def _added(hypothesis: Hypothesis, had: int) -> tuple[str, ...]:
    return hypothesis.names[had:]


def _leading(hypothesis: Hypothesis, effects: dict[str, Effect]) -> list[str]:
    """Return effects by their evidence beside a hypothesis, best first."""
    return sorted(effects, key=lambda name: -hypothesis.evidence.get(name, -np.inf))


def _further(leader: Hypothesis, effects: dict[str, Effect], most: int, least: int) -> list[str]:
    """Return the effects that take away most of what stands against a hypothesis, best first.

    One that leaves more than `LEAVES` of it, to first order, is tried only if fewer than `least`
    leave less: two effects may be needed together.
    """
    excess = leader.statistic - leader.limit
    found = {name: left for name, left in leader.left.items() if name in effects}
    every = sorted(found, key=lambda name: found[name])
    good = sum(found[name] < LEAVES * excess for name in every)
    return every[: min(most, max(good, least))]


def _start(
    problem: Problem,
    near: Hypothesis | None,
    more: Sequence[Effect],
    own: float,
    spread: dict[str, float],
) -> list[FloatArray]:
    """Return strengths to start from: those of the fit nearby, first order for what is new."""
    had = [*problem.start.strengths]
    if near is None:
        return [*had, *(np.zeros(e.components) for e in more)]
    known = dict(zip(near.names, near.fit.strengths, strict=True))
    normal = near.fit.view(problem, own).normal
    wide = {e.name: 1.0 for e in more if e.name not in known}
    diagonal = normal.spread({**spread, BASE: near.fit.widths**2, **wide})
    mean = Weighed(normal, diagonal).mean(normal.right)
    out = list(near.fit.strengths[: len(had)])
    for effect in more:
        if effect.name in known:
            out.append(known[effect.name])
        else:
            first = mean[normal.blocks[effect.name]] * effect.scale
            out.append(np.clip(first, 0.9 * effect.low, 0.9 * effect.high))
    return out
