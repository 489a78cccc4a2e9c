"""What stands beside a fitted hypothesis, weighed by what plain tires of one family show.

What may stand there - a further effect, more of a group of smooth shapes, or a law of the
hypothesis that is further off than laws are - gains the likelihood ratio

    L_j = 2 [max over k of log p(r | H, a_j, k) - max over k of log p(r | H, k)],

a_j at its likeliest with its prior, k the size of what this tire shows of everything and that of
the misfit which each run has for itself. Were the model of plain tires exact, L_j would be a chi-
square of as many degrees of freedom n_j as a_j has components; the cube root makes chi-squares of
different n_j comparable (Wilson and Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684). The largest of
these standard scores is what stands out. An effect whose range lies on one side of zero may stand
out on the other one: then something else is there. The model of plain tires is not exact: how large
scores get on plain tires is measured (`tirelib.inference.statistics.hypothesis`), for each j by
itself, and every score is held against its own distribution (Westfall and Young, Resampling-Based
Multiple Testing, 1993). Otherwise the groups of shapes that plain tires show most would set the
limit for all.
"""

from collections.abc import Container, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np
from scipy import stats

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.normal import Weighed, beside, taken
from tirelib.inference.statistics.plain import BASE, ROUGHLY, Family
from tirelib.inference.statistics.size import Size, sizes
from tirelib.inference.statistics.views import View

PRIOR = 0.5
"""Standard deviation of a further effect's strength, in ranges."""
MORE = 8.0
"""Variance of a group of shapes beyond that of plain tires, over theirs."""
OPPOSITE = 0.5
"""What a score counts on the side of zero where the effect's range is not, as sidewalls that harden
where they are pressed: something else is there, which plain tires show more often than an effect
and which gets no name. Half and double of it: docs/theory/verdict_numbers.md."""
OWN = tuple(0.00025 * 2.0 ** np.arange(7))
"""Sizes of the misfit that each run has for itself, over its rms strain, among which its likelihood
chooses."""

Products = tuple[FloatArray, FloatArray]
"""B r, (m, k), and r' r, (k,), of k residuals r."""


class Null:
    """A fitted hypothesis among the plain tires of one family.

    Parameters
    ----------
    view : View
        Normal equations about the fit.
    family : Family
    shown : mapping of block to variance
        What its tires show in the plan (`Family.spread`).
    allowed : mapping of block to variance
        What the hypothesis leaves open in addition to that.
    sides : mapping of block to sign
        Effects of one number whose range lies on this side of zero.
    gage : container of str
        Effects of gages and rig, by name.
    size : Size, optional
        The only size of what the tire shows; the likeliest one by default.

    Attributes
    ----------
    names : list of str
        Everything that may be there in addition to the hypothesis.
    counts : shape (n_names,)
        Components n_j of each.
    usual : (shape (n_names,), shape (n_names,))
        Mean and standard deviation of each score on plain tires, where they are more than 0 and 1.
    """

    def __init__(
        self,
        view: View,
        family: Family,
        shown: Mapping[str, float],
        allowed: Mapping[str, float | FloatArray],
        sides: Mapping[str, float],
        gage: Container[str] = (),
        size: Size | None = None,
    ) -> None:
        blocks = view.normal.blocks
        self.view, self.family, self.shown, self.allowed = view, family, shown, allowed
        self.sides, self.gage = sides, gage
        self.names = [name for name in blocks if name != BASE]
        self.blocks = [blocks[name] for name in self.names]
        self.counts = np.array([block.stop - block.start for block in self.blocks], dtype=float)
        self.usual = np.zeros(len(self.names)), np.ones(len(self.names))
        self._shapes = np.zeros(len(view.normal.right), dtype=bool)
        for name, block in blocks.items():
            self._shapes[block] = "," in name or name.startswith(ROUGHLY)
        self._weighed = []
        always = view.normal.spread(allowed)
        for each in sizes(family.largest, shown) if size is None else [size]:
            variance = {name: each.of(name, gage) ** 2 * s for name, s in shown.items()}
            spread = view.normal.spread(variance) + always
            means = {name: each.of(name, gage) * mean for name, mean in family.means.items()}
            self._weighed.append((each, Weighed(view.normal.about(means), spread)))

    @cached_property
    def _levels(self) -> FloatArray:
        """The log likelihood at every size, [nats]."""
        each = [w.log_likelihood() + size.log_prior for size, w in self._weighed]
        return self.view.log_volume + np.array(each)

    @property
    def likelihood(self) -> float:
        """The largest log likelihood over the sizes, [nats]."""
        return float(self._levels.max())

    @property
    def unnamed(self) -> float:
        """The likelihood with more of the group of shapes that gains most, if any, [nats]."""
        gains = (each for name, each in self.gained.items() if "," in name)
        return max(gains, default=self.likelihood)

    @cached_property
    def gained(self) -> dict[str, float]:
        """The likelihood with each that may be there in addition to the hypothesis, [nats].

        It is lower than without an effect that would have to be on the other side of its range.
        """
        gains = self.likelihood + 0.5 * self.counts * self._ratios[:, 0]
        return dict(zip(self.names, gains.tolist(), strict=True))

    @property
    def likeliest(self) -> Weighed:
        """The normal equations at the likeliest sizes."""
        return self._weighed[int(np.argmax(self._levels))][1]

    def ratios_of(self, products: Products, *, given: int | None = None) -> FloatArray:
        """Return L_j / n_j of k residuals, (n_names, k); negative on the side of no effect's range.

        Parameters
        ----------
        products : (shape (m, k), shape (k,))
        given : int, optional
            Place of a further effect that the hypothesis counts with.
        """
        sided = [
            (self.names.index(name), side)
            for name, side in self.sides.items()
            if name in self.names
        ]
        rows = [j for j, _ in sided]
        first, side = [self.blocks[j].start for j in rows], np.array([each for _, each in sided])
        plain, free, signs = [], [], []
        for level, weighed, left in self._at(products):
            gram, here = weighed.gram, weighed.right(left)
            more = self._more(weighed)
            if given is not None:
                block = self.blocks[given]
                level = level + taken(gram, here, [block], more)[0]
                gram, here = beside(gram, here, block, more)
            plain.append(level)
            free.append(level + taken(gram, here, self.blocks, more))
            signs.append(here[first] * side[:, None] >= 0.0)
        best = np.argmax(free, axis=0)[None]
        gain = np.take_along_axis(np.array(free), best, axis=0)[0] - np.max(plain, axis=0)
        ratios = np.asarray(2.0 * gain / self.counts[:, None])
        inside = np.ones(ratios.shape, dtype=bool)
        inside[rows] = np.take_along_axis(np.array(signs), best[:, rows], axis=0)[0]
        return np.where(inside, ratios, -ratios)

    def likelihood_of(self, products: Products) -> FloatArray:
        """Return the largest log likelihood of k residuals over the sizes, (k,), [nats]."""
        return np.asarray(np.max([level for level, _, _ in self._at(products)], axis=0))

    def _at(self, products: Products) -> Iterator[tuple[FloatArray, Weighed, FloatArray]]:
        """Yield the log likelihood (k,) at every size, the metric, and B r less the means' part."""
        right, square = products
        for size, weighed in self._weighed:
            mean, gram = weighed.normal.mean, self.view.normal.gram
            left = right - (gram @ mean)[:, None]
            rest = self.view.log_volume - 0.5 * (square - mean @ (right + left)) + size.log_prior
            yield weighed.gain(left) + rest, weighed, left

    def _more(self, weighed: Weighed) -> FloatArray:
        """Return the variance of each row beyond that of plain tires, (m,)."""
        return np.where(self._shapes, MORE * weighed.root**2, PRIOR**2)

    @property
    def size(self) -> Size:
        """The likeliest size of what this tire shows over what its family shows."""
        return self._weighed[int(np.argmax(self._levels))][0]

    def about(self, view: View, size: Size | None = None) -> "Null":
        """Return the same test of other normal equations, at one size of what the tire shows."""
        other = Null(view, self.family, self.shown, self.allowed, self.sides, self.gage, size)
        other.usual = self.usual
        return other

    def scores_of(self, products: Products, given: str = "") -> FloatArray:
        """Return the standard scores of k residuals, (n_names, k).

        With a further effect `given`, the hypothesis counts with it, and its score is that of
        nothing.
        """
        j = self.names.index(given) if given else None
        scores = self.standard(self.ratios_of(products, given=j))
        if j is not None:
            scores[j] = -np.inf
        return scores

    def standard(self, ratios: FloatArray) -> FloatArray:
        """Return the standard scores of signed L_j / n_j, (n_names, k)."""
        scores = standard(np.abs(ratios), self.counts[:, None])
        scores = np.where((ratios < 0.0) & (scores > 0.0), OPPOSITE * scores, scores)
        mean, std = self.usual
        return np.asarray((scores - mean[:, None]) / std[:, None])

    @property
    def scores(self) -> FloatArray:
        """The standard score of everything beside the hypothesis, (n_names,)."""
        return self.standard(self._ratios)[:, 0]

    @cached_property
    def _ratios(self) -> FloatArray:
        """L_j / n_j of the user's residual, (n_names, 1)."""
        return self.ratios_of(self.measured)

    @property
    def measured(self) -> Products:
        """Products of the user's residual."""
        normal = self.view.normal
        return normal.right[:, None], np.array([normal.square])

    def left(self, names: Sequence[str]) -> dict[str, float]:
        """Return the largest standard score of anything else, with each further effect fitted."""
        return {name: float(self.scores_of(self.measured, name).max()) for name in names}

    def explained(self) -> FloatArray:
        """Return coefficients of all rows by the hypothesis and what plain tires show, (m,)."""
        normal = self.likeliest.normal
        return normal.mean + self.likeliest.mean(normal.right)

    def beside(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return what a further effect or more of a group takes, and its covariance.

        Shapes (n,) and (n, n): coefficients of the rows of that name, beyond what plain tires show.
        """
        weighed, block = self.likeliest, self.blocks[self.names.index(name)]
        inner = weighed.gram[block, block] + np.diag(1.0 / self._more(weighed)[block])
        covariance = np.asarray(np.linalg.inv(inner), dtype=float)
        return covariance @ weighed.right(weighed.normal.right)[block], covariance

    def angle(self, one: str, other: str) -> float:
        """Return the smallest angle between two effects' signatures as this test weighs them.

        It is a right angle where one of them does nothing to the fitted model.
        """
        a, b = (self.blocks[self.names.index(name)] for name in (one, other))
        gram = self.likeliest.gram
        inner = _orthonormal(gram[a, a]).T @ gram[a, b] @ _orthonormal(gram[b, b])
        cosine = float(np.linalg.norm(inner, 2)) if inner.size else 0.0
        return float(np.arccos(min(cosine, 1.0)))

    def power(self, name: str, strength: float, limit: float) -> float:
        """Return the chance that an effect of so many ranges has a score beyond a limit."""
        j = self.names.index(name)
        _, covariance = self.beside(name)
        count = self.counts[j]
        spread = 2.0 / (9.0 * count)
        mean, std = self.usual
        least = limit * std[j] + mean[j]
        least = max(least * np.sqrt(spread) + 1.0 - spread, 0.0) ** 3 * count
        size = strength**2 / float(np.mean(np.diag(covariance)))
        return float(stats.ncx2.sf(least, count, size))


def standard(ratio: FloatArray, count: FloatArray) -> FloatArray:
    """Return the normal score of a mean square of `count` numbers over its expectation."""
    spread = 2.0 / (9.0 * count)
    return np.asarray((np.cbrt(np.maximum(ratio, 0.0)) - (1.0 - spread)) / np.sqrt(spread))


def _orthonormal(gram: FloatArray) -> FloatArray:
    """Return coefficients (n, rank) of rows with these products that make them orthonormal."""
    values, vectors = np.linalg.eigh(gram)
    kept = values > len(values) * np.finfo(float).eps * values[-1]
    return np.asarray(vectors[:, kept] / np.sqrt(values[kept]))
