"""The verdict: rounds of ranking, refit and threshold, at most three."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.candidates import Candidates, candidates
from tirelib.diagnose.ensemble import MEMBERS, Variants
from tirelib.diagnose.guess import Guess, guess_law
from tirelib.diagnose.left import left_of
from tirelib.diagnose.noise import noise_in, white_level
from tirelib.diagnose.ranking import Ranking, Scores, limits
from tirelib.diagnose.refit import Refit, refit
from tirelib.diagnose.rivals import inseparable
from tirelib.diagnose.shape import structure_of
from tirelib.diagnose.stored import ensemble_of
from tirelib.diagnose.structure import FORM, LEAST
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data

ALARM = 2.0
"""Score over the variants' largest from which an effect is an alarm; from 1 on it is a hint."""
FURTHER = 2.4
"""The same for a further effect: the law of the one before is right but roughly."""
ROUNDS = 3
OUTSIDE = 3.0
"""Ratio of an effect outside its range from which something unknown is there."""
EXPLAINED = 0.4
"""Share of the misfit beyond structure's that named effects have to explain."""
USUAL, BEYOND = 0.05, 0.57
"""What the joint fit leaves, over what s^2 in every sample would: as much as structure outside the
ensemble usually leaves, and more than it does."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""
IMITATION = 0.1
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
        What the joint fit with the named effects leaves, over noise and `LEAST` in every sample,
        and from where on it is more than structure.
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
        """Misfit of noise and `LEAST` in every sample."""
        s = max(self.noise, LEAST)
        return self.model.waveform.size * s**2 / self.ranking.structure.variance

    @property
    def beyond(self) -> float:
        """What the joint fit leaves, in this unit."""
        return self.scores.after / self.unit

    @property
    def threshold(self) -> FloatArray:
        """The variants' largest scores, more where the joint fit leaves more than usual.

        An effect has to stand out from what nothing explains as well.
        """
        return np.asarray(self.limit * max(1.0, self.beyond / USUAL))

    @property
    def ratio(self) -> FloatArray:
        """Scores over the thresholds."""
        return np.asarray(self.scores.score / self.threshold)

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
    named = stage.model.needed(named)
    findings = _findings(first, named, stage.model, data)
    twins = inseparable(data, first, findings, named)
    verdict, named = _verdict(named, twins, first, stage)
    last = stage if named else first
    left, floor = last.beyond, BEYOND
    beyond = last.unexplained(last.model.waveform[None] - data.strain)[0]
    guess = None
    if left > floor or verdict == "unknown":
        guess = guess_law(
            data.strain - last.model.waveform, last.model.waveform, data.points,
            left_of(data, last.model).edges, last.unexplained,
        )  # fmt: skip
    return Diagnosis(
        verdict, tuple(named), findings, first.found.dead, base, last.model, left, floor, rounds,
        runs, data, beyond, guess,
    )  # fmt: skip


def _rounds(
    data: Data,
    first: Stage,
    catalogue: Sequence[Effect],
    rests: Variants,
    level: float,
    progress: Callable[[str], None] | None,
) -> tuple[Stage, list[str], int]:
    """Add the leaders one after the other as long as the exact refit needs them."""
    # the joint ranking sees all effects at once: who is no hint now is no suspect later
    hints = first.in_range & (first.scores.score >= first.limit)
    suspects = {name for name, hint in zip(first.names, hints, strict=True) if hint}
    least = dict(zip(first.names, first.limit, strict=True))
    named: list[str] = []
    stage, rounds = first, 0
    while rounds < ROUNDS:
        best = stage.leader(suspects, FURTHER if named else ALARM)
        if best is None:
            break
        # the laws of those before are right but roughly: what they may be off by is no effect
        if stage.scores.score[best] < FORM**2 * (first.scores.misfit - stage.scores.misfit):
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


def _findings(first: Stage, named: Sequence[str], model: Refit, data: Data) -> tuple[Finding, ...]:
    ratio, inside, alarms, limit = first.ratio, first.in_range, first.alarms, first.threshold
    scores = first.scores
    fitted = {effect.name: k for k, effect in enumerate(model.effects)}
    rest = first.model.whiten(data.strain - first.model.waveform).ravel()
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
                first.ranking.power(i, ALARM * limit[i]),
                candidate.error_left(rest),
            )
        )
    order = {name: k for k, name in enumerate(named)}
    rows.sort(key=lambda f: (order.get(f.effect.name, len(order)), -f.score / f.threshold))
    return tuple(rows)


def _verdict(
    named: list[str], twins: Sequence[str], first: Stage, last: Stage
) -> tuple[str, list[str]]:
    """Return the verdict and what it names."""
    excess = first.scores.misfit - BEYOND * first.unit
    left = last.scores.misfit - BEYOND * last.unit
    beyond = last.beyond > BEYOND
    if not named:
        return ("unknown" if beyond or last.outside >= OUTSIDE else "none"), []
    if beyond and left > (1.0 - EXPLAINED) * excess:
        return "unknown", []
    if twins and len(named) == 1:
        return "indistinguishable", [named[0], *twins]
    return ("form_inadequate" if beyond else "named"), named
