"""What the brush's structure cannot show, and what that does to its numbers.

The brush is not the tire: its misfit over slip and load is a smooth function, which more points do
not average out. Per force it is taken as a Gaussian process, odd in the force's own slip up to a
small even part, growing with load, with the scatter from point to point beside it. Size and lengths
are estimated from the residuals (restricted likelihood: the part that the parameters took up is
allowed for), over a small grid.

A tire's own property (cornering stiffness at zero slip, largest force) is the best brush's plus
what the misfit adds there; mean and variance of both together follow by universal kriging.

The brush bends at zero slip: its force is quadratic in the size of the slip. Another tire's may
not, so the misfit is also taken about a curve without that bend, and the likelier one counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.brush_cells import Cells

LENGTHS = (0.5, 1.0, 2.0)
"""Over the slip, in units of the slip at which the whole contact slides."""
LOAD_LENGTHS = (0.3, 1.0)
"""Over the logarithms of load and pressure."""
SHARES = (0.5, 0.9, 0.99, 0.999)
"""Shares of the misfit's variance that are tried as its smooth part, beside none."""
EVEN = 0.1
CAMBER_LENGTH = 0.1
FEWEST_FREEDOMS = 3
"""Degrees of freedom that a force needs to tell its misfit."""
_MOST_FOR_LENGTHS = 300
_FLOOR = 1e-10
_TINY = 1e-24
FREE = 5.0
"""Standard deviation of every z before any measurement: vague, and enough to stay finite."""


class Term(NamedTuple):
    """A multiple of the misfit of one force at one place, forces over their scale.

    The place is a column of `tirelib.inference.identify.brush_cells.places`.
    """

    force: str
    place: tuple[float, ...]
    factor: float


class Shape(NamedTuple):
    """Lengths of one force's misfit over slip and load, and the smooth share of its variance."""

    slip: float
    load: float
    share: float


@dataclass(frozen=True, slots=True, eq=False)
class ForceMisfit:
    """Misfit of one force.

    Attributes
    ----------
    shape : Shape
        The likeliest.
    variance : float
        Variance of the misfit at the reference load, over the force's scale squared; infinite where
        too few points tell it.
    evidence : float
        Logarithm of the restricted likelihood, over all shapes.
    """

    cells: Cells
    shape: Shape
    variance: float
    freedom: int
    evidence: float


@dataclass(frozen=True, slots=True, eq=False)
class Misfit:
    """Misfit of all forces of a fit, about the brush or about the curve without a bend.

    Attributes
    ----------
    load, pressure : float, [N], [Pa]
        Reference.
    """

    forces: tuple[ForceMisfit, ...]
    load: float
    pressure: float

    @property
    def freedom(self) -> int:
        """Degrees of freedom behind the sizes: those of the force that has fewest."""
        return min(each.freedom for each in self.forces)

    @property
    def evidence(self) -> float:
        """Logarithm of the restricted likelihood of all forces."""
        return sum(each.evidence for each in self.forces)

    def lack(
        self, gradient: FloatArray, terms: Sequence[Sequence[Term]]
    ) -> tuple[FloatArray, FloatArray]:
        """Return by how much the tire's own numbers exceed the fitted ones: universal kriging.

        Parameters
        ----------
        gradient : shape (q, p)
            Slopes of the numbers by z.
        terms : q sequences of Term
            What the misfit adds to them.

        Returns
        -------
        mean, variance : shape (q,)
        """
        count, size = gradient.shape
        if not all(np.isfinite(each.variance) for each in self.forces):
            return np.zeros(count), np.full(count, np.inf)
        normal, right = np.eye(size) / FREE**2, np.zeros(size)
        direct, left = np.zeros(count), gradient.T.copy()
        variance = np.zeros(count)
        for each in self.forces:
            solved, cross, own = self._solved(each, terms)
            slope, misfit = each.cells.slope, each.cells.misfit
            back, weighed = solved
            normal += slope.T @ back
            right += back.T @ misfit
            direct += cross @ weighed[:, 0]
            variance += own - np.einsum("qi,iq->q", cross, weighed[:, 1:])
            left -= slope.T @ weighed[:, 1:]
        inverse = np.linalg.inv(normal)
        mean = direct + left.T @ inverse @ right
        variance += np.einsum("pq,pr,rq->q", left, inverse, left, optimize=True)
        return np.asarray(mean), np.maximum(variance, 0.0)

    def _solved(
        self, each: ForceMisfit, terms: Sequence[Sequence[Term]]
    ) -> tuple[tuple[FloatArray, FloatArray], FloatArray, FloatArray]:
        """Return K^-1 times (slope) and (misfit, cross), the terms' cross-covariance and own."""
        cells, shape = each.cells, each.shape
        n = cells.misfit.size
        places = [t for row in terms for t in row if t.force == cells.force]
        owner = [q for q, row in enumerate(terms) for t in row if t.force == cells.force]
        factor = np.zeros((len(terms), len(places)))
        factor[owner, np.arange(len(places))] = [t.factor for t in places]
        at = np.column_stack([cells.at, *(term.place for term in places)])
        every = each.variance * kernel(cells.force, shape, at, self.load)
        smooth = shape.share * every
        scatter = each.variance * (1.0 - shape.share) * (cells.at[0] / self.load) ** 2
        K = smooth[:n, :n] + np.diag(scatter)
        root = cho_factor(K + (_FLOOR * np.trace(K) / n + _TINY) * np.eye(n), lower=True)
        cross = factor @ smooth[n:, :n]
        own = np.einsum("qi,ij,qj->q", factor, smooth[n:, n:], factor, optimize=True)
        stacked = np.concatenate([cells.misfit[:, None], cross.T], axis=1)
        return (cho_solve(root, cells.slope), cho_solve(root, stacked)), cross, own


def misfit_of(
    cells: Sequence[Cells], load: float, pressure: float, *, smooth: bool = False
) -> Misfit:
    """Return the misfit that the residuals of a fit tell, with cells of each force.

    Load and pressure are the reference, [N], [Pa]. With `smooth` it is taken from the curve without
    a bend at zero slip instead of from the brush.
    """
    if smooth:
        cells = [replace(each, misfit=each.smooth) for each in cells]
    return Misfit(tuple(_told(each, load) for each in cells), load, pressure)


def kernel(force: str, shape: Shape, at: FloatArray, load: float) -> FloatArray:
    """Return the covariance of the smooth misfit over places, variance 1 far out, shape (m, m).

    Places (7, m) are `tirelib.inference.identify.brush_cells.places`; the reference load is [N].
    """
    loads, pressure, angle, ratio, camber, slide_angle, slide_ratio = at
    own, other = angle / slide_angle, ratio / slide_ratio
    if force == "Fx":
        own, other = other, own
    near, mirrored = _rough(own, own, shape.slip), _rough(own, -own, shape.slip)
    parity = 0.5 * (1.0 + EVEN) * near - 0.5 * (1.0 - EVEN) * mirrored
    spread = _bell(np.log(loads), shape.load) * _bell(np.log(pressure), shape.load)
    spread = spread * _bell(camber, CAMBER_LENGTH) * _rough(other, other, shape.slip)
    size = (loads / load) ** (1.5 if force == "Mz" else 1.0)
    return np.asarray(2.0 * parity * spread * np.outer(size, size))


def _bell(a: FloatArray, length: float) -> FloatArray:
    return np.asarray(np.exp(-0.5 * ((a[:, None] - a) / length) ** 2))


def _rough(a: FloatArray, b: FloatArray, length: float) -> FloatArray:
    """Return Matern's covariance of order 3/2: once differentiable, as the brush is at zero."""
    far = np.sqrt(3.0) * np.abs(a[:, None] - b) / length
    return np.asarray((1.0 + far) * np.exp(-far))


def _told(cells: Cells, load: float) -> ForceMisfit:
    """Weigh the shapes of one force's misfit by their restricted likelihood."""
    take = np.arange(cells.misfit.size)
    if take.size > _MOST_FOR_LENGTHS:
        take = np.random.default_rng(0).permutation(take)[:_MOST_FOR_LENGTHS]
    at = cells.at[:, take]
    left, size, _ = np.linalg.svd(cells.slope[take], full_matrices=True)
    rank = int((size > 1e-7 * size[0]).sum()) if size.size else 0
    rest = left[:, rank:].T
    misfit = rest @ cells.misfit[take]
    freedom = misfit.size
    shapes = [Shape(LENGTHS[0], LOAD_LENGTHS[0], 0.0)]
    shapes += [Shape(*each) for each in product(LENGTHS, LOAD_LENGTHS, SHARES)]
    if freedom < FEWEST_FREEDOMS:
        return ForceMisfit(cells, shapes[0], float("inf"), freedom, 0.0)
    score, variance = np.empty(len(shapes)), np.empty(len(shapes))
    scatter = rest @ ((at[0] / load)[:, None] ** 2 * rest.T)
    for i, shape in enumerate(shapes):
        smooth = rest @ kernel(cells.force, shape, at, load) @ rest.T
        K = shape.share * smooth + (1.0 - shape.share) * scatter
        root = cho_factor(K + _FLOOR * np.trace(K) / freedom * np.eye(freedom), lower=True)
        variance[i] = float(misfit @ cho_solve(root, misfit)) / freedom
        half = float(np.log(np.diag(root[0])).sum())
        score[i] = -half - 0.5 * freedom * np.log(max(variance[i], _TINY))
    best = int(np.argmax(score))
    evidence = float(score[best] + np.log(np.mean(np.exp(score - score[best]))))
    return ForceMisfit(cells, shapes[best], float(variance[best]), freedom, evidence)
