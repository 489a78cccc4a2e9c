"""Plain tires of one family as the yardstick for a tire that is like them.

A user's tire belongs to none of the families, and a test by what its own family shows would be too
sure. So each plain tire is judged by the families other than its own (`tirelib.infer.null`): by
each of them the largest standard score of anything beside the hypothesis, and of these the
smallest, that of the family which excuses most. Scores count in units of this family's own tires.
A user's tire is judged by every family, in the same units. The rank of its statistic among this
family's tires is at least what it would be if it were one of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.infer.null import Null, Products
from tirelib.infer.plain import Family


@dataclass(frozen=True, slots=True, eq=False)
class Judge:
    """Plain tires of one family, judged by the others.

    Attributes
    ----------
    family : Family
    nulls : tuple of Null
        Of every family, in units of this one's tires.
    plain : shape (n_tires,)
        Statistic of each of its tires by the other families, in units of the rest of them.
    """

    family: Family
    nulls: tuple[Null, ...]
    plain: FloatArray

    @classmethod
    def of(cls, family: Family, nulls: Sequence[Null], tires: Products) -> "Judge":
        """Return the judge by what every family says of one family's tires."""
        scores = [null.scores_of(tires) for null in nulls]
        others = [k for k, null in enumerate(nulls) if null.family is not family]
        plain = np.empty(len(family))
        for tire in range(len(family)):
            rest = np.arange(len(family)) != tire
            by = [_units(nulls[k], scores[k][:, rest], scores[k][:, tire]) for k in others]
            plain[tire] = min(float(each.max()) for each in by)
        units = [null.among(each) for null, each in zip(nulls, scores, strict=True)]
        return cls(family, tuple(units), plain)

    @property
    def null(self) -> Null:
        """That of the family which excuses most of the user's residual."""
        return min(self.nulls, key=lambda null: float(null.scores.max()))

    def p(self, statistic: float) -> tuple[float, float]:
        """Return the rank of a statistic among this family's tires, and its standard deviation."""
        count = len(self.plain)
        p = (1 + int(np.sum(self.plain >= statistic))) / (count + 1)
        return p, max(float(np.sqrt(p * (1.0 - p) / count)), 1.0 / (count + 1))

    def p_values(self, products: Products, given: str = "") -> FloatArray:
        """Return the p-values of k residuals, (k,); arguments are those of `Null.scores_of`."""
        largest = np.min([n.scores_of(products, given).max(axis=0) for n in self.nulls], axis=0)
        above = np.sum(self.plain[:, None] >= largest, axis=0)
        return np.asarray((1 + above) / (len(self.plain) + 1))

    def limit(self, alpha: float) -> float:
        """Return the statistic from which on the p-value is at most alpha."""
        return float(np.quantile(self.plain, 1.0 - alpha, method="higher"))


def _units(null: Null, plain: FloatArray, scores: FloatArray) -> FloatArray:
    """Return scores (n_names,) in units of plain tires' (n_names, k)."""
    judged = null.among(plain)
    return (scores - judged.centre) / judged.deviation
