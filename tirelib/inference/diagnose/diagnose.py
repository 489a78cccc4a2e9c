"""Which effects a model of strain lacks, by `tirelib.inference.statistics`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.effects import Effect
from tirelib.inference.diagnose.guess import Guess, guess_law
from tirelib.inference.diagnose.strain_models import Fitted, StrainModels
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.identify.span import span
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.plain import BASE, ROUGHLY, Family, load
from tirelib.inference.statistics.problem import Problem
from tirelib.inference.statistics.select import Verdict, select

TABLE = Path(__file__).parents[1] / "statistics" / "plain_tires.npz"
"""What plain tires show (`build/structure/learn.py`)."""
TWIN_ANGLE = np.deg2rad(30.0)
"""Signatures closer than this are called twins; it decides nothing."""
FALSE_ALARM = 0.05


@dataclass(frozen=True, slots=True)
class Finding:
    """One candidate.

    Attributes
    ----------
    score, threshold : float
        Standard score beside the model as it is, zero where it is not positive, and the score that
        plain tires exceed with the false-alarm probability.
    level : str
        alarm for members of a named set, hint for members of other smallest sets, else quiet.
    p, p_std : float
        p-value of the hypothesis that this effect is missing and no other.
    gain : float
        Log likelihood of this hypothesis with an exact law over that of the model as it is, [nats];
        to first order where it was not fitted.
    strength, std : shape (components,)
    share : float
        Part of the squared error that this effect alone takes away, to first order.
    twins : tuple of (name, angle [rad])
    power : float
        Chance that a third of the range has a score beyond the threshold.
    """

    effect: Effect
    score: float
    threshold: float
    level: str
    p: float
    p_std: float
    gain: float
    strength: FloatArray
    std: FloatArray
    in_range: bool
    share: float
    twins: tuple[tuple[str, float], ...]
    power: float

    @property
    def at_most_hint(self) -> "Finding":
        """The finding where nothing may be an alarm."""
        return replace(self, level="hint") if self.level == "alarm" else self

    def entry(self, rank: int, error_after: float, held_out: float) -> dict[str, Any]:
        """Return the candidate of a document, with its rank from one.

        The errors are those with it alone, the second on held-out data; NaN if unknown.
        """
        effect = self.effect
        return {
            "effect": effect.name,
            "title": effect.title,
            "rank": rank,
            "score": self.score,
            "threshold": self.threshold,
            "level": self.level,
            "p": self.p,
            "p_std": self.p_std,
            "gain": self.gain,
            "strength": strength_told(self.strength),
            "std": strength_told(self.std),
            "unit": effect.unit,
            "range": [effect.low, effect.high],
            "in_range": self.in_range,
            "error_after": error_after,
            "heldout_error_after": held_out,
            "share": self.share,
            "twins": twins_told(self.twins),
            "power": self.power,
        }


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What a campaign says of a model.

    Attributes
    ----------
    named : tuple of str
        Effects of the smallest members of the confidence set, best first.
    findings : tuple of Finding
        By rank.
    models : StrainModels
        Everything that was fitted.
    base, final : Fitted
        Without further effects and with those of the best member.
    beyond : shape (n_runs, n_phi) or None
        Whitened part of model less measured that neither the best member nor plain tires explain;
        None where a member of the set is right.
    guess : Guess or None
        A law for it, where a sparse law holds.
    """

    verdict: Verdict
    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    models: StrainModels
    base: Fitted
    final: Fitted
    beyond: FloatArray | None
    guess: Guess | None

    @property
    def problem(self) -> StrainProblem:
        """The problem, its whitening about the model without further effects."""
        return self.models.problem

    @property
    def runs(self) -> StraightRuns:
        """The straight runs."""
        return self.problem.runs

    @property
    def dead(self) -> Mapping[str, str]:
        """Effects that the plan cannot show, with the reason."""
        return self.problem.dead

    @property
    def exceeds(self) -> bool:
        """Whether more is left than plain tires leave."""
        return self.verdict.kind in ("unknown", "form_inadequate")


@cache
def plain_tires() -> tuple[Family, ...]:
    """Return the families of plain tires that come with the library."""
    return load(TABLE)[0]


@one_thread()
def diagnose(
    runs: StraightRuns,
    values: Mapping[str, float | FloatArray],
    catalogue: Sequence[Effect],
    *,
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    false_alarm: float = FALSE_ALARM,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find which effects of a catalogue a model lacks.

    The model is the tire with these values and with the effects that it has already, at these
    strengths; `false_alarm` is the probability with which a plain tire is said to lack something.

    Raises
    ------
    ConvergenceError
        If the model cannot be fitted to the runs.
    """
    given = StrainProblem(runs, values, catalogue, effects, strengths)
    verdict = select(given, plain_tires(), false_alarm=false_alarm, progress=progress)
    models, best = StrainModels(verdict.hypotheses, progress), verdict.best
    problem, base = models.problem, models.at()
    final = models.at(verdict.hypotheses.added(best))
    beyond, guess = None, None
    if verdict.kind in ("unknown", "form_inadequate"):
        reached = final.reached
        beyond = -reached.white_of(_unexplained(best))
        guess = guess_law(
            reached.rest,
            reached.prediction.strain,
            problem.data.points,
            reached.prediction.edges,
            reached.white_of,
        )
    return Diagnosis(
        verdict,
        tuple(dict.fromkeys(name for names in verdict.sets for name in names)),
        findings_of(verdict, problem, base.reached.rest, base.reached.white_of),
        models,
        base,
        final,
        beyond,
        guess,
    )


def _unexplained(best: Hypothesis) -> FloatArray:
    """Return what neither a hypothesis nor plain tires explain, measured less model."""
    rows = np.concatenate(list(best.fit.rows.values()))
    return best.fit.rest - np.tensordot(best.null.explained(), rows, axes=1)


def findings_of(
    verdict: Verdict,
    problem: Problem,
    rest: FloatArray,
    white_of: Callable[[FloatArray], FloatArray],
) -> tuple[Finding, ...]:
    """Return every effect that the plan may show, by rank.

    `rest` (...) is what the model without further effects leaves, measured less model, and
    `white_of` brings rows (k, ...) to the unit of errors.
    """
    first, null = verdict.base, verdict.base.null
    limit = first.limit(verdict.alpha)
    living = {effect.name: effect for effect in problem.living if effect.name in null.names}
    left = null.left(list(living))
    tried = {h.names[-1]: h for h in verdict.tried if len(h.names) == len(first.names) + 1}
    named = verdict.sets[0] if verdict.kind in ("named", "form_inadequate") else ()
    members = {name for names in verdict.sets for name in names}
    best = verdict.best.names if verdict.sets else ()
    own = span(white_of(first.fit.rows[BASE]).reshape(len(first.fit.rows[BASE]), -1).T)
    left_over = white_of(rest).ravel()
    left_over = left_over - own @ (own.T @ left_over)
    rows = []
    for name, effect in living.items():
        alone = tried.get(name)
        fit = verdict.best.fit if name in best else None if alone is None else alone.fit
        if fit is not None:
            k = fit.names.index(name)
            strength, std = fit.strengths[k], fit.std(k)
        else:
            mean, covariance = null.beside(name)
            strength = effect.scale * mean
            std = effect.scale * np.sqrt(np.diag(covariance))
        p, p_std = first.p_of(left[name]) if alone is None else (alone.p, alone.p_std)
        gain = first.gain(name) if alone is None else alone.exact - first.exact
        level = "alarm" if name in named else "hint" if name in members else "quiet"
        rows.append(
            Finding(
                effect,
                max(first.scores[name], 0.0),
                limit,
                level,
                p,
                p_std,
                gain,
                strength,
                std,
                _plausible(effect, strength, 2.0 * std),
                _share(white_of(first.fit.rows[name]), own, left_over),
                twins_of(name, first),
                null.power(name, 1.0 / 3.0, limit),
            )
        )
    every = dict.fromkeys(name for names in verdict.sets for name in names)
    order = {name: k for k, name in enumerate(every)}
    rows.sort(key=lambda f: (order.get(f.effect.name, len(order)), -f.score))
    return tuple(rows)


def _plausible(effect: Effect, strength: FloatArray, slack: FloatArray) -> bool:
    inside = (strength >= effect.low - slack) & (strength <= effect.high + slack)
    return bool(inside.all())


def _share(white: FloatArray, own: FloatArray, rest: FloatArray) -> float:
    """Return the share of the squares that rows take beside the fitted numbers."""
    rows = white.reshape(len(white), -1)
    rows = rows - (rows @ own) @ own.T
    weights = np.linalg.lstsq(rows.T, rest, rcond=None)[0]
    return float(1.0 - np.sum((rest - weights @ rows) ** 2) / np.sum(rest**2))


def twins_of(name: str, first: Hypothesis) -> tuple[tuple[str, float], ...]:
    """Return the effects whose signature is near, nearest first."""
    effects = [other for other in first.null.names if other in first.fit.rows and "," not in other]
    near = [
        (other, first.null.angle(name, other))
        for other in effects
        if other != name and not other.startswith(BASE) and not other.startswith(ROUGHLY)
    ]
    return tuple(sorted((pair for pair in near if pair[1] < TWIN_ANGLE), key=lambda pair: pair[1]))


def twins_told(twins: Sequence[tuple[str, float]]) -> list[dict[str, Any]]:
    """Return twins as documents tell them, angles in deg."""
    return [{"effect": name, "angle_deg": float(np.rad2deg(angle))} for name, angle in twins]


def strength_told(strength: FloatArray) -> float | list[float]:
    """Return a strength as a number, or as a list if it has several components."""
    numbers = [float(x) for x in strength]
    return numbers[0] if len(numbers) == 1 else numbers
