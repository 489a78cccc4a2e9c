"""The cost of a fit about a point, as the parabola that the slopes there make of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.bounded import bounded_step
from tirelib.inference.statistics.normal import Normal, Weighed
from tirelib.inference.statistics.plain import BASE

LONGEST = 1.0
"""Longest move of a coordinate in one step."""
Ends = tuple[FloatArray, FloatArray]
"""Least and largest value of each coordinate, (n_coordinates,) each."""


def cost_of(
    metric: Weighed, right: FloatArray, square: float, here: FloatArray, widths: FloatArray
) -> float:
    """Return J for a residual with these products, at coordinates with these prior widths."""
    left = square - float(right @ metric.mean(right))
    return left + float(np.sum((here / widths) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """The cost J of `tirelib.inference.statistics.posterior` about a point.

    Attributes
    ----------
    metric : Weighed
    rows : shape (k, n)
        Whitened; the slopes by the coordinates are the first ones.
    here, widths : shape (n_coordinates,)
        Coordinates, and standard deviations of their priors.
    ends : (low, high)
        Least and largest value of each coordinate.
    gram : shape (n_coordinates, n_coordinates)
        Half of the second derivative.
    gradient, deviation : shape (n_coordinates,)
        Half of the fall by each coordinate, and standard deviations.
    cost : float
    """

    metric: Weighed
    rows: FloatArray
    here: FloatArray
    widths: FloatArray
    ends: Ends
    gram: FloatArray
    gradient: FloatArray
    deviation: FloatArray
    cost: float

    @classmethod
    def about(
        cls,
        rows: Mapping[str, FloatArray],
        rest: FloatArray,
        here: FloatArray,
        widths: FloatArray,
        spread: Mapping[str, float],
        ends: Ends,
    ) -> "Quadratic":
        """Return the parabola of whitened rows by name, among them the slopes, and a residual."""
        normal = Normal.of(rows, rest)
        metric = Weighed(normal, normal.spread(spread))
        block = normal.blocks[BASE]
        gram = metric.gram[block, block] + np.diag(widths**-2)
        return cls(
            metric,
            np.concatenate(list(rows.values())),
            here,
            widths,
            ends,
            gram,
            metric.right(normal.right)[block] - here / widths**2,
            np.sqrt(np.diag(np.linalg.inv(gram))),
            cost_of(metric, normal.right, normal.square, here, widths),
        )

    def step(self, damping: float | FloatArray = 0.0) -> FloatArray:
        """Return the step to the bottom, damped relative to the curvature by each coordinate.

        One damping serves all coordinates, or each has its own, (n_coordinates,). None moves by
        more than `LONGEST`: one that would go far does not shorten the way of the others.
        """
        gram = self.gram + np.diag(damping * np.diag(self.gram))
        low, high = self.ends
        low, high = np.maximum(low - self.here, -LONGEST), np.minimum(high - self.here, LONGEST)
        return bounded_step(gram, self.gradient, low, high)

    def fall(self, dz: FloatArray) -> float:
        """Return by how much a step lowers the parabola."""
        return float(2.0 * self.gradient @ dz - dz @ self.gram @ dz)

    def cost_at(self, here: FloatArray, rest: FloatArray) -> float:
        """Return the cost at other coordinates, with the whitened residual (n,) there."""
        return cost_of(self.metric, self.rows @ rest, float(rest @ rest), here, self.widths)
