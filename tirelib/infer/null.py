"""A fitted hypothesis among the plain tires of a family, and what stands against both."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.infer.normal import Weighed, beside, evidence
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
                diagonal = view.normal.spread({**sized(typical, size), **allowed})
                likelihood = Weighed(view.normal, diagonal).log_likelihood()
                found.append((likelihood + view.log_volume + size_prior(size), view.own))
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
                diagonal = view.normal.spread({**sized(typical, size), **self.allowed})
                weighed = Weighed(view.normal, diagonal)
                more = [
                    MORE * diagonal[block]
                    if "," in name
                    else np.full(block.stop - block.start, PRIOR**2)
                    for name, block in zip(self.names, self.blocks, strict=True)
                ]
                likelihood = weighed.gain(turned) - 0.5 * square
                likelihood = likelihood + view.log_volume + size_prior(size)
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


def sized(typical: Mapping[str, float], size: float) -> dict[str, float]:
    """Return variances of a tire that leaves so much more than its family does."""
    return {name: size**2 * variance for name, variance in typical.items()}


def size_prior(size: float) -> float:
    """Return the log density of a tire's size, up to a constant."""
    return float(-0.5 * (np.log(size) / SIZE_STD) ** 2)
