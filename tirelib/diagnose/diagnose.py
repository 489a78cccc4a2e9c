"""The verdict: rounds of ranking, refit and threshold, at most three."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.candidates import Candidates, candidates
from tirelib.diagnose.ensemble import MEMBERS
from tirelib.diagnose.guess import Guess, guess_law
from tirelib.diagnose.left import left_of
from tirelib.diagnose.noise import noise_in, white_level
from tirelib.diagnose.ranking import Ranking, Scores, limits
from tirelib.diagnose.refit import Refit, refit
from tirelib.diagnose.rivals import inseparable
from tirelib.diagnose.stored import ensemble_of
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data

ALARM = 3.0
"""Score over the variants' largest from which an effect is an alarm; from 1 on it is a hint."""
FURTHER = 4.0
"""The same for a further effect: the law of the one before is right but roughly."""
ROUNDS = 3
OUTSIDE = 3.0
"""Ratio of an effect outside its range from which something unknown is there."""
EXPLAINED = 0.4
"""Share of the misfit beyond the variants' that named effects have to explain."""
BEYOND = 1.5
"""Misfit over the variants' largest from which it is more than the structure of a ring."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""
IMITATION = 0.05
"""Share of the range by which structure may imitate an effect that cannot be: it cannot be named,
but tells of nothing unknown."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One candidate as it stands in the end.

    Attributes
    ----------
    effect : Effect
    score, threshold : float
        Misfit that returns without it, and the largest such of the variants.
    level : str
        alarm, hint or quiet.
    strength, std : shape (components,)
    in_range : bool
    share : float
        Of the misfit, what this effect alone takes away.
    twins : tuple of (name, angle [rad])
    power : float
        Chance that a third of the range is an alarm, by planting it in every variant.
    error_after : float
        Rms whitened residual with this effect alone, to first order.
    """

    effect: Effect
    score: float
    threshold: float
    level: str
    strength: FloatArray
    std: FloatArray
    in_range: bool
    share: float
    twins: tuple[tuple[str, float], ...]
    power: float
    error_after: float


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What a campaign says of a model.

    Attributes
    ----------
    verdict : str
        none, named, form_inadequate, indistinguishable or unknown.
    named : tuple of str
        Best first.
    findings : tuple of Finding
        By rank.
    dead : mapping of name to reason
    base, final : Refit
        Without and with the named effects.
    left, floor : float
        Misfit with the named effects, and the largest of the variants.
    rounds : int
    runs : StraightRuns
    data : Data
    beyond : shape (n_runs, n_phi)
        Whitened part of model less measured that neither the model nor structure explains.
    guess : Guess or None
        A law for it, if it is more than variants leave and a sparse one holds.
    """

    verdict: str
    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    dead: Mapping[str, str]
    base: Refit
    final: Refit
    left: float
    floor: float
    rounds: int
    runs: StraightRuns
    data: Data
    beyond: FloatArray
    guess: Guess | None


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
    misfits : shape (n_members,)
        Of the variants, without any effect.
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
    misfits: FloatArray
    in_range: BoolArray
    far: BoolArray

    @classmethod
    def of(
        cls,
        data: Data,
        model: Refit,
        catalogue: Sequence[Effect],
        rests: FloatArray,
        noise: float,
        least: Mapping[str, float],
    ) -> "Stage":
        """Return the stage of a model.

        Parameters
        ----------
        rests : shape (n_members, n_runs * n_phi)
            The variants' whitened residuals.
        noise : float, [-]
            Of a whitened sample.
        least : mapping of name to float
            Limits that hold already: no effect added makes one smaller.
        """
        found = candidates(data, model, catalogue)
        ranking = Ranking(model, found, rests, noise)
        scores = ranking.scores(data.strain - model.waveform)
        members = ranking.of_members()
        names = [candidate.effect.name for candidate in found.living]
        bound = np.array([least.get(name, 0.0) for name in names])
        return cls(
            model, found, ranking, scores, np.maximum(limits(members), bound),
            np.array([member.misfit for member in members]), plausible(found, scores),
            ~plausible(found, scores, IMITATION),
        )  # fmt: skip

    @property
    def names(self) -> list[str]:
        """Of the living candidates."""
        return [candidate.effect.name for candidate in self.found.living]

    @property
    def ratio(self) -> FloatArray:
        """Scores over the variants' largest."""
        ratio: FloatArray = self.scores.score / self.limit
        return ratio

    @property
    def alarms(self) -> BoolArray:
        """Effects in range whose scores no variant comes near."""
        return np.asarray(self.in_range & (self.ratio >= ALARM))

    def leader(self, suspects: set[str], bar: float) -> int | None:
        """Return the index of the first suspect among the alarms from a ratio on, or None.

        None as well if an effect outside its range explains more: then none inside does.
        """
        ratio = self.ratio
        fit = self.alarms & (ratio >= bar) & np.isin(self.names, list(suspects))
        if not fit.any() or self.outside > float(ratio[fit].max()):
            return None
        return int(np.argmax(np.where(fit, ratio, -np.inf)))

    def beyond(self, waves: FloatArray) -> FloatArray:
        """Return what neither fit nor structure explains of waves (k, n_runs, n_phi), whitened."""
        rows = self.model.whiten(waves).reshape(len(waves), -1)
        return self.ranking.structure.beyond(rows).reshape(waves.shape)

    @property
    def outside(self) -> float:
        """Largest ratio of an effect far outside its range."""
        return float(np.max(np.where(self.far, self.ratio, 0.0), initial=0.0))


def plausible(found: Candidates, scores: Scores, share: float = 0.0) -> BoolArray:
    """Return which strengths lie in their effects' ranges, to `RANGE_SLACK` and a share of them."""
    good = []
    for candidate, strength, std in zip(found.living, scores.strength, scores.std, strict=True):
        effect = candidate.effect
        slack = RANGE_SLACK * std + share * effect.scale
        inside = (strength >= effect.low - slack) & (strength <= effect.high + slack)
        good.append(bool(inside.all()))
    return np.array(good, dtype=bool)


def diagnose(
    runs: StraightRuns,
    values: Mapping[str, float | FloatArray],
    catalogue: Sequence[Effect],
    *,
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Tell which effects of a catalogue a model lacks.

    Parameters
    ----------
    runs : StraightRuns
    values : mapping
        Of the model's tire.
    catalogue : sequence of Effect
    effects, strengths
        That the model has already.
    members, seed : int
        Of the structural ensemble.
    progress : callable, optional
    """
    data = runs.data(with_deflection=False)
    base = refit(data, values, effects, strengths, progress=progress)
    noise = noise_in(runs)
    rests = ensemble_of(data, base, noise=noise, members=members, seed=seed, progress=progress)
    level = white_level(runs, base, data.strain)
    first = Stage.of(data, base, catalogue, rests, level, {})
    stage, named, rounds = _rounds(data, first, catalogue, rests, level, progress)
    named = _still_needed(named, stage.model)
    findings = _findings(first, named, stage.model, data)
    twins = inseparable(data, first, findings, named)
    verdict, named = _verdict(named, twins, first, stage)
    last = stage if named else first
    left, floor = last.scores.misfit, float(last.misfits.max())
    beyond = last.beyond(last.model.waveform[None] - data.strain)[0]
    guess = None
    if left > floor or verdict == "unknown":
        guess = guess_law(
            data.strain - last.model.waveform, last.model.waveform, data.points,
            left_of(data, last.model).edges, last.beyond,
        )  # fmt: skip
    return Diagnosis(
        verdict, tuple(named), findings, first.found.dead, base, last.model, left, floor, rounds,
        runs, data, beyond, guess,
    )  # fmt: skip


def _rounds(
    data: Data,
    first: Stage,
    catalogue: Sequence[Effect],
    rests: FloatArray,
    level: float,
    progress: Callable[[str], None] | None,
) -> tuple[Stage, list[str], int]:
    """Add the leaders one after the other as long as the exact refit needs them."""
    # the joint ranking sees all effects at once: who is no suspect now is none later
    suspects = {name for name, alarm in zip(first.names, first.alarms, strict=True) if alarm}
    least = dict(zip(first.names, first.limit, strict=True))
    named: list[str] = []
    stage, rounds = first, 0
    while rounds < ROUNDS:
        best = stage.leader(suspects, FURTHER if named else ALARM)
        if best is None:
            break
        effect = stage.found.living[best].effect
        suspects.discard(effect.name)
        rounds += 1
        model = stage.model
        try:
            trial = refit(
                data, model.values, [*model.effects, effect],
                [*model.strengths, _inside(effect, stage.scores.strength[best])],
                progress=progress,
            )  # fmt: skip
        except TirelibError:
            continue
        after = Stage.of(data, trial, catalogue, rests, level, least)
        if stage.scores.misfit - after.scores.misfit < ALARM * stage.limit[best]:
            continue  # to first order only: the exact refit does not need it
        stage = after
        named.append(effect.name)
    return stage, named, rounds


def _inside(effect: Effect, strength: FloatArray) -> FloatArray:
    """Return a start for a refit within the range."""
    start: FloatArray = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
    return start


def _still_needed(named: list[str], model: Refit) -> list[str]:
    """Drop names whose strength the last refit takes back to zero."""
    kept = []
    for index, effect in enumerate(model.effects):
        if effect.name not in named:
            continue
        strength, std = model.strengths[index], model.strength_std(index)
        if (np.abs(strength) > 3.0 * std).any():
            kept.append(effect.name)
    return sorted(kept, key=named.index)


def _findings(first: Stage, named: Sequence[str], model: Refit, data: Data) -> tuple[Finding, ...]:
    ratio, inside, alarms, limit = first.ratio, first.in_range, first.alarms, first.limit
    scores = first.scores
    fitted = {effect.name: k for k, effect in enumerate(model.effects)}
    rows = []
    for i, candidate in enumerate(first.found.living):
        name = candidate.effect.name
        strength, std = scores.strength[i], scores.std[i]
        if name in named:
            strength, std = model.strengths[fitted[name]], model.strength_std(fitted[name])
        rows.append(
            Finding(
                candidate.effect,
                float(scores.score[i]),
                float(limit[i]),
                "alarm" if alarms[i] else "hint" if ratio[i] >= 1.0 else "quiet",
                strength,
                std,
                bool(inside[i]),
                float(scores.alone[i] / scores.misfit),
                tuple(first.found.twins(i)),
                _power(first, i),
                _error_with(candidate.own, data, first.model),
            )
        )
    order = {name: k for k, name in enumerate(named)}
    rows.sort(key=lambda f: (order.get(f.effect.name, len(order)), -f.score / f.threshold))
    return tuple(rows)


def _power(stage: Stage, index: int) -> float:
    """Return in which share of the variants a third of the range would be an alarm."""
    effect = stage.found.living[index].effect
    third = effect.toward / effect.scale / 3.0
    return float(np.mean(stage.ranking.planted(index, third) >= ALARM * stage.limit[index]))


def _error_with(own: FloatArray, data: Data, base: Refit) -> float:
    """Return the error that would be left with this effect alone, to first order."""
    rest = base.whiten(data.strain - base.waveform).ravel()
    weights = np.linalg.lstsq(own.T, rest, rcond=None)[0]
    left = rest - weights @ own
    return float(np.sqrt(np.mean(left**2)))


def _verdict(
    named: list[str], twins: Sequence[str], first: Stage, last: Stage
) -> tuple[str, list[str]]:
    """Return the verdict and what it names."""
    excess = first.scores.misfit - float(np.median(first.misfits))
    left = last.scores.misfit - float(np.median(last.misfits))
    beyond = last.scores.misfit > BEYOND * float(last.misfits.max())
    if not named:
        return ("unknown" if beyond or last.outside >= OUTSIDE else "none"), []
    if beyond and left > (1.0 - EXPLAINED) * excess:
        return "unknown", []
    if twins and len(named) == 1:
        return "indistinguishable", [named[0], *twins]
    return ("form_inadequate" if beyond else "named"), named
