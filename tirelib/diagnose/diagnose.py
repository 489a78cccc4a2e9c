"""The verdict: rounds of ranking, refit and threshold, at most three."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from tirelib.arrays import FloatArray
from tirelib.diagnose.ensemble import MEMBERS
from tirelib.diagnose.floor import usual_size
from tirelib.diagnose.guess import Guess, guess_law
from tirelib.diagnose.left import left_of
from tirelib.diagnose.noise import noise_in, white_noise
from tirelib.diagnose.plain import BELT, usual
from tirelib.diagnose.refit import FELL, Refit, Refits, fall, refit
from tirelib.diagnose.rivals import inseparable
from tirelib.diagnose.rounds import HALVED, Rounds, rounds
from tirelib.diagnose.stage import ALARM, Stage, within
from tirelib.diagnose.stored import ensemble_of
from tirelib.diagnose.unlisted import UNLISTED
from tirelib.effects import Effect
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data
from tirelib.threads import one_thread

OUTSIDE = 3.0
"""Ratio of an effect outside its range from which something unknown is there."""
BARELY = 15.0
"""The same for one that is outside by no more than structure imitates."""
EXPLAINED = 0.8
"""Share of the misfit beyond structure's that named effects have to explain, or `HALVED` of the
squared error: another law of the same effect may leave what no structure does, but takes the error.
"""
BEYOND = 4.0
"""What the joint fit leaves, over what noise and structure outside the ensemble usually leave, from
which on something unknown is there."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One candidate as it stands in the end.

    Attributes
    ----------
    effect : Effect
    score, threshold : float
        Misfit that returns without it, and the largest such that variants are expected to have.
    level : str
        alarm, hint or quiet; what is named is an alarm by its exact fit, whatever first order says,
        and what plain tires show no more than a hint.
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
        What the joint fit with the named effects leaves (without any, if nothing is named), over
        what noise and structure outside the ensemble usually do, and from where on it is more than
        structure.
    rounds : int
    runs : StraightRuns
    data : Data
    beyond : shape (n_runs, n_phi)
        Whitened part of model less measured that neither the model nor structure explains.
    usual : float
        Rms whitened residual that 19 of 20 variants stay below after such a fit.
    guess : Guess or None
        A law for it, if it is more than variants leave and a sparse one holds.
    like : Finding or None
        What else is needed, if that is in no catalogue (`tirelib.diagnose.unlisted`).
    by_share : tuple of str
        What is named for its share of the error beside the belt's shear, whatever its score.
    refitted : Refits
        Fits of these data, made so far and to come.
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
    usual: float
    guess: Guess | None
    like: Finding | None
    by_share: tuple[str, ...]
    refitted: Refits


@one_thread()
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
    level = white_noise(runs, base, data.strain)
    first = Stage.of(data, base, catalogue, rests, level, {})
    refitted = Refits(data, progress)
    found = rounds(data, first, catalogue, rests, level, refitted)
    stage = found.stage
    like = None if found.unlisted is None else _like(first, stage, found.unlisted, data)
    named = stage.model.needed(found.named)
    findings = _findings(first, named, stage.model, data)
    twins = inseparable(data, first, findings, named, refitted)
    verdict, named = _verdict(named, twins, first, found, like)
    if not named:
        findings = _findings(first, (), first.model, data)
    last = stage if named else first
    left, floor = last.beyond, BEYOND
    beyond = last.unexplained(last.model.waveform[None] - data.strain)[0]
    guess = None
    if left > floor or verdict == "unknown":
        guess = guess_law(
            data.strain - last.model.waveform,
            last.model.waveform,
            data.points,
            left_of(data, last.model).edges,
            last.unexplained,
        )
    extra = {effect.name for effect in UNLISTED} - {effect.name for effect in catalogue}
    dead = {name: why for name, why in first.found.dead.items() if name not in extra}
    return Diagnosis(
        verdict,
        tuple(named),
        findings,
        dead,
        base,
        last.model,
        left,
        floor,
        found.count,
        runs,
        data,
        beyond,
        usual_size(last.model, last.ranking.structure.members),
        guess,
        like,
        tuple(name for name in found.by_share if name in named),
        refitted,
    )


def _findings(first: Stage, named: Sequence[str], model: Refit, data: Data) -> tuple[Finding, ...]:
    fitted = {effect.name: k for k, effect in enumerate(model.effects)}
    rows = []
    for index, candidate in enumerate(first.found.living):
        if candidate.effect in UNLISTED:
            continue
        row, name = _finding(first, index, data), candidate.effect.name
        if name in named:
            k = fitted[name]
            strength, std = model.strengths[k], model.strength_std(k)
            row = replace(
                row,
                strength=strength,
                std=std,
                in_range=within(candidate.effect, strength, std),
                level="alarm",
            )
        rows.append(row)
    order = {name: k for k, name in enumerate(named)}
    rows.sort(key=lambda f: (order.get(f.effect.name, len(order)), -f.score / f.threshold))
    return tuple(rows)


def _finding(stage: Stage, index: int, data: Data) -> Finding:
    """Return one candidate as a stage sees it."""
    candidate, scores, limit = stage.found.living[index], stage.scores, stage.threshold[index]
    ratio, strength = stage.ratio[index], scores.strength[index]
    alarm = stage.alarms[index] and not usual(stage.model.effects, candidate.effect, strength)
    return Finding(
        candidate.effect,
        float(scores.score[index]),
        float(limit),
        "alarm" if alarm else "hint" if ratio >= 1.0 else "quiet",
        strength,
        scores.std[index],
        bool(stage.in_range[index]),
        float(scores.alone[index] / scores.misfit),
        _listed(stage.found.twins(index)),
        stage.ranking.power(index, ALARM * limit),
        candidate.alone(data, stage.model)[1],
    )


def _like(first: Stage, stage: Stage, index: int, data: Data) -> Finding:
    """Return what a stage needs in no catalogue, with the error that it leaves the first alone."""
    found = _finding(stage, index, data)
    alone = [each for each in first.found.living if each.effect == found.effect]
    if not alone:
        return found
    return replace(found, error_after=alone[0].alone(data, first.model)[1])


def _listed(twins: Sequence[tuple[str, float]]) -> tuple[tuple[str, float], ...]:
    names = {effect.name for effect in UNLISTED}
    return tuple(twin for twin in twins if twin[0] not in names)


def _verdict(
    named: list[str], twins: Sequence[str], first: Stage, found: Rounds, like: Finding | None
) -> tuple[str, list[str]]:
    """Return the verdict and what it names."""
    last = found.stage
    excess = first.scores.misfit - first.unit
    left = last.scores.misfit - last.unit
    beyond = last.beyond > BEYOND
    if not named:
        outside = last.outside >= OUTSIDE or last.imitated >= BARELY
        return ("unknown" if like or beyond or outside else "none"), []
    explained = (
        left <= max((1.0 - EXPLAINED) * excess, 0.0)
        or fall(first.model, last.model) >= HALVED
        or any(name in named for name in found.by_share)
    )
    hidden = [name for name in named if name not in BELT]
    # the shear that every belt has does not explain what is in no catalogue
    if fall(first.model, last.model) < FELL or not explained or (like and not hidden):
        return "unknown", []
    if twins:
        return "indistinguishable", [*(hidden or named)[:1], *twins]
    return ("form_inadequate" if beyond else "named"), named
