"""The next test for strain and for forces: rivals, what they foretell, and the judged runs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.fit import ForceFit
from tirelib.diagnose.forces.fit import Problem as ForceProblem
from tirelib.effects import Effect
from tirelib.errors import ParameterError, TirelibError
from tirelib.infer.hypothesis import Hypothesis
from tirelib.infer.next_run import next_runs
from tirelib.infer.problem import Point
from tirelib.infer.select import Hypotheses
from tirelib.model.state import Operating
from tirelib.planning.criterion import (
    ENDLESS,
    NOTHING,
    REPEATS,
    NextTest,
    Noise,
    PairForecast,
    judged,
)
from tirelib.planning.envelope import Envelope, operating_at
from tirelib.planning.force_rivals import (
    force_forecasts,
    points_ahead,
    structure_rows,
    try_force_suspects,
)
from tirelib.planning.repeats import PLAN_REPEATS
from tirelib.planning.suspects import Suspects
from tirelib.problems.strain import StrainProblem
from tirelib.threads import one_thread

MANY = 1e3
"""Repeats that stand for endless ones: the noise is far below the misfit of a run then, and normal
equations of still less noise are not accurate."""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A suspect fitted to the present runs, `tirelib.planning.criterion.Rival`."""

    name: str
    cost: float
    strength: FloatArray
    in_range: bool


@dataclass(frozen=True, slots=True)
class StrainTrial:
    """Suspects of strain on the present runs, `tirelib.planning.criterion.Trial`."""

    rivals: tuple[Suspect, ...]
    left_out: dict[str, str]
    size: float


@one_thread()
def next_test(
    hypotheses: Hypotheses,
    suspects: Suspects,
    envelope: Envelope,
    *,
    progress: Callable[[str], None] | None = None,
) -> NextTest:
    """Judge the runs of an envelope by how well they part suspects of strain.

    Parameters
    ----------
    hypotheses : Hypotheses
        About the present runs (a `StrainProblem`).
    suspects : Suspects
    envelope : Envelope
    progress : callable, optional

    Raises
    ------
    ParameterError
        If no run in the envelope has a solution.
    """
    tell = progress or (lambda label: None)
    problem = hypotheses.problem
    assert isinstance(problem, StrainProblem)  # noqa: S101 - forces have their own
    rivals, left_out = _fitted(hypotheses, suspects)
    trial = StrainTrial(
        tuple(_suspect(name, rival, hypotheses) for name, rival in rivals.items()),
        left_out,
        hypotheses.base.null.size.whole,
    )
    noise = Noise(float(np.mean(problem.noise)), problem.own_misfit(hypotheses.own))
    chosen = envelope.grid()
    if len(rivals) < 2:
        return _without(envelope, trial, noise)
    ahead = operating_at(chosen, problem.data.points)
    good = _possible(problem, tuple(rivals.values()), ahead)
    if not good.any():
        raise _hopeless(len(chosen))
    points = chosen[good]
    tell(f"{len(points)} runs with {' and '.join(rivals)}")
    alpha = hypotheses.false_alarm
    parted = next_runs(
        problem.followed_by(ahead.take(good), np.ones(len(points))), tuple(rivals.values()), alpha
    )
    open_ = [pair for pair in parted if not pair.resolved] or parted
    size = np.array([pair.separation for pair in open_])
    chance = np.mean([pair.chance for pair in open_], axis=0)
    hardest = np.argmin(size, axis=0)
    score = np.min(size, axis=0)
    std = np.array([open_[pair].std[run] for run, pair in enumerate(hardest)])
    order = np.lexsort((-score, -np.round(chance, 3)))
    best = operating_at(np.repeat(points[order[:1]], len(REPEATS) + 1, axis=0), problem.data.points)
    tell("repeats of the best run")
    again = next_runs(
        problem.followed_by(best, np.array([*REPEATS, ENDLESS])), tuple(rivals.values()), alpha
    )
    names = list(rivals)
    pairs = tuple(
        PairForecast(
            (names[pair.first], names[pair.second]),
            pair.gap,
            pair.resolved,
            pair.separation[order],
            pair.chance[order],
            dict(zip(REPEATS, repeated.separation.tolist(), strict=False)),
            float(repeated.separation[-1]),
        )
        for pair, repeated in zip(parted, again, strict=True)
    )
    places = [parted.index(pair) for pair in open_]
    return NextTest(
        envelope,
        points[order],
        score[order],
        std[order],
        chance[order],
        tuple(places[k] for k in hardest[order]),
        pairs,
        trial,
        len(chosen) - len(points),
        noise,
    )


def _fitted(
    hypotheses: Hypotheses, suspects: Suspects
) -> tuple[dict[str, Hypothesis], dict[str, str]]:
    """Return the hypotheses of suspects by name, and why others are left out."""
    certain = [effect.name for effect, _ in suspects.beside]
    dead, found, left_out = hypotheses.problem.dead, {}, {}
    for name in suspects.names:
        if name not in hypotheses.effects:
            left_out[name] = dead.get(name, "the model has it")
            continue
        rival = hypotheses.at([*certain, name])
        if rival is None:
            left_out[name] = "no fit with it settles"
        else:
            found[name] = rival
    nothing = hypotheses.at(certain)
    if suspects.with_nothing and nothing is not None:
        found[NOTHING] = nothing
    return found, left_out


def _suspect(name: str, rival: Hypothesis, hypotheses: Hypotheses) -> Suspect:
    strength = np.zeros(0) if name == NOTHING else rival.fit.strengths[-1]
    cost = 2.0 * (hypotheses.base.likelihood - rival.likelihood)
    return Suspect(name, cost, strength, rival.plausible)


def _possible(problem: StrainProblem, rivals: Sequence[Hypothesis], ahead: Operating) -> BoolArray:
    """Return at which points every rival has a solution (tread not pressed through and so on)."""
    good = np.ones(len(ahead), dtype=bool)
    for point in (problem.start, *(rival.fit.point for rival in rivals)):
        if good.any():
            good[_impossible(problem, point, ahead, np.flatnonzero(good))] = False
    return good


def _impossible(
    problem: StrainProblem, point: Point, ahead: Operating, index: IntArray
) -> list[int]:
    """Return points without a solution, by halving what fails."""
    try:
        problem.model_at(point, ahead.take(index))
    except TirelibError:
        if len(index) == 1:
            return [int(index[0])]
        half = len(index) // 2
        return [
            *_impossible(problem, point, ahead, index[:half]),
            *_impossible(problem, point, ahead, index[half:]),
        ]
    return []


def _without(envelope: Envelope, trial: StrainTrial, noise: Noise) -> NextTest:
    """Return a plan without runs, where there are not two suspects."""
    empty, none = np.zeros(0), np.zeros((0, len(envelope.names)))
    return NextTest(envelope, none, empty, empty, empty, (), (), trial, 0, noise)


def gains(
    hypotheses: Hypotheses, suspects: Suspects, test: NextTest
) -> dict[str, dict[float, float]]:
    """Return the chance that the present plan, measured several times, shows each suspect.

    Each at the strength that it has now, against no effect; by times of measuring, `ENDLESS` last.
    Noise and set points average, the misfit that a run has for itself does not. Empty unless that
    nothing is missing is a rival.
    """
    problem = hypotheses.problem
    assert isinstance(problem, StrainProblem)  # noqa: S101 - forces have their own
    nothing = hypotheses.at([effect.name for effect, _ in suspects.beside])
    if not suspects.with_nothing or nothing is None:
        return {}
    limit = nothing.limit(hypotheses.false_alarm)
    out: dict[str, dict[float, float]] = {
        rival.name: {} for rival in test.trial.rivals if rival.name != NOTHING
    }
    for times in (*PLAN_REPEATS, ENDLESS):
        again = nothing.fit.view(problem.repeated(min(times, MANY)), nothing.null.view.own)
        null = nothing.null.about(again, nothing.null.size)
        for rival in test.trial.rivals:
            if rival.name != NOTHING:
                effect = hypotheses.effects[rival.name]
                ranges = float(np.linalg.norm(rival.strength)) / effect.scale
                out[rival.name][times] = null.power(rival.name, ranges, limit)
    return out


def _hopeless(count: int) -> ParameterError:
    return ParameterError(
        f"envelope: the model has no solution at any of its {count} runs (tread pressed through, "
        "or too large a patch); lower the loads of --load-range"
    )


def force_next_test(
    case: ForceCase,
    base: ForceFit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    envelope: Envelope,
    *,
    with_nothing: bool = False,
    progress: Callable[[str], None] | None = None,
) -> NextTest:
    """Judge further runs of a force by how well they part suspects: points, or sweeps.

    Parameters
    ----------
    case : ForceCase
        The present points.
    base : ForceFit
        The model without the suspects, fitted.
    suspects : sequence of (effect, start strength)
    envelope : Envelope
        Of `tirelib.planning.force_rivals.force_envelope`.
    with_nothing : bool
        Whether that nothing is missing is a rival too.
    progress : callable, optional

    Raises
    ------
    ParameterError
        If no point in the envelope has a solution.
    """
    tell = progress or (lambda label: None)
    chosen, n, size = envelope.grid(), len(case.problem), envelope.points
    joint = points_ahead(case, envelope, chosen)
    good = _solvable(joint, base, n).reshape(-1, size).all(axis=1)
    if not good.any():
        raise _hopeless(len(chosen))
    points = chosen[good]
    joint = points_ahead(case, envelope, points)
    structure = structure_rows(joint, n, base)
    trial = try_force_suspects(
        case, base, suspects, structure[:, :n], with_nothing=with_nothing, progress=progress
    )
    tell(f"{len(points)} runs")
    ahead = joint.take(np.arange(n, len(joint)))
    told = force_forecasts(trial, ahead, structure[:, n:], size)
    return judged(envelope, points, trial, told, len(chosen) - len(points), trial.noise)


def _solvable(joint: ForceProblem, base: ForceFit, present: int) -> BoolArray:
    """Return at which points ahead the base brush has a solution."""
    good = np.ones(len(joint) - present, dtype=bool)
    try:
        joint.predict(base.values, base.changes)
    except TirelibError:
        for k in range(good.size):
            try:
                joint.take(np.array([present + k])).predict(base.values, base.changes)
            except TirelibError:
                good[k] = False
    return good
