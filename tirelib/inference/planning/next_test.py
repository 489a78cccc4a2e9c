"""The next test of strain and of forces: rivals, and possible runs by what they do to them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.threads import one_thread
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.planning.envelope import Envelope, operating_at
from tirelib.inference.planning.force_runs import bench_ahead
from tirelib.inference.planning.suspects import Suspects
from tirelib.inference.problems.forces import ForceProblem
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.next_run import Ahead, next_runs
from tirelib.inference.statistics.problem import Point

NOTHING = "no_effect"
"""Name of the rival that needs no further effect."""
LEAST_SEPARATION = 1.0
"""Separation below which a run tells nothing: noise alone moves the chi-square of one number so."""
WANTED = 20.0
"""Separation that one asks for: odds of e^10 against the wrong rival."""
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
"""Repeats of the best run that are looked at."""
ENDLESS = 1e6
"""Repeats that average everything that repeats can average."""
PLAN_REPEATS = (1, 2, 3, 4, 6, 8, 12)
"""Times that the whole plan is measured."""
MOST_REPEATS = 1e3
"""Repeats that stand for endless ones: the noise is far below the misfit of a run then, and normal
equations of still less noise are not accurate."""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A suspect fitted to the present runs.

    Attributes
    ----------
    name : str
        Name of the effect, or `NOTHING`.
    cost : float
        Chi-square left on the present runs, less that of no effect.
    strength : shape (components,)
        In the effect's unit; empty for `NOTHING`.
    in_range : bool
        Whether it is plausible, give or take two standard deviations.
    """

    name: str
    cost: float
    strength: FloatArray
    in_range: bool


@dataclass(frozen=True, slots=True)
class PairForecast:
    """Two rivals, now and at every possible run.

    Attributes
    ----------
    names : (str, str)
    gap : float
        Chi-square by which the second is worse on the present runs; negative: the first.
    resolved : bool
        Whether the present runs leave exactly one of them in the confidence set.
    separation : shape (n,)
        Expected further chi-square by one run.
    probability : shape (n,)
        That one run puts one of them out of it; NaN where both are out already.
    repeats : mapping of number to float
        Separation by so many repeats of the best run.
    limit : float
        Separation that no number of repeats exceeds.
    """

    names: tuple[str, str]
    gap: float
    resolved: bool
    separation: FloatArray
    probability: FloatArray
    repeats: Mapping[int, float]
    limit: float

    @property
    def better(self) -> str:
        """The rival that the present runs like better."""
        return self.names[0] if self.gap >= 0.0 else self.names[1]

    def needed(self, wanted: float) -> int | None:
        """Return the fewest repeats of the best run with a separation, None beyond `REPEATS`."""
        return next((n for n, reached in self.repeats.items() if reached >= wanted), None)


@dataclass(frozen=True, slots=True)
class NextTest:
    """The possible runs, judged; none where fewer than two rivals could be fitted.

    Attributes
    ----------
    rivals : tuple of Suspect
        Suspects on the present runs whose fits have settled.
    left_out : mapping of str to str
        Why other suspects are no rivals.
    size : float
        Size of the structural misfit; 1 is that of plain tires.
    random, staying : float
        Random parts of a run's samples: between repeated runs, and the misfit that a run has for
        itself, which repeats do not average.
    points : shape (n, axes), SI
        The possible runs on the envelope's axes, best first.
    score, std, probability : shape (n,)
        Separation of the pair that is hardest there, its standard deviation, and mean chance to
        rule a rival out.
    hardest : tuple of int
        Index of that pair, per run.
    pairs : tuple of PairForecast
        In the order of the points.
    dropped : int
        Possible runs at which a rival has no solution.
    """

    envelope: Envelope
    rivals: tuple[Suspect, ...]
    left_out: Mapping[str, str]
    size: float
    random: float
    staying: float
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    score: FloatArray = field(default_factory=lambda: np.zeros(0))
    std: FloatArray = field(default_factory=lambda: np.zeros(0))
    probability: FloatArray = field(default_factory=lambda: np.zeros(0))
    hardest: tuple[int, ...] = ()
    pairs: tuple[PairForecast, ...] = ()
    dropped: int = 0

    @property
    def open_pairs(self) -> tuple[PairForecast, ...]:
        """Pairs that the present runs do not separate."""
        return tuple(pair for pair in self.pairs if not pair.resolved)

    @property
    def hopeless(self) -> bool:
        """Whether no run separates any of the open pairs."""
        return bool(self.open_pairs) and all(
            float(np.max(pair.separation)) < LEAST_SEPARATION for pair in self.open_pairs
        )


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
    """Judge the runs of an envelope by how well they separate suspects.

    Parameters
    ----------
    hypotheses : Hypotheses
        About the present runs (a `StrainProblem` or a `ForceProblem`).
    envelope : Envelope
        For forces the one of `tirelib.inference.planning.force_runs.force_envelope`.
    model : ForceModel, optional
        The brush, of forces.

    Raises
    ------
    ParameterError
        If no run in the envelope has a solution.
    """
    tell = progress or (lambda label: None)
    problem, chosen = _problem(hypotheses), envelope.grid()
    rivals, left_out = _fitted(hypotheses, suspects)
    judged = NextTest(
        envelope,
        tuple(_suspect(name, rival, hypotheses) for name, rival in rivals.items()),
        left_out,
        hypotheses.base.null.size.whole,
        float(np.mean(problem.noise)),
        problem.own_misfit(hypotheses.own),
    )
    if len(rivals) < 2:
        return judged
    fits, names, runs = list(rivals.values()), list(rivals), _Runs(problem, envelope, model)
    good = runs.possible(fits, chosen)
    if not good.any():
        raise ParameterError(
            f"envelope: the model has no solution at any of its {len(chosen)} runs (tread "
            "pressed through, or too large a patch); lower the loads of --load-range"
        )
    points = chosen[good]
    tell(f"{len(points)} runs with {' and '.join(rivals)}")
    alpha = hypotheses.false_alarm
    parted = next_runs(runs.ahead(points, np.ones(len(points))), fits, alpha)
    open_ = [k for k, pair in enumerate(parted) if not pair.resolved] or range(len(parted))
    size = np.array([parted[k].separation for k in open_])
    told = [parted[k].chance for k in open_ if np.isfinite(parted[k].chance).all()]
    chance = np.mean(told, axis=0) if told else np.full(len(points), np.nan)
    least = [open_[k] for k in np.argmin(size, axis=0)]
    score = np.min(size, axis=0)
    std = np.array([parted[pair].std[run] for run, pair in enumerate(least)])
    order = np.lexsort((-score, -np.round(np.nan_to_num(chance), 3)))
    tell("repeats of the best run")
    best = np.repeat(points[order[:1]], len(REPEATS) + 1, axis=0)
    again = next_runs(runs.ahead(best, np.array([*REPEATS, ENDLESS])), fits, alpha)
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
    return replace(
        judged,
        points=points[order],
        score=score[order],
        std=std[order],
        probability=chance[order],
        hardest=tuple(least[k] for k in order),
        pairs=pairs,
        dropped=int((~good).sum()),
    )


def _problem(hypotheses: Hypotheses) -> StrainProblem | ForceProblem:
    problem = hypotheses.problem
    assert isinstance(problem, StrainProblem | ForceProblem)  # noqa: S101 - there are no others
    return problem


def _fitted(
    hypotheses: Hypotheses, suspects: Suspects
) -> tuple[dict[str, Hypothesis], dict[str, str]]:
    """Return the hypotheses of suspects by name, and why others are left out."""
    certain, dead, found, left_out = suspects.beside, hypotheses.problem.dead, {}, {}
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
    nothing = hypotheses.at(suspects.beside)
    if not suspects.with_nothing or nothing is None:
        return {}
    limit = nothing.limit(hypotheses.false_alarm)
    rivals = [rival for rival in test.rivals if rival.name != NOTHING]
    out: dict[str, dict[float, float]] = {rival.name: {} for rival in rivals}
    for times in (*PLAN_REPEATS, ENDLESS):
        repeated = problem.repeated(min(times, MOST_REPEATS))
        (again,) = nothing.fit.views(repeated, [nothing.null.view.own])
        null = nothing.null.about(again, nothing.null.size)
        for rival in rivals:
            scale = hypotheses.effects[rival.name].scale
            ranges = float(np.linalg.norm(rival.strength)) / scale
            out[rival.name][times] = null.power(rival.name, ranges, limit)
    return out
