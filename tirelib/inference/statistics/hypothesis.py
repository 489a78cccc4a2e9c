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
from tirelib.inference.statistics.law_errors import LAWS, Errors, Likelihoods, law_errors
from tirelib.inference.statistics.normal import blocks_of
from tirelib.inference.statistics.null import OWN, PRIOR, Null, Products
from tirelib.inference.statistics.plain import Family
from tirelib.inference.statistics.posterior import Posterior
from tirelib.inference.statistics.problem import Problem
from tirelib.inference.statistics.views import View

USUAL = 0.15
"""Relative standard deviation by which most laws are off."""
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
    errors : Errors
        By how much the laws are off.
    looseness : float
        By how much more laws have to be off for the hypothesis to stay: 1, or infinity if it is
        rejected even with the loosest.
    plausible : bool
        Whether the strengths lie in their ranges.
    likelihood : float
        Largest log likelihood over the families and over how far the laws are off, laws that are
        exact among them, [nats].
    promises : tuple of (float, mapping of name to float)
        Largest log likelihood, and the same with each further effect to first order, [nats]: with
        exact laws, with laws as they are likeliest but not like other effects, and as likeliest.
    unnamed : float
        Largest log likelihood where a cause without a name acts as well, [nats]. This cause is more
        of a group of smooth shapes than plain tires have. Laws are roughly right, or exact.
    unnamed_exact : float
        `unnamed` with exact laws.
    exact_in : tuple of float
        `unnamed` where the law of one effect is exact, for each effect in turn, the other laws
        roughly right or exact.
    rival : str
        Effects of a hypothesis of as many effects that is likelier; empty where there is none.
    p_rival : float
        p-value of the likelihood ratio in favour of the rival
        (`tirelib.inference.statistics.rival`).
    """

    fit: Posterior
    nulls: tuple[Null, ...]
    plain: tuple[FloatArray, ...]
    errors: Errors
    looseness: float
    plausible: bool
    likelihood: float
    promises: tuple[tuple[float, Mapping[str, float]], ...]
    unnamed: float
    unnamed_exact: float
    exact_in: tuple[float, ...]
    rival: str = ""
    p_rival: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return self.fit.names

    @property
    def exact(self) -> float:
        """Largest log likelihood with exact laws, [nats]."""
        return self.promises[0][0]

    @property
    def further(self) -> Mapping[str, float]:
        """The same with each further effect, to first order, [nats]."""
        return self.promises[0][1]

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
        """p-value of the hypothesis: of the statistic, or of its rival if that is smaller."""
        return min(self.p_of(self.statistic)[0], self.p_rival)

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

        By chi-squared of its strength, whose variance is that of the fit, laws off by `errors`, and
        that of plain tires; the largest over the families.
        """
        name, place, p = self.names[index], self.fit.place(index), 0.0
        for null in self.nulls:
            weighed, size = null.likeliest, null.size.of(name, null.gage)
            strength = weighed.mean(weighed.normal.right)[place]
            left = strength - size * null.family.means.get(name, 0.0)
            shown = size**2 * null.shown.get(name, 0.0) * np.eye(left.size)
            square = left @ np.linalg.solve(weighed.covariance[place, place] + shown, left)
            p = max(p, float(chi2.sf(square, left.size)))
        return p

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
    likelihoods = Likelihoods(fit, families, fit.views(problem, OWN))
    likeliest, exact, loosest = likelihoods.likeliest, likelihoods.exact, likelihoods.loosest
    looseness = np.inf
    for each in dict.fromkeys([likeliest, *likelihoods.alike, loosest]):
        nulls = likelihoods.nulls(each)
        plain = _calibrated(nulls, fit, each)
        stays = _p(np.array([_excusing(nulls).scores.max()]), plain)[0] > alpha
        if each == likeliest or (stays and each != loosest):
            kept = nulls, plain, each
        if stays:
            looseness = max((*each.laws, LAWS[-1])) / LAWS[-1]
            break
    alone = likeliest._replace(lookalike=0.0)
    return Hypothesis(
        fit,
        *kept,
        looseness,
        plausible(fit, own_effects),
        likelihoods.of(likeliest),
        tuple((likelihoods.of(e), likelihoods.gained(e)) for e in (exact, alone, likeliest)),
        max(likelihoods.unnamed(each) for each in (likeliest, exact)),
        likelihoods.unnamed(exact),
        tuple(likelihoods.exact_in(k) for k in range(len(fit.effects))),
    )


def _calibrated(nulls: Sequence[Null], fit: Posterior, errors: Errors) -> tuple[FloatArray, ...]:
    """Return the statistics of plain tires by the other families; tests learn what is usual."""
    plain, view = [], nulls[0].view
    for family in (null.family for null in nulls):
        planted, noise = _drawn(fit, family, law_errors(fit, errors), view.white.shape[1])
        turned = _products(view, noise + planted @ view.white)  # whitened
        plain.append([null.scores_of(turned) for null in nulls if null.family is not family])
    every = np.concatenate([scores for each in plain for scores in each], axis=1)
    mean, std = np.maximum(every.mean(axis=1), 0.0), np.maximum(every.std(axis=1), 1.0)
    for null in nulls:
        null.usual = mean, std
    standing = ((np.array(each) - mean[:, None]) / std[:, None] for each in plain)
    return tuple(np.min(each.max(axis=1), axis=0) for each in standing)


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


def plausible(fit: Posterior, own_effects: int) -> bool:
    """Return whether the strengths of the further effects lie in their ranges."""
    for k, effect in enumerate(fit.effects):
        slack = SLACK * np.hypot(fit.std(k), USUAL * np.linalg.norm(fit.strengths[k]))
        low, high = effect.low - slack, effect.high + slack
        inside = (fit.strengths[k] >= low) & (fit.strengths[k] <= high)
        if k >= own_effects and not inside.all():
            return False
    return True
