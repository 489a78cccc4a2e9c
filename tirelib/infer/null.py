"""A fitted hypothesis among the plain tires of one family.

What stands beside the hypothesis - a further effect, more of a group of smooth shapes, or a law of
the hypothesis that is further off than laws are - gains the likelihood ratio

    L_j = 2 [max over k of log p(r | H, a_j, k) - max over k of log p(r | H, k)],

a_j at its likeliest, k the size of what this tire shows of everything and that of the misfit which
each run has for itself. Were the model of plain tires exact, L_j would be a chi-square of as many
degrees of freedom n_j as a_j has components. It is not exact, and by more for one effect than for
another. So each L_j / n_j counts in units of its mean over the family's plain tires, planted in the
user's plan, or of 1 (an exact model) where that is larger; the cube root makes chi-squares of
different n_j comparable (Wilson and Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684). The largest of
these standard scores is the statistic of the hypothesis; its rank among the same tires is the
p-value. Each tire is judged by what the tires of the other parts of the family show, its own mean
left out.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.infer.normal import Weighed, beside
from tirelib.infer.plain import BASE, FOLDS, ROUGHLY, Family, View
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


class Null:
    """A fitted hypothesis among the plain tires of one family.

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

    Attributes
    ----------
    names : list of str
        Of everything that may stand beside the hypothesis.
    likelihood : float
        Largest log likelihood over the sizes, [nats].
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
        self.family, self.allowed = family, allowed
        self.names = [name for name in normal.blocks if name != BASE]
        self.blocks = [normal.blocks[name] for name in self.names]
        self.counts = np.array([block.stop - block.start for block in self.blocks], dtype=float)
        levels = [max(level for level, _ in self._levels(view)) for view in views]
        likeliest = int(np.argmax(levels))
        self.likelihood = levels[likeliest]
        self.views = views[max(likeliest - 1, 0) : likeliest + 2]
        random = np.random.default_rng(len(family))
        planted = family.on(normal)
        for name, variance in allowed.items():
            if name.startswith(ROUGHLY):
                block = normal.blocks[name]
                size = (len(family), block.stop - block.start)
                planted[:, block] = np.sqrt(variance) * random.standard_normal(size)
        whiten = problem.whitener(views[likeliest].own)
        tires = whiten.coloured(random.standard_normal((len(family), normal.count)))
        tires = tires + np.tensordot(planted, rows, axes=1)
        self.tires_at = []
        for view in self.views:
            white = problem.whitener(view.own)(tires)
            self.tires_at.append((view.white @ white.T, np.sum(white**2, axis=1)))
        self._measured = [
            (v.normal.right[:, None], np.array([v.normal.square])) for v in self.views
        ]

    def _levels(self, view: View, without: int | None = None) -> list[tuple[float, Weighed]]:
        """Return the log likelihood and the normal equations at every size of the tire, [nats].

        What is typical of a tire is of all tires of the family, or of those beside one part.
        """
        typical, out = self.family.spread(without), []
        for size in SIZES:
            variance = {name: size**2 * each for name, each in typical.items()} | dict(self.allowed)
            weighed = Weighed(view.normal, view.normal.spread(variance))
            constant = view.log_volume + size_prior(size)
            out.append((weighed.log_likelihood() + constant, weighed))
        return out

    @cached_property
    def _here(self) -> list[tuple[View, float, Weighed]]:
        """The normal equations at every size, from all tires."""
        return self._every(None)

    def _every(self, without: int | None) -> list[tuple[View, float, Weighed]]:
        return [
            (view, size, weighed)
            for view in self.views
            for size, (_, weighed) in zip(SIZES, self._levels(view, without), strict=True)
        ]

    def _ratios(
        self,
        right: Sequence[tuple[FloatArray, FloatArray]],
        without: int | None = None,
        given: int | None = None,
    ) -> FloatArray:
        """Return L_j / n_j of k residuals, (n_names, k).

        `right` holds B r, (m, k), and r' r, (k,), for every view; `given` is a further effect that
        the hypothesis counts with.
        """
        plain, free = [], []
        products = {view.own: each for view, each in zip(self.views, right, strict=True)}
        for view, size, weighed in self._here if without is None else self._every(without):
            turned, square = products[view.own]
            gram, turned_here = weighed.gram, weighed.right(turned)
            level = weighed.gain(turned) - 0.5 * square + view.log_volume + size_prior(size)
            variance = weighed.root**2
            if given is not None:
                block, more = self.blocks[given], self._more(given, variance)
                level = level + _taken(gram, turned_here, block, more)
                gram, turned_here = beside(gram, turned_here, block, more)
            plain.append(level)
            free.append(
                [
                    level + _taken(gram, turned_here, block, self._more(j, variance))
                    for j, block in enumerate(self.blocks)
                ]
            )
        gain = np.max(free, axis=0) - np.max(plain, axis=0)
        return np.asarray(2.0 * gain / self.counts[:, None])

    def _more(self, j: int, variance: FloatArray) -> FloatArray:
        """Return the variance of a block beyond that of plain tires."""
        block = self.blocks[j]
        if "," in self.names[j] or self.names[j].startswith(ROUGHLY):
            return np.asarray(MORE * variance[block])
        return np.full(block.stop - block.start, PRIOR**2)

    @cached_property
    def _tires(self) -> FloatArray:
        """L_j / n_j of each plain tire by the others, (n_names, n_tires)."""
        out = np.zeros((len(self.names), len(self.family)))
        for fold in range(FOLDS):
            part = self.family.fold == fold
            if part.any():
                right = [(turned[:, part], square[part]) for turned, square in self.tires_at]
                out[:, part] = self._ratios(right, fold)
        return out

    @cached_property
    def scale(self) -> FloatArray:
        """Mean of L_j / n_j over the plain tires, at least 1, (n_names,)."""
        return np.asarray(np.maximum(self._tires.mean(axis=1), 1.0))

    @cached_property
    def largest(self) -> FloatArray:
        """The largest standard score of each plain tire by the others, (n_tires,)."""
        count = len(self.family)
        others = (self._tires.sum(axis=1, keepdims=True) - self._tires) / (count - 1)
        scores = standard(self._tires / np.maximum(others, 1.0), self.counts[:, None])
        return np.asarray(scores.max(axis=0))

    @cached_property
    def scores(self) -> FloatArray:
        """The standard score of everything beside the hypothesis, (n_names,)."""
        return standard(self._ratios(self._measured)[:, 0] / self.scale, self.counts)

    def left(self, names: Sequence[str]) -> dict[str, float]:
        """Return the largest standard score beside the hypothesis with each further effect."""
        out = {}
        for name in names:
            j = self.names.index(name)
            scores = standard(self._ratios(self._measured, given=j)[:, 0] / self.scale, self.counts)
            out[name] = float(np.delete(scores, j).max())
        return out


def _taken(gram: FloatArray, right: FloatArray, block: slice, more: FloatArray) -> FloatArray:
    """Return by how much a block at its likeliest raises the log density of k residuals, (k,).

    The arguments are those of `tirelib.infer.normal.evidence`.
    """
    inner = gram[block, block] + np.diag(1.0 / more)
    return np.asarray(0.5 * np.sum(right[block] * np.linalg.solve(inner, right[block]), axis=0))


def standard(ratio: FloatArray, count: FloatArray) -> FloatArray:
    """Return the normal score of a mean square of `count` numbers over its expectation."""
    spread = 2.0 / (9.0 * count)
    return np.asarray((np.cbrt(np.maximum(ratio, 0.0)) - (1.0 - spread)) / np.sqrt(spread))


def size_prior(size: float) -> float:
    """Return the log density of a tire's size, up to a constant."""
    return float(-0.5 * (np.log(size) / SIZE_STD) ** 2)
