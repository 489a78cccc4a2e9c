"""The run that parts rivals best: a T-criterion over possible runs, parameters integrated out.

Every suspect is fitted to the present runs. At each possible run each of two rivals in turn is
taken as true, with the numbers and the structural misfit that the present runs leave open, and the
other may adapt within what they leave open of its own (Atkinson and Fedorov's criterion with the
parameters integrated out as in Box and Hill's). What it still misses, in chi-square, is the
separation; the smaller of both directions counts.

Strain and forces differ in how rivals are fitted and foretell (`Rival`, `Trial`, `Forecast`), not
in how runs are judged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np
from scipy.stats import norm

from tirelib.arrays import FloatArray
from tirelib.planning.envelope import Envelope

NOTHING = "no_effect"
"""Name of the rival that needs no further effect."""
RESOLVED = 10.0
"""Chi-square by which a rival has to be worse to be ruled out."""
WANTED = 20.0
"""Separation that one asks for: then at least four runs of five rule a rival out."""
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
"""Repeats of the best run that are looked at."""
ENDLESS = 1e6
"""Repeats that average everything that repeats can average."""

Pair = tuple[str, str]


class Rival(Protocol):
    """A suspect fitted to the present runs."""

    @property
    def name(self) -> str:
        """Name of the effect, or `NOTHING`."""

    @property
    def cost(self) -> float:
        """Chi-square left on the present runs."""

    @property
    def strength(self) -> FloatArray:
        """In the effect's unit, (components,); empty for `NOTHING`."""

    @property
    def in_range(self) -> bool:
        """Whether it is plausible, give or take two standard deviations."""


class Trial(Protocol):
    """Rivals on the same runs, under the same noise."""

    @property
    def rivals(self) -> Sequence[Rival]:
        """Those whose fits have converged."""

    @property
    def left_out(self) -> Mapping[str, str]:
        """Suspects whose fit failed, and why."""

    @property
    def size(self) -> float:
        """Size of the structural misfit; 1 is that of plain tires."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Random parts of a run's samples, as white noise that counts as much.

    Attributes
    ----------
    random : float
        Between repeated runs.
    staying : float
        Small-scale misfit of the ring's structure, which repeats do not average.
    """

    random: float
    staying: float


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a rival says of candidate runs: a waveform of strain, or a force as a single sample.

    Attributes
    ----------
    wave : shape (n_points, n_samples)
        Best guess, structural misfit included.
    slopes : shape (n_unknowns, n_points, n_samples)
        By free coordinates and by the misfit.
    tangents : shape (n_points, n_samples, n_tangents)
        By set points and the like, times their tolerance.
    covariance : shape (n_unknowns, n_unknowns)
    """

    wave: FloatArray
    slopes: FloatArray
    tangents: FloatArray
    covariance: FloatArray

    def spread(self, noise: Noise, repeats: float) -> FloatArray:
        """Return the covariance of what this rival foretells, (n_points, n_samples, n_samples).

        S + J C J': S holds noise and set points, over the number of repeats, and what repeats do
        not average; J C J' is what the present runs leave open of this rival.
        """
        root = np.linalg.cholesky(self.covariance)
        open_ = np.einsum("kpn,kj->pnj", self.slopes, root, optimize=True)
        low = np.concatenate([open_, self.tangents / np.sqrt(repeats)], axis=2)
        white = noise.staying**2 + noise.random**2 / repeats
        return np.asarray(low @ np.swapaxes(low, 1, 2) + white * np.eye(low.shape[1]))

    def missed(
        self, true: "Forecast", noise: Noise, repeats: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return by how much worse than the true rival this one gets: mean and variance.

        With d the difference of both best guesses and V, W the covariances of what this rival and
        the true one foretell, the mean is d' V^-1 d + tr(V^-1 W) - n, the variance
        4 d' V^-1 W V^-1 d + 2 tr((V^-1 W - 1)^2). The trace is what the true rival may do beyond
        its best guess: one whose strength is hardly known yet may be far from it.

        Parameters
        ----------
        true : Forecast
            Of the same points.
        noise : Noise
        repeats : float
            Runs at each point.

        Returns
        -------
        mean, variance : shape (n_points,), [-]
        """
        mean, variance = np.zeros(len(self.wave)), np.zeros(len(self.wave))
        for k in range(len(self.wave)):
            own, other = (_at(each, k).spread(noise, repeats)[0] for each in (self, true))
            difference = true.wave[k] - self.wave[k]
            solved = np.linalg.solve(own, np.column_stack([difference, other - own]))
            inside, more = solved[:, 0], solved[:, 1:]
            mean[k] = difference @ inside + np.trace(more)
            variance[k] = 4.0 * inside @ other @ inside + 2.0 * np.sum(more * more.T)
        return mean, variance


@dataclass(frozen=True, slots=True)
class PairForecast:
    """Two rivals, now and at every possible run.

    Attributes
    ----------
    names : (str, str)
    gap : float
        Chi-square by which the second is worse on the present runs; negative: the first.
    resolved : bool
        Whether the present runs rule one of them out.
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
    """The possible runs, judged.

    Attributes
    ----------
    envelope : Envelope
    points : shape (n, axes), SI
        The possible runs on the envelope's axes, best first.
    score, std, probability : shape (n,)
        Separation of the pair that is hardest there, its standard deviation, and mean chance to
        rule a rival out.
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
    std: FloatArray
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


def judged(
    envelope: Envelope,
    points: FloatArray,
    trial: Trial,
    told: Sequence[Forecast],
    dropped: int,
    noise: Noise,
) -> NextTest:
    """Sort the runs by what they promise.

    Parameters
    ----------
    envelope : Envelope
    points : shape (n, axes), SI
    trial : Trial
    told : sequence of Forecast
        Of the points, per rival.
    dropped : int
        Possible runs without a solution.
    noise : Noise
    """
    rivals = trial.rivals
    if len(rivals) < 2:
        empty = np.zeros(0)
        none = np.zeros((0, len(envelope.names)))
        return NextTest(envelope, none, empty, empty, empty, (), (), trial, dropped, noise)
    pairs = list(combinations(range(len(rivals)), 2))
    both = [_both(rivals, told, pair, noise, 1.0) for pair in pairs]
    ways, spreads = (np.array([each[k] for each in both]) for k in (0, 1))
    sizes = np.maximum(ways.min(axis=1), 0.0)
    smaller = np.argmin(ways, axis=1)[:, None]
    stds = np.take_along_axis(spreads, smaller, axis=1)[:, 0]
    gaps = [rivals[j].cost - rivals[i].cost for i, j in pairs]
    chances = np.array(
        [
            resolving(way[0], way[1], gap, list(spread))
            for way, gap, spread in zip(ways, gaps, spreads, strict=True)
        ]
    )
    counted = [k for k, gap in enumerate(gaps) if abs(gap) < RESOLVED] or list(range(len(gaps)))
    hardest = np.array(counted)[np.argmin(sizes[counted], axis=0)]
    chance = chances[counted].mean(axis=0)
    score, std = (x[hardest, np.arange(len(points))] for x in (sizes, stds))
    # where all pairs are parted already, a run can only add to that
    settled = all(abs(gap) >= RESOLVED for gap in gaps)
    order = np.lexsort((-score, 0.0 * chance if settled else -np.round(chance, 3)))
    best = int(order[0])
    found = []
    for pair, size, gap, likely in zip(pairs, sizes, gaps, chances, strict=True):
        there = [_at(each, best) for each in told]
        repeated = {n: _least(rivals, there, pair, noise, n) for n in REPEATS}
        names = (rivals[pair[0]].name, rivals[pair[1]].name)
        limit = _least(rivals, there, pair, noise, ENDLESS)
        found.append(
            PairForecast(
                names, gap, abs(gap) >= RESOLVED, size[order], likely[order], repeated, limit
            )
        )
    return NextTest(
        envelope,
        points[order],
        score[order],
        std[order],
        chance[order],
        tuple(hardest[order].tolist()),
        tuple(found),
        trial,
        dropped,
        noise,
    )


def _both(
    rivals: Sequence[Rival],
    told: Sequence[Forecast],
    pair: tuple[int, int],
    noise: Noise,
    repeats: float,
) -> tuple[FloatArray, FloatArray]:
    """Return separations if the first is right and if the second is, and stds, (2, n_points).

    That nothing is missing is a special case of every effect: only the other direction counts.
    """
    i, j = pair
    ways = [
        told[b].missed(told[a], noise, repeats)
        for a, b in ((i, j), (j, i))
        if rivals[a].name != NOTHING
    ]
    mean, variance = (np.array([way[k] for way in (ways[0], ways[-1])]) for k in (0, 1))
    return mean, np.sqrt(np.maximum(variance, 0.0))


def _least(
    rivals: Sequence[Rival],
    told: Sequence[Forecast],
    pair: tuple[int, int],
    noise: Noise,
    repeats: float,
) -> float:
    """Return the separation at a single point, by repeats."""
    return max(float(_both(rivals, told, pair, noise, repeats)[0].min()), 0.0)


def _at(told: Forecast, index: int) -> Forecast:
    """Return the forecast of one point."""
    one = slice(index, index + 1)
    return Forecast(told.wave[one], told.slopes[:, one], told.tangents[one], told.covariance)


def resolving(
    first: FloatArray,
    second: FloatArray,
    gap: float,
    spreads: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Return the chance that a run rules one of two rivals out.

    The chi-square between them is taken as normal about gap + separation if the first is right,
    and about gap - separation if the second is. Each is right with the odds that the present runs
    give.

    Parameters
    ----------
    first, second : shape (n,)
        Separation if that rival is right.
    gap : float
        Chi-square by which the second is worse now.
    spreads : two arrays of shape (n,), optional
        Standard deviations of the separations; by default 2 sqrt(separation), as of rivals whose
        numbers are known.

    Examples
    --------
    >>> size = np.array([0.0, 10.0, 40.0])
    >>> resolving(size, size, 0.0).round(2).tolist()
    [0.0, 0.5, 0.99]
    """
    odds = 1.0 / (1.0 + np.exp(-np.clip(gap, -100.0, 100.0) / 2.0))
    if spreads is None:
        spreads = [2.0 * np.sqrt(each) for each in (first, second)]
    one, two = (np.maximum(spread, 1e-6) for spread in spreads)
    chance: FloatArray = odds * _parted(gap, first, one) + (1.0 - odds) * _parted(-gap, second, two)
    return chance


def _parted(gap: float, separation: FloatArray, spread: FloatArray) -> FloatArray:
    """Return the chance that either comes out ahead by enough, if the one with the gap is right."""
    ahead = norm.sf((RESOLVED - gap - separation) / spread)
    return np.asarray(ahead + norm.sf((RESOLVED + gap + separation) / spread))
