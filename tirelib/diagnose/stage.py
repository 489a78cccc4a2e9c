"""A model with its candidates scored, against what the same scores do without any effect."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.candidates import Candidates, candidates
from tirelib.diagnose.ensemble import ALIKE, Variants
from tirelib.diagnose.noise import WhiteNoise
from tirelib.diagnose.ranking import Ranking, Scores, limits
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.secants import with_secants
from tirelib.diagnose.shape import structure_of
from tirelib.diagnose.structure import FORM, LEAST, spread_of
from tirelib.diagnose.unlisted import UNLISTED, with_unlisted
from tirelib.effects import Effect
from tirelib.identify.waveform_fit import Data

ALARM = 3.5
"""Score over the variants' largest from which an effect is an alarm; from 1 on it is a hint."""
NEAR, ALONE, RIVALS = 0.3, 0.6, 3
"""Shares of the leader's ratio, or of what it takes away alone, from which a hint is its rival and
refitted as well; and how many are refitted at most."""
OWN = (0.8, 1.25)
"""Misfit that an effect takes away beside all others, over what it takes alone, where it has little
to do with them: no other could take it instead, and it needs none to take it."""
USUAL = 0.05
"""Share of s^2 in every sample that structure outside the ensemble leaves at most."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""
IMITATION = 0.05
"""Share of the range by which structure may imitate an effect that cannot be: it cannot be named,
but tells of nothing unknown. What the metric has as structure is not imitated beyond that."""


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
        Largest score of the variants (`tirelib.diagnose.ranking.limits`).
    noise : WhiteNoise
    in_range : shape (n_candidates,)
        Whether an effect may be named: in the catalogue, with a plausible strength and sign.
    impossible : shape (n_candidates,)
        Whether an effect of the catalogue lies outside its range.
    over : shape (n_candidates,)
        Whether it lies there by its size alone, not by its sign, or has several components, which
        first order may mix: only an exact refit tells where it is.
    far : shape (n_candidates,)
        Whether it lies farther outside than structure imitates.
    unlisted : shape (n_candidates,)
        Whether it is in no catalogue, and like nothing there.
    """

    model: Refit
    found: Candidates
    ranking: Ranking
    scores: Scores
    limit: FloatArray
    noise: WhiteNoise
    in_range: BoolArray
    impossible: BoolArray
    over: BoolArray
    far: BoolArray
    unlisted: BoolArray

    @classmethod
    def of(
        cls,
        data: Data,
        model: Refit,
        catalogue: Sequence[Effect],
        rests: Variants,
        noise: WhiteNoise,
        least: Mapping[str, float],
    ) -> "Stage":
        """Return the stage of a model.

        Parameters
        ----------
        rests : Variants
        noise : WhiteNoise
        least : mapping of name to float
            Limits that hold already: no effect added makes one smaller.
        """
        found = candidates(data, model, with_unlisted([*catalogue, *model.effects]))
        structure = structure_of(data, model, rests, noise.smooth)
        found = with_secants(data, model, found, structure)
        ranking = Ranking(model, found, structure)
        # what the fitted delay took is weighed against the effects, as likely as delays are
        scores = ranking.scores(data.strain - model.on_time(data.points).waveform)
        members = ranking.of_members()
        names = [candidate.effect.name for candidate in found.living]
        bound = np.array([least.get(name, 0.0) for name in names])
        limit = limits(members, [len(candidate.own) for candidate in found.living])
        return cls(
            model,
            found,
            ranking,
            scores,
            np.maximum(limit, bound),
            noise,
            *_ranges(found, scores),
            ~_listed(found) & ~_has_twin(found),
        )

    def of_residual(self, residual: FloatArray) -> "Stage":
        """Return the stage with another residual (n_runs, n_phi), free of delay.

        Candidates and limits stay: effects are followed as far as the campaign's residual asks.
        """
        scores = self.ranking.scores(residual)
        in_range, impossible, over, far = _ranges(self.found, scores)
        return replace(
            self, scores=scores, in_range=in_range, impossible=impossible, over=over, far=far
        )

    @property
    def names(self) -> list[str]:
        """Of the living candidates."""
        return [candidate.effect.name for candidate in self.found.living]

    @property
    def unit(self) -> float:
        """Misfit that noise and structure outside the ensemble leave at most, before a joint fit.

        Noise is taken to be such everywhere as smooth shapes meet it.
        """
        usual = self.noise.smooth**2 + USUAL * LEAST**2
        return self.model.waveform.size * usual / self.ranking.structure.variance

    @property
    def beyond(self) -> float:
        """What the joint fit leaves, over what noise and structure outside the ensemble leave then.

        Of the noise that is at most the variance of a sample.
        """
        usual = self.noise.sample**2 + USUAL * spread_of(0.0, len(self.model.waveform)) ** 2
        return (
            self.scores.after * self.ranking.structure.variance / (self.model.waveform.size * usual)
        )

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

    @property
    def independent(self) -> BoolArray:
        """Effects that take away as much beside all others as alone."""
        low, high = OWN
        score, alone = self.scores.score, self.scores.alone
        return np.asarray((score >= low * alone) & (score <= high * alone))

    def leaders(
        self,
        suspects: set[str],
        bar: float,
        clear: float,
        barred: Collection[str] = (),
        *,
        spared: bool = False,
    ) -> list[int]:
        """Return the indices of an alarm from a ratio on and of its rivals, best first.

        None if its ratio is not `clear` times that of every effect outside its range: what imitates
        the impossible so well on this tire may imitate the possible. Where `spared`, those that are
        `independent` need only be clear of the impossible that is so as well: what shares its
        score with others does not take what they take alone. Rivals are hints among the suspects,
        or in no catalogue, that come near in the ratio or in what they take away alone: which of
        them it is, only an exact refit tells. What is too large for its range is among them as long
        as it is not barred.
        """
        ratio, alone = self.ratio, self.scores.alone
        large = self.over & ~np.isin(self.names, list(barred))
        known = ((self.in_range | large) & np.isin(self.names, list(suspects))) | self.unlisted
        fit = known & (ratio >= max(bar, ALARM))
        imitated = float(np.max(ratio, where=self.impossible & ~large, initial=0.0))
        if fit.any() and clear * imitated > float(ratio[fit].max()):
            apart = self.independent
            alike = float(np.max(ratio, where=self.impossible & ~large & apart, initial=0.0))
            known = known & apart & spared & (ratio >= clear * alike)
            fit &= known
        if not fit.any():
            return []
        best = int(np.argmax(np.where(fit, ratio, 0.0)))
        near = (ratio >= NEAR * ratio[best]) | (alone >= ALONE * alone[best])
        fit = known & near & (ratio >= 1.0)
        ranked = np.argsort(np.where(fit, -ratio, np.inf))[: int(fit.sum())]
        return [int(index) for index in ranked[:RIVALS]]

    def unexplained(self, waves: FloatArray) -> FloatArray:
        """Return what neither fit nor structure explains of waves (k, n_runs, n_phi), whitened."""
        rows = self.model.whiten(waves).reshape(len(waves), -1)
        return self.ranking.structure.beyond(rows).reshape(waves.shape)

    @property
    def imitated(self) -> float:
        """Largest ratio of an effect outside its range."""
        return float(np.max(self.ratio, where=self.impossible, initial=0.0))

    @property
    def outside(self) -> float:
        """Largest ratio of an effect far outside its range."""
        return float(np.max(np.where(self.far, self.ratio, 0.0), initial=0.0))


def _ranges(found: Candidates, scores: Scores) -> tuple[BoolArray, BoolArray, BoolArray, BoolArray]:
    """Return which strengths are in range, impossible, over and far (`Stage`)."""
    living, listed = found.living, _listed(found)
    fits, signs = plausible(found, scores), plausible(found, scores, np.inf)
    signs |= np.array([each.effect.components > 1 for each in living], dtype=bool)
    alike = np.array([each.effect in ALIKE for each in living], dtype=bool)
    near = np.where(alike, fits, plausible(found, scores, imitation=IMITATION)).astype(bool)
    return fits & listed, ~fits & listed, ~fits & signs & listed, ~near & listed


def _listed(found: Candidates) -> BoolArray:
    """Return which candidates are in the catalogue."""
    return np.array([each.effect not in UNLISTED for each in found.living], dtype=bool)


def _has_twin(found: Candidates) -> BoolArray:
    """Return which candidates look like an effect of the catalogue."""
    names = {effect.name for effect in UNLISTED}
    twins = [[name for name, _ in found.twins(k)] for k in range(len(found.living))]
    return np.array([bool(set(each) - names) for each in twins], dtype=bool)


def plausible(
    found: Candidates, scores: Scores, form: float = FORM, imitation: float = 0.0
) -> BoolArray:
    """Return which strengths lie in their effects' ranges, to shares of them.

    Parameters
    ----------
    form : float
        Share by which an end other than zero may be off; infinite where only the sign counts.
    imitation : float
        Share by which any end may be.
    """
    good = [
        within(candidate.effect, strength, std, form, imitation)
        for candidate, strength, std in zip(found.living, scores.strength, scores.std, strict=True)
    ]
    return np.array(good, dtype=bool)


def within(
    effect: Effect,
    strength: FloatArray,
    std: FloatArray,
    form: float = FORM,
    imitation: float = 0.0,
) -> bool:
    """Return whether a strength lies in its effect's range, to `RANGE_SLACK` and shares of it.

    An end other than zero is as uncertain as the law.
    """
    slack = RANGE_SLACK * std + imitation * effect.scale
    low = effect.low - slack - (form * effect.scale if effect.low < 0.0 else 0.0)
    high = effect.high + slack + (form * effect.scale if effect.high > 0.0 else 0.0)
    return bool(((strength >= low) & (strength <= high)).all())
