"""The verdict on a force: rounds of ranking, exact refits and thresholds, at most three."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.forces.candidates import ForceCandidates, force_candidates
from tirelib.diagnose.forces.ensemble import MEMBERS, ForceEnsemble, force_ensemble
from tirelib.diagnose.forces.fit import ForceFit, Problem, fit_force, room
from tirelib.diagnose.forces.held_out import ForceFold, errors_of, force_folds, pooled
from tirelib.diagnose.forces.ranking import ForceRanking, ForceScores
from tirelib.diagnose.forces.search import ALARM, ROUNDS, Search, alarms, ratio_of
from tirelib.effects import Effect
from tirelib.errors import TirelibError

FORM = 1.6
"""Rms left after the joint fit, over the ensemble's largest, from which a law's form is doubted."""
STEP_GAIN = 0.995
"""Held-out error of a step over that before, from which a name moves behind the others."""
TOP_SHARE = 0.6
"""Score of a twin, over the leader's, from which the two cannot be told apart."""
TWIN_REFIT = 1.02
"""Ratio of the two refits' errors up to which they cannot be told apart."""


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
        Median error that variants without effect leave to the base.
    left, most_left : float, [-]
        Scaled rms after the joint fit with the named effects, and the ensemble's largest.
    folds : tuple of ForceFold
    held_before, held_final : tuple of float
        Per fold: of the base, and of the model with all named effects.
    steps : tuple of (name, error, held-out error)
        The named effects one after the other.
    rounds : int
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
        problem, base, ranking, noise=noise if np.isfinite(noise) else 0.0, members=members,
        seed=seed, progress=progress,
    )  # fmt: skip
    limits = dict(zip(first.names, ensemble.threshold, strict=True))
    search = Search(problem, catalogue, limits, base, first, scores)
    while search.rounds < ROUNDS and search.round(tell):
        pass
    search.drop_needless()
    folds = force_folds(problem)
    tell("held-out points")
    held_before = errors_of(problem, base, folds)
    alone = {name: _alone(problem, base, search.effect(name), folds) for name in first.names
             if name in search.named or search.alarmed(name)}  # fmt: skip
    twins = _inseparable(first, scores, limits, search, alone)
    verdict = _verdict(search, twins, ensemble, scores)
    final = search.model
    named = _by_gain(search.named, alone, folds)
    steps: Steps = ()
    if verdict == "indistinguishable":
        named = [named[0], *twins]
    elif named:
        named, steps = _in_steps(problem, base, search, named, folds)
    held_final = errors_of(problem, final, folds) if search.named else held_before
    findings = _findings(problem, base, search, scores, first, ensemble, named, alone, folds)
    return ForceDiagnosis(
        problem, noise, repeats, verdict, tuple(named), findings, first.dead, base, final,
        float(np.median(ensemble.before)) * problem.scale, search.now.after,
        float(ensemble.after.max()), folds, held_before, held_final, steps, search.rounds,
    )  # fmt: skip


def _alone(
    problem: Problem, base: ForceFit, effect: Effect, folds: Sequence[ForceFold]
) -> tuple[ForceFit | None, tuple[float, ...]]:
    """Return the base with one effect, and its held-out errors; nothing if it cannot be fitted."""
    low, high = room(problem, base.values, effect)
    best: ForceFit | None = None
    for start in {0.3 * high, 0.3 * low}:
        try:
            found = fit_force(
                problem, base.values, [*base.effects, effect],
                [*base.strengths, np.full(effect.components, start)],
            )  # fmt: skip
        except TirelibError:
            continue
        best = found if best is None or found.error < best.error else best
    return best, () if best is None else errors_of(problem, best, folds)


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
                candidate.effect, float(scores.score[i]), float(limits[name]), level, strength,
                std, bool(inside[i]) or name in named, float(scores.share[i]),
                tuple(found.twins(i)), _power(candidate.signal, ensemble, i, problem), error,
                held or (float("nan"),) * len(folds),
            )
        )  # fmt: skip
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


def _inseparable(
    found: ForceCandidates,
    scores: ForceScores,
    limits: Mapping[str, float],
    search: Search,
    alone: Alone,
) -> list[str]:
    """Return alarms that look like the only named effect and serve as well when refitted."""
    if len(search.named) != 1 or search.named[0] not in found.names:
        return []
    index = found.names.index(search.named[0])
    ratio, inside = ratio_of(found, scores, limits), scores.inside
    mine, _ = alone[search.named[0]]
    alike = []
    for name, _ in found.twins(index):
        other = found.names.index(name)
        if not inside[other] or ratio[other] < TOP_SHARE * ratio[index]:
            continue
        rival, _ = alone.get(name, (None, ()))
        if mine is not None and rival is not None and rival.error <= TWIN_REFIT * mine.error:
            alike.append(name)
    return alike


def _verdict(
    search: Search,
    twins: Sequence[str],
    ensemble: ForceEnsemble,
    first: ForceScores,
) -> str:
    most = float(ensemble.after.max())
    if search.named:
        if twins:
            return "indistinguishable"
        return "form_inadequate" if search.now.after > FORM * most else "named"
    # strengths are held in their ranges, so what only an implausible one explains is left over
    beyond = first.after > most or first.before > float(ensemble.before.max())
    return "unknown" if beyond else "none"
