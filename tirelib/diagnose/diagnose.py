"""The verdict: rounds of ranking, refit and threshold, at most three."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.candidates import Candidates, candidates
from tirelib.diagnose.ensemble import MEMBERS, Ensemble, structural_ensemble
from tirelib.diagnose.ranking import Ranking, Scores
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data

ALARM = 3.0
"""Score over the ensemble's largest from which an effect is an alarm; from 1 on it is a hint."""
HELPS = 0.97
"""Error of the exact refit with an effect, over that without, up to which it is kept."""
FURTHER = 6.0
"""The same for a further effect: the law of the one before is right but roughly."""
LEAST_SHARE = 0.25
"""Share of the left misfit that has to come back without an effect for it to matter."""
ROUNDS = 3
FORM = 1.6
"""Rms left after the joint fit, over the ensemble's largest, from which a law's form is doubted."""
UNKNOWN = 1.3
"""The same, from which an unexplained misfit is called unknown when no effect is named."""
OUTSIDE_SHARE = 0.3
"""Share of the left misfit from which an effect outside its range speaks for something unknown."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""
TOP_SHARE = 0.6
"""Score of a twin, over the leader's, from which the two cannot be told apart."""
TWIN_REFIT = 1.05
"""Ratio of the two refits' errors up to which they cannot be told apart."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One candidate as it stands in the end."""

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
    left, floor : float, [-]
        Rms of the whitened residual after the joint fit, and the ensemble's largest.
    rounds : int
    runs : StraightRuns
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
    first = candidates(data, base, catalogue)
    ranking = Ranking(base, first)
    scores = ranking.scores(data.strain - base.waveform)
    noise = runs.noise.std if np.isfinite(runs.noise.std) else 3e-6
    ensemble = structural_ensemble(
        data, base, ranking, noise=noise, members=members, seed=seed, progress=progress
    )
    thresholds = dict(zip(_names(first), ensemble.threshold, strict=True))

    # the joint ranking sees all effects at once: who is no suspect now is none later
    suspects = set(np.array(_names(first))[_alarms(first, scores, thresholds)])
    model, found, now = base, first, scores
    named: list[str] = []
    rounds = 0
    while rounds < ROUNDS:
        bar = FURTHER if named else ALARM
        best = _leader(found, now, thresholds, suspects, bar)
        if best is None:
            break
        effect = found.living[best].effect
        suspects.discard(effect.name)
        rounds += 1
        try:
            trial = refit(
                data, model.values, [*model.effects, effect],
                [*model.strengths, _inside(effect, now.strength[best])], progress=progress,
            )  # fmt: skip
        except TirelibError:
            continue
        if trial.error > HELPS * model.error:
            continue  # to first order only: the exact refit does not need it
        model = trial
        named.append(effect.name)
        found = candidates(data, model, catalogue)
        now = Ranking(model, found).scores(data.strain - model.waveform)
    named = _still_needed(named, model)
    findings = _findings(first, scores, thresholds, ensemble, named, model, data, base)
    twins = _inseparable(findings, named, data, base)
    verdict = _verdict(named, twins, now, ensemble, scores, first)
    if verdict == "indistinguishable":
        named = [named[0], *twins]
    return Diagnosis(
        verdict, tuple(named), findings, first.dead, base, model, now.after,
        float(ensemble.after.max()), rounds, runs, data,
    )  # fmt: skip


def _names(found: Candidates) -> list[str]:
    return [candidate.effect.name for candidate in found.living]


def _ratio(found: Candidates, scores: Scores, thresholds: Mapping[str, float]) -> FloatArray:
    limits = np.array([thresholds.get(name, np.inf) for name in _names(found)])
    ratio: FloatArray = scores.score / limits
    return ratio


def _in_range(found: Candidates, scores: Scores) -> BoolArray:
    good = []
    for candidate, strength, std in zip(found.living, scores.strength, scores.std, strict=True):
        effect = candidate.effect
        slack = RANGE_SLACK * std
        good.append(
            bool(((strength >= effect.low - slack) & (strength <= effect.high + slack)).all())
        )
    return np.array(good, dtype=bool)


def _alarms(found: Candidates, scores: Scores, thresholds: Mapping[str, float]) -> BoolArray:
    """Return which effects are in range, beyond the variants' scores, and matter."""
    ratio = _ratio(found, scores, thresholds)
    out: BoolArray = _in_range(found, scores) & (ratio >= ALARM) & (scores.share >= LEAST_SHARE)
    return out


def _leader(
    found: Candidates,
    scores: Scores,
    thresholds: Mapping[str, float],
    suspects: set[str],
    bar: float,
) -> int | None:
    """Return the index of the suspect that explains most, or None."""
    if not found.living:
        return None
    fit = _alarms(found, scores, thresholds) & np.isin(_names(found), list(suspects))
    fit &= _ratio(found, scores, thresholds) >= bar
    if not fit.any():
        return None
    return int(np.argmax(np.where(fit, scores.share, -np.inf)))


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


def _findings(
    found: Candidates,
    scores: Scores,
    thresholds: Mapping[str, float],
    ensemble: Ensemble,
    named: Sequence[str],
    model: Refit,
    data: Data,
    base: Refit,
) -> tuple[Finding, ...]:
    ratio, inside = _ratio(found, scores, thresholds), _in_range(found, scores)
    alarms = _alarms(found, scores, thresholds)
    fitted = {effect.name: k for k, effect in enumerate(model.effects)}
    rows = []
    for i, candidate in enumerate(found.living):
        name = candidate.effect.name
        level = "alarm" if alarms[i] else "hint" if ratio[i] >= 1.0 else "quiet"
        strength, std = scores.strength[i], scores.std[i]
        if name in named:
            strength, std = model.strengths[fitted[name]], model.strength_std(fitted[name])
        rows.append(
            Finding(
                candidate.effect,
                float(scores.score[i]),
                float(thresholds[name]),
                level,
                strength,
                std,
                bool(inside[i]),
                float(scores.share[i]),
                tuple(found.twins(i)),
                _power(candidate.signal, scores, ensemble, i, data),
                _error_with(candidate.own, data, base),
            )
        )
    order = {name: k for k, name in enumerate(named)}
    rows.sort(key=lambda f: (order.get(f.effect.name, len(order)), -f.score / f.threshold))
    return tuple(rows)


def _power(signal: float, scores: Scores, ensemble: Ensemble, index: int, data: Data) -> float:
    """Return the chance that a third of the range would be an alarm, by the ensemble's spread."""
    left = float(np.median(ensemble.after))
    planted = (signal / 3.0) ** 2 / data.strain.size / left
    limit = ALARM * float(ensemble.scores[:, index].max())
    reached = planted + ensemble.scores[:, index] >= limit
    return float(np.mean(reached))


def _error_with(own: FloatArray, data: Data, base: Refit) -> float:
    """Return the error that would be left with this effect alone, to first order."""
    rest = base.whiten(data.strain - base.waveform).ravel()
    weights = np.linalg.lstsq(own.T, rest, rcond=None)[0]
    left = rest - weights @ own
    return float(np.sqrt(np.mean(left**2)))


def _inseparable(
    findings: Sequence[Finding], named: Sequence[str], data: Data, base: Refit
) -> list[str]:
    """Return alarms that look like the leader and serve as well when they are refitted."""
    if not named:
        return []
    by_name = {finding.effect.name: finding for finding in findings}
    leader = by_name[named[0]]
    rivals = []
    for name, _ in leader.twins:
        rival = by_name[name]
        strong = rival.score / rival.threshold >= TOP_SHARE * leader.score / leader.threshold
        if strong and rival.in_range:
            rivals.append(rival)
    alike = []
    for rival in rivals[:2]:
        try:
            mine = refit(
                data, base.values, [leader.effect], [_inside(leader.effect, leader.strength)]
            )
            other = refit(
                data, base.values, [rival.effect], [_inside(rival.effect, rival.strength)]
            )
        except TirelibError:
            continue
        if other.error <= TWIN_REFIT * mine.error:
            alike.append(rival.effect.name)
    return alike


def _verdict(
    named: Sequence[str],
    twins: Sequence[str],
    last: Scores,
    ensemble: Ensemble,
    first: Scores,
    found: Candidates,
) -> str:
    floor = float(ensemble.after.max())
    if named:
        if twins and len(named) == 1:
            return "indistinguishable"
        return "form_inadequate" if last.after > FORM * floor else "named"
    outside = ~_in_range(found, first) & (first.share > OUTSIDE_SHARE)
    if first.after > UNKNOWN * floor or (outside.any() and first.after > floor):
        return "unknown"
    return "none"
