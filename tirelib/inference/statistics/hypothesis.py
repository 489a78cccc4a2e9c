"""A hypothesis, that these effects and no other are missing, with its test.

Its statistic is the largest standard score of anything beside it
(`tirelib.inference.statistics.null`), each over what is usual of it on plain tires, by the family
of plain tires that excuses most. A user's tire belongs to none of the families, and a test by what
its own family shows would be too sure. So the p-value is calibrated on plain tires, with the
hypothesis planted in the user's plan, each by the families other than its own. The rank of the
user's statistic among a family's tires is a p-value; the largest over the families counts, so that
a tire which differs from the known families no more than any of them does from the others is
covered.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.normal import blocks_of
from tirelib.inference.statistics.null import OWN, PRIOR, Null, Products
from tirelib.inference.statistics.plain import BASE, ROUGHLY, Family, View
from tirelib.inference.statistics.posterior import Posterior
from tirelib.inference.statistics.problem import Problem

LAWS = (0.03, 0.1, 0.3)
"""Relative standard deviations by which laws are off, each law by its own: a hypothesis stays if it
does with the likeliest ones, or with the same for all."""
USUAL = 0.15
"""That of most laws."""
LOOSEST = 1.0
"""That which is tried where a hypothesis is rejected: its laws are off by as much as themselves."""
SLACK = 2.0
"""Standard deviations by which a strength may leave its range, those of its law included."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A set of effects with its test.

    Attributes
    ----------
    fit : Posterior
    nulls : tuple of Null
        The test by every family.
    plain : tuple of shape (n_tires,)
        Statistic of each plain tire by the families other than its own, by family.
    laws : tuple of float
        Relative standard deviation by which each law is off.
    looseness : float
        By how much more laws have to be off for the hypothesis to stay: 1, or infinity if it is
        rejected even with `LOOSEST`.
    plausible : bool
        Whether the strengths lie in their ranges.
    likelihood : float
        Largest log likelihood over the families and over how far the laws are off, laws that are
        exact among them, [nats].
    exact : float
        Largest log likelihood with exact laws, [nats].
    further : mapping of name to float
        The same with each further effect, to first order, [nats].
    unnamed : float
        Largest log likelihood where a cause without a name acts as well, [nats]. This cause is more
        of a group of smooth shapes than plain tires have. Laws are roughly right, or exact.
    exact_plain : tuple of float
        `p_plain` of each effect with exact laws.
    rival : str
        Effects of a hypothesis of as many effects that is likelier; empty where there is none.
    p_rival : float
        p-value of the likelihood ratio in favour of the rival
        (`tirelib.inference.statistics.rival`).
    p_beside : float
        p-value with further effects beside these that are no larger than plain tires show.
    """

    fit: Posterior
    nulls: tuple[Null, ...]
    plain: tuple[FloatArray, ...]
    laws: tuple[float, ...]
    looseness: float
    plausible: bool
    likelihood: float
    exact: float
    further: Mapping[str, float]
    unnamed: float
    exact_plain: tuple[float, ...]
    rival: str = ""
    p_rival: float = 1.0
    p_beside: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return self.fit.names

    @property
    def null(self) -> Null:
        """That of the family that excuses most."""
        return _excusing(self.nulls)

    @property
    def scores(self) -> dict[str, float]:
        """Standard score of everything beside the hypothesis."""
        return dict(zip(self.null.names, self.null.scores.tolist(), strict=True))

    @property
    def statistic(self) -> float:
        """The largest of them."""
        return float(self.null.scores.max())

    @property
    def against(self) -> str:
        """What has this score: a further effect, a group of shapes, or the law of an effect."""
        return self.null.names[int(np.argmax(self.null.scores))]

    @property
    def p(self) -> float:
        """p-value of the hypothesis: of the statistic, or of its rival if that is smaller.

        What plain tires show is no part of the hypothesis: the largest over sizes of it counts.
        """
        return max(min(self.p_of(self.statistic)[0], self.p_rival), self.p_beside)

    @property
    def p_std(self) -> float:
        """Standard deviation of the p-value, from the number of plain tires."""
        return self.p_of(self.statistic)[1]

    def p_of(self, statistic: float) -> tuple[float, float]:
        """Return the p-value of a statistic among plain tires, and its standard deviation."""
        p = float(_p(np.array([statistic]), self.plain)[0])
        count = min(map(len, self.plain))
        return p, max(float(np.sqrt(p * (1.0 - p) / count)), 1.0 / (count + 1))

    def p_plain(self, index: int) -> float:
        """Return the p-value of the hypothesis that an effect is as large as plain tires show it.

        By chi-squared of its strength, whose variance is that of the fit with roughly right laws
        and that of plain tires; the largest over the families.
        """
        return _p_plain(self.nulls, self.fit, index)

    def gain(self, name: str) -> float:
        """Return by how much a further effect with an exact law raises `exact`, to first order.

        `further` has the effect at its likeliest; here its strength is integrated over its prior,
        as it is where the effect belongs to the hypothesis.
        """
        _, covariance = self.null.beside(name)
        volume = np.linalg.slogdet(covariance / PRIOR**2)[1]
        return float(self.further[name] - self.exact + 0.5 * volume)

    def limit(self, alpha: float) -> float:
        """Return the statistic from which on the p-value is at most alpha."""
        return max(float(np.quantile(each, 1.0 - alpha, method="higher")) for each in self.plain)

    def p_values(self, products: Products, given: str = "") -> FloatArray:
        """Return the p-values of k residuals, (k,); arguments are those of `Null.scores_of`."""
        return _p(_statistic(self.nulls, products, given), self.plain)


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
    families : sequence of Family
        At least two.
    own_effects : int
        How many of the fit's effects the model had already: they are part of it.
    """
    views = fit.views(problem, OWN)
    alike = list(dict.fromkeys(_each(fit, law) for law in LAWS))
    found = {laws: _likeliest(views, fit, families, laws) for laws in alike}
    laws = max(alike, key=lambda laws: found[laws][0])
    for k in _vague(fit) if len(fit.effects) > 1 else ():
        more = [(*laws[:k], law, *laws[k + 1 :]) for law in LAWS]
        near = found[laws][1:]
        found |= {m: _likeliest(near, fit, families, m) for m in more if m not in found}
        laws = max(found, key=lambda laws: found[laws][0])
    without = _each(fit, 0.0)
    if without not in found:
        found[without] = _likeliest(views, fit, families, without)
    exact, at = found[without]
    sharp = [_null(at, fit, family, without) for family in families]
    loosest = _each(fit, LOOSEST)
    likeliest = sorted(alike, key=lambda laws: -found[laws][0])
    looseness = np.inf
    for each in dict.fromkeys([laws, *likeliest, loosest]):
        nulls, plain = _tested(fit, found.get(each, found[alike[-1]])[1], families, each)
        stays = _p(np.array([_excusing(nulls).scores.max()]), plain)[0] > alpha
        if each == laws or (stays and each != loosest):
            kept = nulls, plain, each
        if stays:
            looseness = max((*each, LAWS[-1])) / LAWS[-1]
            break
    likelihood = max(exact, found[laws][0])
    further = {name: max(null.gained[name] for null in sharp) for name in sharp[0].gained}
    unnamed = max(likelihood + _unnamed(kept[0]), exact + _unnamed(sharp))
    small = tuple(_p_plain(sharp, fit, k) for k in range(len(fit.effects)))
    inside = plausible(fit, own_effects)
    return Hypothesis(fit, *kept, looseness, inside, likelihood, exact, further, unnamed, small)


def _unnamed(nulls: Sequence[Null]) -> float:
    """Return by how much something without a name raises the log likelihood, [nats]."""
    without = max(null.likelihood for null in nulls)
    return max(null.unnamed for null in nulls) - without


def _p_plain(nulls: Sequence[Null], fit: Posterior, index: int) -> float:
    """Return the p-value of an effect that is as large as plain tires show it, by these tests."""
    name, place, p = fit.names[index], fit.place(index), 0.0
    for null in nulls:
        weighed, size = null.likeliest, null.size.of(name)
        strength = weighed.mean(weighed.normal.right)[place]
        left = strength - size * null.family.means.get(name, 0.0)
        shown = size**2 * null.shown.get(name, 0.0) * np.eye(left.size)
        square = left @ np.linalg.solve(weighed.covariance[place, place] + shown, left)
        p = max(p, float(chi2.sf(square, left.size)))
    return p


def _vague(fit: Posterior) -> list[int]:
    """Return the places of effects whose laws are only roughly right."""
    return [k for k, effect in enumerate(fit.effects) if not effect.exact]


def _each(fit: Posterior, law: float) -> tuple[float, ...]:
    """Return one relative standard deviation for all laws that are only roughly right."""
    return tuple(0.0 if effect.exact else law for effect in fit.effects)


def _null(view: View, fit: Posterior, family: Family, laws: Sequence[float]) -> Null:
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    allowed = {BASE: wide, **law_errors(fit, laws, view)}
    return Null(view, family, family.spread(fit.sizes), allowed, fit.sides)


def _likeliest(
    views: Sequence[View], fit: Posterior, families: Sequence[Family], laws: Sequence[float]
) -> tuple[float, View]:
    """Return the largest likelihood over families and sizes of a run's own misfit, and its view."""
    each = [max(_null(view, fit, f, laws).likelihood for f in families) for view in views]
    return max(each), views[int(np.argmax(each))]


def _tested(
    fit: Posterior, at: View, families: Sequence[Family], laws: Sequence[float]
) -> tuple[tuple[Null, ...], tuple[FloatArray, ...]]:
    """Return the tests by every family, and the statistics of plain tires by the others."""
    nulls = tuple(_null(at, fit, family, laws) for family in families)
    plain = []
    for family in families:
        planted, noise = _drawn(fit, family, law_errors(fit, laws, at), at.white.shape[1])
        turned = _products(at, noise + planted @ at.white)  # whitened
        plain.append([null.scores_of(turned) for null in nulls if null.family is not family])
    every = np.concatenate([scores for each in plain for scores in each], axis=1)
    mean, std = np.maximum(every.mean(axis=1), 0.0), np.maximum(every.std(axis=1), 1.0)
    for null in nulls:
        null.usual = mean, std
    standing = ((np.array(each) - mean[:, None]) / std[:, None] for each in plain)
    return nulls, tuple(np.min(each.max(axis=1), axis=0) for each in standing)


def _excusing(nulls: Sequence[Null]) -> Null:
    """Return the test by the family that excuses most of the user's residual."""
    return min(nulls, key=lambda null: float(null.scores.max()))


def _statistic(nulls: Sequence[Null], products: Products, given: str = "") -> FloatArray:
    """Return the largest score of k residuals by the family that excuses most, (k,)."""
    return np.asarray(np.min([n.scores_of(products, given).max(axis=0) for n in nulls], axis=0))


def _p(statistic: FloatArray, plain: Sequence[FloatArray]) -> FloatArray:
    """Return the largest rank of statistics (k,) among the tires of any family, as p-values."""
    ranks = [
        (1 + np.sum(tires[:, None] >= statistic, axis=0)) / (len(tires) + 1) for tires in plain
    ]
    return np.asarray(np.max(ranks, axis=0))


def plain_tires(
    problem: Problem,
    fit: Posterior,
    family: Family,
    laws: Mapping[str, float | FloatArray],
    own: float,
) -> FloatArray:
    """Return what a fitted hypothesis leaves of a family's plain tires in the user's plan.

    The hypothesis' laws are off, and every run has a misfit of its own, as they are for the user.

    Returns
    -------
    shape (n_tires, ...)
    """
    whiten, rows = problem.whitener(own), np.concatenate(list(fit.rows.values()))
    planted, noise = _drawn(fit, family, laws, whiten(fit.rest).size)
    return np.asarray(whiten.coloured(noise) + np.tensordot(planted, rows, axes=1))


def _drawn(
    fit: Posterior, family: Family, laws: Mapping[str, float | FloatArray], count: int
) -> tuple[FloatArray, FloatArray]:
    """Return coefficients of all rows for plain tires, (n_tires, m), and white noise (n_tires, n).

    The errors of the hypothesis' laws are drawn with the given variances.
    """
    blocks = blocks_of(fit.rows)
    random = np.random.default_rng(list(family.name.encode()))
    planted = family.on(blocks, sum(map(len, fit.rows.values())))
    for name, variance in laws.items():
        block = blocks[name]
        size = (len(family), block.stop - block.start)
        planted[:, block] += np.sqrt(variance) * random.standard_normal(size)
    return planted, random.standard_normal((len(family), count))


def products(problem: Problem, view: View, tires: FloatArray) -> Products:
    """Return the products of residuals (k, ...) with the rows of a view."""
    return _products(view, problem.whitener(view.own)(tires))


def _products(view: View, white: FloatArray) -> Products:
    return view.white @ white.T, np.sum(white**2, axis=1)


def law_errors(fit: Posterior, laws: Sequence[float], view: View) -> dict[str, float | FloatArray]:
    """Return variances by block where each law is off by a relative standard deviation.

    They come on top of what plain tires show. A law's error has shapes of its own. To some extent
    it looks like each other effect: by the problem's share (`Model.lookalike`) of what the laws do
    that the base cannot take. Exact laws have no error.
    """
    if not any(laws):
        return {}
    out: dict[str, float | FloatArray] = {
        ROUGHLY + effect.name: law**2
        for effect, law in zip(fit.effects, laws, strict=True)
        if not effect.exact
    }
    if fit.lookalike:
        square, others = _beyond_base(fit, view)
        out |= {name: fit.lookalike**2 * square / other for name, other in others.items()}
    return out


def _beyond_base(fit: Posterior, view: View) -> tuple[float, dict[str, float]]:
    """Return the square of what laws do that the base cannot take, and of other effects' rows.

    The rows are of a strength of one range; an effect of which the base takes all is left out.
    """
    gram, first = view.normal.gram, len(fit.point.base)
    base = gram[:first, :first] + np.diag(fit.widths[:first] ** -2)
    left = gram - gram[:, :first] @ np.linalg.solve(base, gram[:first])
    done = 0.0
    for effect, size in zip(fit.effects, fit.point.ranges, strict=False):
        own = slice(first, first + len(size))
        done += 0.0 if effect.exact else float(size @ left[own, own] @ size)
        first = own.stop
    others = {
        effect.name: float(np.mean(np.diag(left)[view.normal.blocks[effect.name]]))
        for effect in fit.point.effects[fit.count :]
    }
    return done, {k: v for k, v in others.items() if v > 0.0}


def plausible(fit: Posterior, own_effects: int) -> bool:
    """Return whether the strengths of the further effects lie in their ranges."""
    for k, effect in enumerate(fit.effects):
        slack = SLACK * np.hypot(fit.std(k), USUAL * np.linalg.norm(fit.strengths[k]))
        low, high = effect.low - slack, effect.high + slack
        inside = (fit.strengths[k] >= low) & (fit.strengths[k] <= high)
        if k >= own_effects and not inside.all():
            return False
    return True
