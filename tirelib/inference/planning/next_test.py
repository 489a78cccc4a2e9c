"""The next test of strain and of forces: rivals, and possible runs by what they do to them."""

from collections.abc import Callable

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.threads import one_thread
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.planning.criterion import (
    ENDLESS,
    NOTHING,
    REPEATS,
    NextTest,
    Noise,
    PairForecast,
    Suspect,
    Trial,
)
from tirelib.inference.planning.envelope import Envelope, operating_at
from tirelib.inference.planning.force_runs import bench_ahead
from tirelib.inference.planning.suspects import Suspects
from tirelib.inference.problems.forces import ForceProblem
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.next_run import Ahead, next_runs
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.select import Hypotheses

PLAN_REPEATS = (1, 2, 3, 4, 6, 8, 12)
"""Times that the whole plan is measured."""
MANY = 1e3
"""Repeats that stand for endless ones: the noise is far below the misfit of a run then, and normal
equations of still less noise are not accurate."""


class _Runs:
    """Possible runs behind the present ones of a problem."""

    def __init__(
        self, problem: StrainProblem | ForceProblem, envelope: Envelope, model: ForceModel | None
    ) -> None:
        self.problem, self.envelope, self.model = problem, envelope, model

    def ahead(self, wanted: FloatArray, repeats: FloatArray) -> Ahead:
        """Return the problem with runs (n, axes) behind the present ones, each so many times."""
        if isinstance(self.problem, StrainProblem):
            points = operating_at(wanted, self.problem.data.points)
            return self.problem.followed_by(points, repeats)
        assert self.model is not None  # noqa: S101 - of forces
        bench = bench_ahead(self.problem.bench, self.model, self.envelope, wanted)
        return self.problem.followed_by(bench, np.repeat(repeats, self.envelope.points))

    def solve(self, point: Point, wanted: FloatArray) -> None:
        """Raise TirelibError if the model has no solution at one of some runs (n, axes)."""
        if isinstance(self.problem, StrainProblem):
            self.problem.model_at(point, operating_at(wanted, self.problem.data.points))
        else:
            self.ahead(wanted, np.ones(len(wanted))).solve(point)

    def possible(self, rivals: list[Hypothesis], wanted: FloatArray) -> BoolArray:
        """Return at which runs every rival has a solution (tread not pressed through and so on)."""
        good = np.ones(len(wanted), dtype=bool)
        for point in (self.problem.start, *(rival.fit.point for rival in rivals)):
            if good.any():
                good[self._impossible(point, wanted, np.flatnonzero(good))] = False
        return good

    def _impossible(self, point: Point, wanted: FloatArray, index: IntArray) -> list[int]:
        """Return runs without a solution, by halving what fails."""
        try:
            self.solve(point, wanted[index])
        except TirelibError:
            if len(index) == 1:
                return [int(index[0])]
            half = len(index) // 2
            return [
                *self._impossible(point, wanted, index[:half]),
                *self._impossible(point, wanted, index[half:]),
            ]
        return []


@one_thread()
def next_test(
    hypotheses: Hypotheses,
    suspects: Suspects,
    envelope: Envelope,
    *,
    model: ForceModel | None = None,
    progress: Callable[[str], None] | None = None,
) -> NextTest:
    """Judge the runs of an envelope by how well they part suspects.

    Parameters
    ----------
    hypotheses : Hypotheses
        About the present runs (a `StrainProblem` or a `ForceProblem`).
    suspects : Suspects
    envelope : Envelope
        For forces the one of `tirelib.inference.planning.force_runs.force_envelope`.
    model : ForceModel, optional
        The brush, of forces.
    progress : callable, optional

    Raises
    ------
    ParameterError
        If no run in the envelope has a solution.
    """
    tell = progress or (lambda label: None)
    problem = _problem(hypotheses)
    rivals, left_out = _fitted(hypotheses, suspects)
    trial = Trial(
        tuple(_suspect(name, rival, hypotheses) for name, rival in rivals.items()),
        left_out,
        hypotheses.base.null.size.whole,
    )
    noise = Noise(float(np.mean(problem.noise)), problem.own_misfit(hypotheses.own))
    chosen = envelope.grid()
    if len(rivals) < 2:
        empty, none = np.zeros(0), np.zeros((0, len(envelope.names)))
        return NextTest(envelope, none, empty, empty, empty, (), (), trial, 0, noise)
    fits, runs = list(rivals.values()), _Runs(problem, envelope, model)
    good = runs.possible(fits, chosen)
    if not good.any():
        raise ParameterError(
            f"envelope: the model has no solution at any of its {len(chosen)} runs (tread pressed "
            "through, or too large a patch); lower the loads of --load-range"
        )
    points = chosen[good]
    tell(f"{len(points)} runs with {' and '.join(rivals)}")
    alpha = hypotheses.false_alarm
    parted = next_runs(runs.ahead(points, np.ones(len(points))), fits, alpha)
    open_ = [pair for pair in parted if not pair.resolved] or parted
    size = np.array([pair.separation for pair in open_])
    told = [pair.chance for pair in open_ if np.isfinite(pair.chance).all()]
    chance = np.mean(told, axis=0) if told else np.full(len(points), np.nan)
    hardest = np.argmin(size, axis=0)
    score = np.min(size, axis=0)
    std = np.array([open_[pair].std[run] for run, pair in enumerate(hardest)])
    order = np.lexsort((-score, -np.round(np.nan_to_num(chance), 3)))
    tell("repeats of the best run")
    best = np.repeat(points[order[:1]], len(REPEATS) + 1, axis=0)
    again = next_runs(runs.ahead(best, np.array([*REPEATS, ENDLESS])), fits, alpha)
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


def _problem(hypotheses: Hypotheses) -> StrainProblem | ForceProblem:
    problem = hypotheses.problem
    assert isinstance(problem, StrainProblem | ForceProblem)  # noqa: S101 - there are no others
    return problem


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


def gains(
    hypotheses: Hypotheses, suspects: Suspects, test: NextTest
) -> dict[str, dict[float, float]]:
    """Return the chance that the present plan, measured several times, shows each suspect.

    Each at the strength that it has now, against no effect; by times of measuring, `ENDLESS` last.
    Noise and set points average, the misfit that a run has for itself does not. Empty unless that
    nothing is missing is a rival.
    """
    problem = _problem(hypotheses)
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
