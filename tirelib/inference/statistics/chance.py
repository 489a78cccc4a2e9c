"""What a plan can find: effects planted in plain tires and judged by the statistic of the verdict.

Plain tires of every family are put into the user's plan
(`tirelib.inference.statistics.hypothesis.plain_tires`), with an effect at a given strength in
addition. Each is judged as the user's tire is, to first order: nothing is missing while its p-value
exceeds the level; else an effect is a member of the confidence set if the p-value does so once it
is fitted. The law is that of the catalogue, and the exact fits of a verdict are left out: the
chances are optimistic.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.inference.statistics.hypothesis import Hypothesis, plain_tires, products
from tirelib.inference.statistics.problem import Problem


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Verdicts on plain tires with something planted, k tires.

    Attributes
    ----------
    effects : tuple of str
    rejected : shape (k,)
        Whether that nothing is missing is out of the confidence set.
    members : shape (n_effects, k)
        Whether each effect alone is in it; False where nothing is missing.
    """

    effects: tuple[str, ...]
    rejected: BoolArray
    members: BoolArray

    def named(self) -> tuple[tuple[str, ...], ...]:
        """Return the effects of every tire's confidence set, by tire."""
        columns = self.members.T
        return tuple(
            tuple(name for name, isin in zip(self.effects, column, strict=True) if isin)
            for column in columns
        )


class Plans:
    """The user's plan with plain tires in it.

    Parameters
    ----------
    problem : Problem
    base : Hypothesis
        That nothing is missing.
    alpha : float
        False-alarm probability.
    repeats : int
        Tires that a planting takes, by turns of every family.
    seed : int
        It decides which plain tires are chosen.
    """

    def __init__(
        self, problem: Problem, base: Hypothesis, alpha: float, repeats: int, seed: int = 0
    ) -> None:
        self.problem, self.base = problem, base
        self.alpha = alpha
        self.effects = tuple(effect.name for effect in problem.living)
        families = [null.family for null in base.nulls]
        random = np.random.default_rng(seed)
        self.tires = []
        for number, family in enumerate(families):
            count = len(range(number, repeats, len(families)))
            every = plain_tires(problem, base.fit, family, {}, base.null.view.own)
            chosen = random.permutation(len(family))[:count]
            self.tires.append((family, every[chosen]))

    def plain(self) -> Judged:
        """Return the verdicts on tires with nothing planted."""
        return self._judged([waves for _, waves in self.tires])

    def planted(self, name: str, strength: float) -> Judged:
        """Return the verdicts on tires that have an effect too.

        Parameters
        ----------
        name : str
        strength : float
            Strength of the effect's first component, in ranges.
        """
        rows = strength * self.base.fit.rows[name][0]
        return self._judged([tires + rows for _, tires in self.tires])

    def _judged(self, waves: Sequence[FloatArray]) -> Judged:
        turned = products(self.problem, self.base.null.view, np.concatenate(waves))
        rejected = self.base.p_values(turned) <= self.alpha
        out = turned[0][:, rejected], turned[1][rejected]
        members = np.zeros((len(self.effects), rejected.size), dtype=bool)
        for inside, name in zip(members, self.effects, strict=True):
            inside[rejected] = self.base.p_values(out, name) > self.alpha
        return Judged(self.effects, rejected, members)

    def ratio(self, name: str, strength: float) -> float:
        """Return the error with an effect planted over that without, to first order.

        Parameters
        ----------
        strength : float
            Strength of the effect's first component, in ranges.
        """
        return float(np.sqrt(1.0 + strength**2 * self._share(name)))

    def strength(self, name: str, ratio: float) -> float:
        """Return the strength in ranges at which the error is larger by a ratio."""
        return float(np.sqrt((ratio**2 - 1.0) / self._share(name)))

    def _share(self, name: str) -> float:
        """Return the squares of what the base cannot take of an effect, over those it leaves."""
        fit = self.base.fit
        base = fit.rows["base"].reshape(len(fit.rows["base"]), -1)
        both = np.stack([fit.rows[name][0].ravel(), fit.rest.ravel()])
        own = both - np.linalg.lstsq(base.T, both.T, rcond=None)[0].T @ base
        return float(np.sum(own[0] ** 2) / np.sum(own[1] ** 2))
