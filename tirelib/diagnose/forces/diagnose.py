"""The verdict on a force: rounds of ranking, exact refits and thresholds, at most three."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.forces.candidates import ForceCandidates, force_candidates
from tirelib.diagnose.forces.ensemble import MEMBERS, ForceEnsemble, force_ensemble
from tirelib.diagnose.forces.fit import ForceFit, Problem, fit_force, with_effect
from tirelib.diagnose.forces.floor import force_floor
from tirelib.diagnose.forces.held_out import ForceFold, errors_of, force_folds, pooled
from tirelib.diagnose.forces.ranking import ForceRanking, ForceScores
from tirelib.diagnose.forces.search import ALARM, ROUNDS, Search, alarms, ratio_of
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.threads import one_thread

FORM = 1.6
"""Rms left after the joint fit, over the ensemble's largest, from which a law's form is doubted."""
STEP_GAIN = 0.995
"""Held-out error of a step over that before, from which a name moves behind the others."""
TWIN_REFIT, TWIN_GAIN = 1.02, 0.5
"""Ratio of two refits' errors up to which, and share of the gain from which, they are alike."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceFinding:
    """One candidate as it stands in the end; errors in [N] or [N m]."""

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
    held_after: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ForceDiagnosis:
    """What a campaign says of a brush.

    Attributes
    ----------
    problem : Problem
    noise : float, [N] or [N m]
        Of a point, from repeats; NaN without.
    repeats : int
    verdict : str
        none, named, form_inadequate, indistinguishable or unknown.
    named : tuple of str
        In the order of what each alone gains on held-out points, best first; one whose gain those
        before it have brought already stands behind the others.
    findings : tuple of ForceFinding
        By rank.
    dead : mapping of name to reason
    base, final : ForceFit
        Without and with the named effects.
    floor : float, [N] or [N m]
        Part of the final error that noise and the brush's structure explain; NaN without repeats.
    left, most_left : float, [-]
        Scaled rms after the joint fit with the named effects, and the ensemble's largest.
    folds : tuple of ForceFold
    held_before, held_final : tuple of float
        Per fold: of the base, and of the model with all named effects.
    steps : tuple of (name, error, held-out error)
        The named effects one after the other.
    rounds : int
    doubts : mapping of name to names
        Effects that are found, with the twins that serve as well in their place. They are held
        back where others are named.
    """

    problem: Problem
    noise: float
    repeats: int
    verdict: str
    named: tuple[str, ...]
    findings: tuple[ForceFinding, ...]
    dead: Mapping[str, str]
    base: ForceFit
    final: ForceFit
    floor: float
    left: float
    most_left: float
    folds: tuple[ForceFold, ...]
    held_before: tuple[float, ...]
    held_final: tuple[float, ...]
    steps: tuple[tuple[str, float, float], ...]
    rounds: int
    doubts: Mapping[str, tuple[str, ...]]


@one_thread()
def diagnose_force(
    problem: Problem,
    values: Mapping[str, float],
    catalogue: Sequence[Effect],
    *,
    noise: float,
    repeats: int,
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ForceDiagnosis:
    """Tell which effects of a catalogue a brush lacks.

    Parameters
    ----------
    problem : Problem
    values : mapping
        Of the model's brush.
    catalogue : sequence of Effect
        Those of stage brush are tried.
    noise, repeats
        Of a point, from repeats; NaN and 0 without.
    effects, strengths
        That the model has already.
    members, seed : int
        Of the structural ensemble.
    progress : callable, optional
    """
    tell = progress or (lambda label: None)
    base = fit_force(problem, values, effects, strengths)
    first = force_candidates(problem, base, catalogue)
    ranking = ForceRanking(problem, base, first)
    scores = ranking.scores(problem.measured - base.predicted)
    ensemble = force_ensemble(
        problem,
        base,
        ranking,
        noise=noise if np.isfinite(noise) else 0.0,
        members=members,
        seed=seed,
        progress=progress,
    )
    limits = dict(zip(first.names, ensemble.threshold, strict=True))
    search = Search(problem, catalogue, limits, base, first, scores)
    while search.rounds < ROUNDS and search.round(tell):
        pass
    search.drop_needless()
    folds = force_folds(problem)
    tell("held-out points")
    held_before = errors_of(problem, base, folds)
    alone = {
        name: _alone(problem, base, search.effect(name), folds)
        for name in first.names
        if name in search.named or search.alarmed(name)
    }
    doubts = _doubts(problem, search, first, scores)
    named, verdict = (
        _by_gain(search.named, alone, folds),
        _verdict(search, doubts, ensemble, scores),
    )
    steps: Steps = ()
    if verdict == "indistinguishable":
        named = list(dict.fromkeys(x for name in named for x in (name, *doubts[name])))
    elif named:
        for name in doubts:
            search.take_out(name)
        named = [name for name in named if name not in doubts]
        named, steps = _in_steps(problem, base, search, named, folds)
    final = search.model
    held_final = errors_of(problem, final, folds) if search.named else held_before
    findings = _findings(problem, base, search, scores, first, ensemble, named, alone, folds)
    return ForceDiagnosis(
        problem,
        noise,
        repeats,
        verdict,
        tuple(named),
        findings,
        first.dead,
        base,
        final,
        force_floor(problem, final if named else base, ensemble.rests, noise),
        search.now.after,
        float(ensemble.after.max()),
        folds,
        held_before,
        held_final,
        steps,
        search.rounds,
        doubts,
    )


def _alone(
    problem: Problem, base: ForceFit, effect: Effect, folds: Sequence[ForceFold]
) -> tuple[ForceFit | None, tuple[float, ...]]:
    """Return the base with one effect, and its held-out errors; nothing if it cannot be fitted."""
    try:
        best = with_effect(problem, base, effect)
    except TirelibError:
        return None, ()
    return best, errors_of(problem, best, folds)


Alone = Mapping[str, tuple[ForceFit | None, tuple[float, ...]]]


def _by_gain(named: Sequence[str], alone: Alone, folds: Sequence[ForceFold]) -> list[str]:
    """Return names by held-out error with each alone; by error where nothing is held out."""

    def key(name: str) -> float:
        fit, held = alone[name]
        error = pooled(held, folds) if held else float("nan")
        if np.isfinite(error):
            return error
        return fit.error if fit is not None else float("inf")

    return sorted(named, key=key)


Steps = tuple[tuple[str, float, float], ...]


def _in_steps(
    problem: Problem,
    base: ForceFit,
    search: Search,
    named: Sequence[str],
    folds: Sequence[ForceFold],
) -> tuple[list[str], Steps]:
    """Return names and their steps; a name whose gain those before it brought stands last."""
    counted = [fold for fold in folds if fold.main]
    held = pooled(errors_of(problem, base, counted), counted)
    model, first, late = base, [], []
    for name in named:
        trial = _joined(problem, model, search, name)
        error = pooled(errors_of(problem, trial, counted), counted)
        if error > STEP_GAIN * held:
            late.append(name)
            continue
        model, held = trial, error
        first.append((name, trial.error, error))
    for name in late:
        model = _joined(problem, model, search, name)
        error = pooled(errors_of(problem, model, counted), counted)
        first.append((name, model.error, error))
    return [name for name, _, _ in first], tuple(first)


def _joined(problem: Problem, model: ForceFit, search: Search, name: str) -> ForceFit:
    """Return a model with one of the named effects more."""
    effects = [effect.name for effect in search.model.effects]
    start = search.model.strengths[effects.index(name)]
    return fit_force(
        problem, model.values, [*model.effects, search.effect(name)], [*model.strengths, start]
    )


def _findings(
    problem: Problem,
    base: ForceFit,
    search: Search,
    scores: ForceScores,
    found: ForceCandidates,
    ensemble: ForceEnsemble,
    named: Sequence[str],
    alone: Alone,
    folds: Sequence[ForceFold],
) -> tuple[ForceFinding, ...]:
    limits = search.limits
    ratio, inside = ratio_of(found, scores, limits), scores.inside
    first = alarms(found, scores, limits)
    fitted = {effect.name: k for k, effect in enumerate(search.model.effects)}
    rows = []
    for i, candidate in enumerate(found.living):
        name = candidate.effect.name
        alarm = first[i] or name in named
        level = "alarm" if alarm else "hint" if ratio[i] >= 1.0 else "quiet"
        strength, std = scores.strength[i], scores.std[i]
        if name in fitted and name in named:
            strength = search.model.strengths[fitted[name]]
            std = search.model.strength_std(fitted[name])
        fit, held = alone.get(name, (None, ()))
        if fit is not None:
            error = fit.error
        else:
            error = _to_first_order(candidate.effect, candidate.own, problem, base)
        rows.append(
            ForceFinding(
                candidate.effect,
                float(scores.score[i]),
                float(limits[name]),
                level,
                strength,
                std,
                bool(inside[i]) or name in named,
                float(scores.share[i]),
                tuple(found.twins(i)),
                _power(candidate.signal, ensemble, i, problem),
                error,
                held or (float("nan"),) * len(folds),
            )
        )
    order = {name: k for k, name in enumerate(named)}
    rows.sort(key=lambda f: (order.get(f.effect.name, len(order)), -f.score / f.threshold))
    return tuple(rows)


def _power(signal: float, ensemble: ForceEnsemble, index: int, problem: Problem) -> float:
    """Return the chance that a third of the range would be an alarm, by the ensemble's spread."""
    left = float(np.median(ensemble.after))
    planted = (signal / 3.0) ** 2 / len(problem) / left
    limit = ALARM * float(ensemble.scores[:, index].max())
    return float(np.mean(planted + ensemble.scores[:, index] >= limit))


def _to_first_order(effect: Effect, own: FloatArray, problem: Problem, base: ForceFit) -> float:
    """Return the error that would be left with this effect alone in its range, to first order."""
    rest = (problem.measured - base.predicted) / problem.scale
    weights = np.linalg.lstsq(own.T, rest, rcond=None)[0]
    weights = np.clip(weights, effect.low / effect.scale, effect.high / effect.scale)
    return problem.scale * float(np.sqrt(np.mean((rest - weights @ own) ** 2)))


def _doubts(
    problem: Problem, search: Search, found: ForceCandidates, scores: ForceScores
) -> dict[str, tuple[str, ...]]:
    """Return named effects in whose place a twin serves as well, with those twins.

    Both refits are exact, the other named effects stay. A drift over the order of measurement is
    such a twin of an effect whose condition went with the order.
    """
    doubts = {}
    for name in search.named:
        if name not in found.names:
            continue
        without = _with_instead(problem, search, name, None)
        alike = []
        for twin, _ in found.twins(found.names.index(name)):
            other = found.names.index(twin)
            if twin in search.named or not scores.inside[other] or without is None:
                continue
            rival = _with_instead(problem, search, name, found.living[other].effect)
            if rival is not None and _serves(rival.error, search.model.error, without.error):
                alike.append(twin)
        if alike:
            doubts[name] = tuple(alike)
    return doubts


def _serves(rival: float, named: float, without: float) -> bool:
    """Whether a rival's error is as good as that with the named effect, beside that with neither.

    Examples
    --------
    >>> _serves(1.01, 1.0, 2.0), _serves(1.1, 1.0, 2.0), _serves(1.015, 1.0, 1.02)
    (True, False, False)
    """
    gain = (without**2 - rival**2) >= TWIN_GAIN * (without**2 - named**2)
    return rival <= TWIN_REFIT * named and gain


def _with_instead(
    problem: Problem, search: Search, name: str, other: Effect | None
) -> ForceFit | None:
    """Return the model with another effect in the place of a named one, or with none there."""
    model = search.model
    kept = [k for k, effect in enumerate(model.effects) if effect.name != name]
    effects, strengths = [model.effects[k] for k in kept], [model.strengths[k] for k in kept]
    if other is not None:
        effects, strengths = [*effects, other], [*strengths, np.zeros(other.components)]
    try:
        return fit_force(problem, model.values, effects, strengths)
    except TirelibError:
        return None


def _verdict(
    search: Search,
    doubts: Mapping[str, Sequence[str]],
    ensemble: ForceEnsemble,
    first: ForceScores,
) -> str:
    most = float(ensemble.after.max())
    if search.named:
        if len(doubts) == len(search.named):
            return "indistinguishable"
        return "form_inadequate" if search.now.after > FORM * most else "named"
    # strengths are held in their ranges, so what only an implausible one explains is left over
    beyond = first.after > most or first.before > float(ensemble.before.max())
    return "unknown" if beyond else "none"
