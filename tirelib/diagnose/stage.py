"""A model with its candidates scored, against what the same scores do without any effect."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.candidates import Candidates, candidates
from tirelib.diagnose.ensemble import Variants
from tirelib.diagnose.ranking import Ranking, Scores, limits
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.shape import structure_of
from tirelib.diagnose.structure import FORM, LEAST
from tirelib.effects import Effect
from tirelib.identify.waveform_fit import Data

ALARM = 3.5
"""Score over the variants' largest from which an effect is an alarm; from 1 on it is a hint."""
NEAR, RIVALS = 0.3, 3
"""Share of the best ratio from which an alarm is a rival of the leader, to be refitted as well, and
how many are at most."""
USUAL = 0.05
"""Share of s^2 in every sample that structure outside the ensemble leaves at most."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""
IMITATION = 0.05
"""Share of the range by which structure may imitate an effect that cannot be: it cannot be named,
but tells of nothing unknown."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A model with its candidates scored, and what the same scores do without any effect.

    Attributes
    ----------
    model : Refit
    found : Candidates
    ranking : Ranking
    scores : Scores
    limit : shape (n_candidates,)
        Largest score of the variants.
    noise : float, [-]
        Of a whitened sample.
    in_range : shape (n_candidates,)
        Whether a strength is plausible, its sign included.
    far : shape (n_candidates,)
        Whether it lies farther outside than structure imitates.
    """

    model: Refit
    found: Candidates
    ranking: Ranking
    scores: Scores
    limit: FloatArray
    noise: float
    in_range: BoolArray
    far: BoolArray

    @classmethod
    def of(
        cls,
        data: Data,
        model: Refit,
        catalogue: Sequence[Effect],
        rests: Variants,
        noise: float,
        least: Mapping[str, float],
    ) -> "Stage":
        """Return the stage of a model.

        Parameters
        ----------
        rests : Variants
        noise : float, [-]
            Of a whitened sample.
        least : mapping of name to float
            Limits that hold already: no effect added makes one smaller.
        """
        found = candidates(data, model, catalogue)
        ranking = Ranking(model, found, structure_of(data, model, rests, noise))
        scores = ranking.scores(data.strain - model.waveform)
        members = ranking.of_members()
        names = [candidate.effect.name for candidate in found.living]
        bound = np.array([least.get(name, 0.0) for name in names])
        return cls(
            model, found, ranking, scores, np.maximum(limits(members), bound),
            noise, plausible(found, scores),
            ~plausible(found, scores, IMITATION),
        )  # fmt: skip

    @property
    def names(self) -> list[str]:
        """Of the living candidates."""
        return [candidate.effect.name for candidate in self.found.living]

    @property
    def unit(self) -> float:
        """Misfit that noise and structure outside the ensemble leave together."""
        usual = self.noise**2 + USUAL * LEAST**2
        return self.model.waveform.size * usual / self.ranking.structure.variance

    @property
    def beyond(self) -> float:
        """What the joint fit leaves, in this unit."""
        return self.scores.after / self.unit

    @property
    def threshold(self) -> FloatArray:
        """The variants' largest scores, more where the joint fit leaves more than usual.

        An effect has to stand out from what nothing explains as well.
        """
        left = self.scores.after / self.model.waveform.size
        return np.asarray(self.limit * np.sqrt(max(1.0, left / USUAL)))

    @property
    def ratio(self) -> FloatArray:
        """Scores over the thresholds."""
        return np.asarray(self.scores.score / self.threshold)

    @property
    def alarms(self) -> BoolArray:
        """Effects in range whose scores no variant comes near."""
        return np.asarray(self.in_range & (self.ratio >= ALARM))

    def leaders(self, suspects: set[str], bar: float) -> list[int]:
        """Return the indices of suspects among the alarms from a ratio on, best first.

        None if an effect outside its range explains more: then none inside does. Those whose ratio
        is less than `NEAR` of the best's are left out.
        """
        ratio = self.ratio
        fit = self.alarms & (ratio >= bar) & np.isin(self.names, list(suspects))
        if not fit.any() or self.outside > float(ratio[fit].max()):
            return []
        fit &= ratio >= NEAR * ratio[fit].max()
        ranked = np.argsort(np.where(fit, -ratio, np.inf))[: int(fit.sum())]
        return [int(index) for index in ranked[:RIVALS]]

    def unexplained(self, waves: FloatArray) -> FloatArray:
        """Return what neither fit nor structure explains of waves (k, n_runs, n_phi), whitened."""
        rows = self.model.whiten(waves).reshape(len(waves), -1)
        return self.ranking.structure.beyond(rows).reshape(waves.shape)

    @property
    def outside(self) -> float:
        """Largest ratio of an effect far outside its range."""
        return float(np.max(np.where(self.far, self.ratio, 0.0), initial=0.0))


def plausible(found: Candidates, scores: Scores, share: float = 0.0) -> BoolArray:
    """Return which strengths lie in their effects' ranges, to `RANGE_SLACK` and a share of them.

    An end other than zero is as uncertain as the law.
    """
    good = []
    for candidate, strength, std in zip(found.living, scores.strength, scores.std, strict=True):
        effect = candidate.effect
        slack = RANGE_SLACK * std + share * effect.scale
        low = effect.low - slack - FORM * effect.scale * (effect.low < 0.0)
        high = effect.high + slack + FORM * effect.scale * (effect.high > 0.0)
        inside = (strength >= low) & (strength <= high)
        good.append(bool(inside.all()))
    return np.array(good, dtype=bool)
