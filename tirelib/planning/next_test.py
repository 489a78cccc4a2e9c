"""The run that parts suspects best: a profiled T-criterion over a grid of possible runs.

Every suspect is fitted to the present runs. At each possible run each of two rivals in turn is
taken as true, and the other may adapt within what the present runs leave open of its numbers and of
the structural misfit (Atkinson and Fedorov's criterion with the parameters integrated out). What it
still misses, in chi-square, is the separation; the smaller of both directions counts.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.stats import norm

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.effects import Effect
from tirelib.errors import ParameterError, TirelibError
from tirelib.identify.waveform_fit import Data
from tirelib.planning.candidate_runs import Forecast, Noise, forecasts, possible
from tirelib.planning.envelope import Envelope, operating_at
from tirelib.planning.rivals import NOTHING, Rival, Trial, try_suspects

RESOLVED = 10.0
"""Chi-square by which a rival has to be worse to be ruled out."""
WANTED = 20.0
"""Separation that one asks for: then at least four runs of five rule a rival out."""
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
"""Repeats of the best run that are looked at."""
ENDLESS = 1e6
"""Repeats that average everything that repeats can average."""

Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class PairForecast:
    """Two rivals, now and at every possible run.

    Attributes
    ----------
    names : (str, str)
    gap : float
        Chi-square by which the second is worse on the present runs; negative: the first.
    separation : shape (n,)
        Expected further chi-square by one run.
    probability : shape (n,)
        That one run rules one of them out.
    repeats : mapping of number to float
        Separation by so many repeats of the best run.
    limit : float
        Separation that no number of repeats exceeds.
    """

    names: Pair
    gap: float
    separation: FloatArray
    probability: FloatArray
    repeats: Mapping[int, float]
    limit: float

    @property
    def better(self) -> str:
        """The rival that the present runs like better."""
        return self.names[0] if self.gap >= 0.0 else self.names[1]

    @property
    def resolved(self) -> bool:
        """Whether the present runs rule one of them out."""
        return abs(self.gap) >= RESOLVED

    def needed(self, wanted: float) -> int | None:
        """Return the fewest repeats of the best run with a separation, None beyond `REPEATS`."""
        return next((n for n, reached in self.repeats.items() if reached >= wanted), None)


@dataclass(frozen=True, slots=True)
class NextTest:
    """The possible runs, judged.

    Attributes
    ----------
    envelope : Envelope
    points : shape (n, 3)
        Load [N], pressure [Pa] and speed [m/s] of the possible runs, best first.
    score, probability : shape (n,)
        Separation of the pair that is hardest there, and mean chance to rule a rival out.
    hardest : tuple of int
        Index of that pair, per run.
    pairs : tuple of PairForecast
        In the order of the points.
    trial : Trial
        The rivals on the present runs, and who is none.
    dropped : int
        Possible runs at which a rival has no solution.
    noise : Noise
    """

    envelope: Envelope
    points: FloatArray
    score: FloatArray
    probability: FloatArray
    hardest: tuple[int, ...]
    pairs: tuple[PairForecast, ...]
    trial: Trial
    dropped: int
    noise: Noise

    @property
    def open_pairs(self) -> tuple[PairForecast, ...]:
        """Pairs that the present runs do not part."""
        return tuple(pair for pair in self.pairs if not pair.resolved)


def next_test(
    data: Data,
    base: Refit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    envelope: Envelope,
    *,
    noise: float,
    with_nothing: bool = False,
    progress: Callable[[str], None] | None = None,
) -> NextTest:
    """Judge the runs of an envelope by how well they part suspects.

    Parameters
    ----------
    data : Data
    base : Refit
        The model without the suspects, fitted.
    suspects : sequence of (effect, start strength)
    envelope : Envelope
    noise : float, [-]
        Of a run's waveform, from repeats; NaN without.
    with_nothing : bool
        Whether that nothing is missing is a rival too.
    progress : callable, optional

    Raises
    ------
    ParameterError
        If no run in the envelope has a solution.
    """
    trial = try_suspects(data, base, suspects, with_nothing=with_nothing, progress=progress)
    chosen, random = envelope.grid(), Noise.of(trial, noise)
    if len(trial.rivals) < 2:
        empty = np.zeros(0)
        return NextTest(envelope, np.zeros((0, 3)), empty, empty, (), (), trial, 0, random)
    points = chosen
    try:
        told = forecasts(trial, data, operating_at(points, data.points), progress=progress)
    except TirelibError:
        points = chosen[possible(trial, data, operating_at(chosen, data.points))]
        if not len(points):
            raise ParameterError(
                f"envelope: the model has no solution at any of its {len(chosen)} runs (tread "
                "pressed through, or too large a patch); lower the loads of --load-range"
            ) from None
        told = forecasts(trial, data, operating_at(points, data.points), progress=progress)
    return _judged(envelope, points, trial, told, len(chosen) - len(points), random)


def _judged(
    envelope: Envelope,
    points: FloatArray,
    trial: Trial,
    told: Sequence[Forecast],
    dropped: int,
    noise: Noise,
) -> NextTest:
    """Sort the runs by what they promise."""
    rivals = trial.rivals
    pairs = list(combinations(range(len(rivals)), 2))
    sizes = np.array([_both(rivals, told, pair, noise, 1.0) for pair in pairs])
    gaps = [rivals[j].cost - rivals[i].cost for i, j in pairs]
    chances = np.array([resolving(size, gap) for size, gap in zip(sizes, gaps, strict=True)])
    counted = [k for k, gap in enumerate(gaps) if abs(gap) < RESOLVED] or list(range(len(gaps)))
    hardest = np.array(counted)[np.argmin(sizes[counted], axis=0)]
    chance = chances[counted].mean(axis=0)
    score = sizes[hardest, np.arange(len(points))]
    order = np.lexsort((-score, -np.round(chance, 3)))
    best = int(order[0])
    found = []
    for pair, size, gap, likely in zip(pairs, sizes, gaps, chances, strict=True):
        there = [_at(each, best) for each in told]
        repeated = {n: float(_both(rivals, there, pair, noise, n)[0]) for n in REPEATS}
        names = (rivals[pair[0]].name, rivals[pair[1]].name)
        limit = float(_both(rivals, there, pair, noise, ENDLESS)[0])
        found.append(PairForecast(names, gap, size[order], likely[order], repeated, limit))
    return NextTest(
        envelope, points[order], score[order], chance[order], tuple(hardest[order].tolist()),
        tuple(found), trial, dropped, noise,
    )  # fmt: skip


def _both(
    rivals: Sequence[Rival],
    told: Sequence[Forecast],
    pair: tuple[int, int],
    noise: Noise,
    repeats: float,
) -> FloatArray:
    """Return the smaller separation of both directions.

    That nothing is missing is a special case of every effect: only the other direction counts.
    """
    i, j = pair
    ways = []
    if rivals[i].name != NOTHING:
        ways.append(told[j].separation(told[i].wave, noise, repeats))
    if rivals[j].name != NOTHING:
        ways.append(told[i].separation(told[j].wave, noise, repeats))
    smaller: FloatArray = np.min(ways, axis=0)
    return smaller


def _at(told: Forecast, index: int) -> Forecast:
    """Return the forecast of one point."""
    one = slice(index, index + 1)
    return Forecast(told.wave[one], told.slopes[:, one], told.tangents[one], told.covariance)


def resolving(separation: FloatArray, gap: float) -> FloatArray:
    """Return the chance that a run of this separation rules one of two rivals out.

    The chi-square between them is normal about gap + separation with variance 4 separation if the
    first is right, and about gap - separation if the second is. Each is right with the odds that
    the present runs give.

    Examples
    --------
    >>> resolving(np.array([0.0, 10.0, 40.0]), 0.0).round(2).tolist()
    [0.0, 0.5, 0.99]
    """
    spread = 2.0 * np.sqrt(np.maximum(separation, 1e-12))
    first = 1.0 / (1.0 + np.exp(-np.clip(gap, -100.0, 100.0) / 2.0))
    # either may come out ahead by enough, whoever is right
    ahead = norm.sf((RESOLVED - gap - separation) / spread)
    ahead += norm.sf((RESOLVED + gap + separation) / spread)
    behind = norm.sf((RESOLVED - gap + separation) / spread)
    behind += norm.sf((RESOLVED + gap - separation) / spread)
    chance: FloatArray = first * ahead + (1.0 - first) * behind
    return chance
