"""Which further run would tell rival hypotheses apart.

The statistic is that of the verdict. At each possible run one rival A is taken as true. Its
measurement is drawn from what the present runs leave open of A - its numbers, its strengths, what
plain tires show in addition to a model - and from noise, set points and the misfit that a run has
for itself. The other rival B is then tested with this run behind the present ones: B leaves the
confidence set if its statistic (`tirelib.inference.statistics.hypothesis`) exceeds its limit. The
share of draws in which it does is the chance that the run tells, if A is true; likewise with B as
true (Box and Hill, Technometrics 9 (1967) 57, with a test in place of an entropy). All of it is of
first order about the fits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Protocol

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.null import Null
from tirelib.inference.statistics.posterior import explaining
from tirelib.inference.statistics.problem import Problem
from tirelib.inference.statistics.views import View

DRAWS = 48
"""Measurements drawn for every possible run: the standard deviation of a chance is .07 at most."""


class Ahead(Problem, Protocol):
    """A problem with possible runs, whose measurement is zero, behind the present ones."""

    @property
    def run_ahead(self) -> IntArray:
        """The possible run that each whitened number is of, -1 for the present ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Parted:
    """What possible runs do for a pair of rivals.

    Attributes
    ----------
    first, second : int
        Places of the rivals.
    gap : float
        Chi-square by which the second is worse on the present runs; negative: the first.
    resolved : bool
        Whether the present runs leave exactly one of them in the confidence set.
    chance : shape (n_ahead,)
        That a run puts one of them out of it, over the odds that the present runs give to either.
        NaN where the present runs have put both out: neither can leave it.
    separation, std : shape (n_ahead,)
        Mean rise of the likelihood ratio against the wrong one, the smaller of both directions, and
        its standard deviation over the draws.
    """

    first: int
    second: int
    gap: float
    resolved: bool
    chance: FloatArray
    separation: FloatArray
    std: FloatArray


def next_runs(
    ahead: Ahead, rivals: Sequence[Hypothesis], alpha: float, *, seed: int = 0
) -> list[Parted]:
    """Return what every possible run does for every pair of rivals.

    Parameters
    ----------
    ahead : Ahead
    rivals : sequence of Hypothesis
        About the present runs.
    alpha : float
        False-alarm probability.
    seed : int
        Seed of the draws, which all runs share.
    """
    forecasts = [_Forecast(ahead, rival) for rival in rivals]
    out = []
    for i, j in combinations(range(len(rivals)), 2):
        one, two = rivals[i], rivals[j]
        gap = 2.0 * (one.likelihood - two.likelihood)
        odds = 1.0 / (1.0 + np.exp(-np.clip(gap, -100.0, 100.0) / 2.0))
        # a hypothesis is a special case of one with more effects, which it does not speak against
        ways = [
            (weight, forecasts[judged].tested(forecasts[true], alpha, seed))
            for true, judged, weight in ((i, j, odds), (j, i, 1.0 - odds))
            if set(rivals[true].names) - set(rivals[judged].names)
        ]
        total = sum(weight for weight, _ in ways) or 1.0
        chance = sum(weight / total * way[0] for weight, way in ways)
        if max(one.p, two.p) <= alpha:  # both are out of the confidence set: neither can leave it
            chance = np.full(np.shape(chance), np.nan)
        rise, std = (np.array([way[k] for _, way in ways]) for k in (1, 2))
        least = np.argmin(rise, axis=0)[None]
        out.append(
            Parted(
                i,
                j,
                gap,
                (one.p > alpha) != (two.p > alpha),
                np.asarray(chance),
                np.maximum(np.take_along_axis(rise, least, axis=0)[0], 0.0),
                np.take_along_axis(std, least, axis=0)[0],
            )
        )
    return out


class _Forecast:
    """A rival in the present runs and in possible ones.

    Attributes
    ----------
    rows : shape (m, ...)
        Signatures of everything that may explain a residual, in all runs.
    start : shape (...)
        The model with all coefficients of the rows at zero.
    """

    def __init__(self, ahead: Ahead, rival: Hypothesis) -> None:
        self.ahead, self.rival = ahead, rival
        point = rival.fit.point
        solved = ahead.solve(point)
        named, slopes = explaining(ahead, point, solved, rival.fit.count)
        self.rows = np.concatenate(list(named.values()))
        away = solved.rest + np.tensordot(point.coordinates, slopes, axes=1)
        self.start = -away  # nothing is measured ahead: the residual is the negative model

    def drawn(self, count: int, seed: int) -> FloatArray:
        """Return measurements if this rival is true, without noise, shape (count, ...)."""
        draws = self.rival.null.likeliest.draws(np.random.default_rng(seed), count)
        return np.asarray(self.start + np.tensordot(draws, self.rows, axes=1))

    def tested(
        self, true: "_Forecast", alpha: float, seed: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return what each possible run does against this rival if another one is true.

        Shapes (n_ahead,): the chance that this rival leaves the confidence set, and mean and
        standard deviation of the rise of the likelihood ratio.
        """
        rival, null = self.rival, self.rival.null
        whiten, limit = self.ahead.whitener(null.view.own), rival.limit(alpha)
        white = whiten(self.rows)
        left = whiten(true.drawn(DRAWS, seed) - self.start)
        further = [
            null.names.index(name)
            for name in true.rival.names
            if name not in rival.names and name in null.names
        ]
        now = null.measured
        before = np.abs(null.ratios_of(now))[further, 0]
        count = null.counts[further, None]
        runs = int(self.ahead.run_ahead.max()) + 1
        chance, rise, std = np.zeros(runs), np.zeros(runs), np.zeros(runs)
        for run in range(runs):
            here = self.ahead.run_ahead == run
            rows, rest = white[:, here], left[:, here]
            # the same draws at every run, so that runs compare
            rest = rest + np.random.default_rng([seed, 1]).standard_normal(rest.shape)
            tested = _with(null, rows)
            ratios = tested.ratios_of((now[0] + rows @ rest.T, now[1] + np.sum(rest**2, axis=1)))
            chance[run] = np.mean(tested.standard(ratios).max(axis=0) > limit)
            gained = np.max(
                count * (np.abs(ratios[further]) - before[:, None]), axis=0, initial=0.0
            )
            rise[run], std[run] = gained.mean(), gained.std()
        return chance, rise, std


def _with(null: Null, rows: FloatArray) -> Null:
    """Return a test with further whitened rows (m, n) behind those of its runs."""
    view, normal = null.view, null.view.normal
    more = replace(normal, gram=normal.gram + rows @ rows.T, count=normal.count + rows.shape[1])
    return null.about(View(view.own, more, view.log_volume, np.zeros(0)))
