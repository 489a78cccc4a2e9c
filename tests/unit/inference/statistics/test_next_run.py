"""A further run in a linear problem: what it must show to put a wrong hypothesis out of the set."""

from copy import copy
from typing import Any

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import N, Solved, Toy, by_effect, drawn, family
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.next_run import _with, next_runs

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))
MORE = 60
"""Samples of a run ahead."""


class Louder:
    """Unit noise in all runs."""

    log_volume = 0.0

    def __call__(self, rows: FloatArray) -> FloatArray:
        return np.asarray(rows)

    def reduced(self, rows: FloatArray) -> FloatArray:
        return rows

    def white(self, reduced: FloatArray) -> FloatArray:
        return reduced

    def coloured(self, white: FloatArray) -> FloatArray:
        return np.asarray(white)


class Ahead(Toy):
    """The toy with two runs ahead: one shows the two effects alike, one shows them apart."""

    def __init__(self, present: Toy) -> None:
        self.__dict__ |= copy(present).__dict__
        random = np.random.default_rng(3)
        one, other = random.standard_normal((2, MORE))
        zero = np.zeros((1, MORE))
        self.measured = np.concatenate([present.measured, np.zeros(2 * MORE)])
        self.base = np.concatenate([self.base, np.zeros((3, 2 * MORE))], axis=1)
        self.shapes = np.concatenate([self.shapes, np.zeros((6, 2 * MORE))], axis=1)
        self.there = np.concatenate([self.there, np.zeros((6, 2 * MORE))], axis=1)
        there = {
            "bend": np.concatenate([one[None], one[None]], axis=1),
            "twist": np.concatenate([one[None], other[None]], axis=1),
            "swell": np.concatenate([zero, zero], axis=1),
        }
        self.by = {
            name: np.concatenate([rows, there[name]], axis=1) for name, rows in self.by.items()
        }

    @property
    def run_ahead(self) -> IntArray:
        return np.repeat([-1, 0, 1], [N, MORE, MORE])

    def whitener(self, own: float) -> Any:
        return Louder()

    def solve(self, point: Any, near: Any = None) -> Solved:
        return super().solve(point, near)

    def roughly(self, point: Any, solved: Any, slopes: FloatArray, count: int) -> list[FloatArray]:
        return [
            np.linalg.norm(size) * own * np.sin(np.arange(own.shape[1]) / 10.0)
            for own, size in by_effect(point, slopes, count)
        ]


@pytest.fixture(scope="module")
def rivals() -> tuple[Ahead, Hypotheses]:
    toy = Toy(drawn(np.random.default_rng(2), twist=0.6), alike=True)
    return Ahead(toy), Hypotheses(toy, FAMILIES)


def test_only_the_run_in_which_rivals_differ_resolves_them(
    rivals: tuple[Ahead, Hypotheses],
) -> None:
    ahead, hypotheses = rivals
    bend, twist = (hypotheses.at([name]) for name in ("bend", "twist"))
    assert bend is not None
    assert twist is not None
    assert min(bend.p, twist.p) > 0.05 >= hypotheses.base.p
    (pair,) = next_runs(ahead, (bend, twist), 0.05)
    assert not pair.resolved
    assert pair.chance[0] <= 0.1
    assert pair.chance[1] >= 0.9
    assert pair.separation[1] > 10.0 > pair.separation[0]


def test_rivals_that_are_both_out_already_have_no_chance_to_leave(
    rivals: tuple[Ahead, Hypotheses],
) -> None:
    ahead, hypotheses = rivals
    bend, twist = (hypotheses.at([name]) for name in ("bend", "twist"))
    assert bend is not None
    assert twist is not None
    (pair,) = next_runs(ahead, (bend, twist), max(bend.p, twist.p))
    assert not pair.resolved
    assert np.isnan(pair.chance).all()
    assert pair.separation[1] > 10.0 > pair.separation[0]


def test_an_effect_that_is_there_puts_no_effect_out_and_not_the_other_way_round(
    rivals: tuple[Ahead, Hypotheses],
) -> None:
    """No effect is a special case of each: if it is true, nothing speaks against the effect."""
    ahead, hypotheses = rivals
    bend = hypotheses.at(["bend"])
    assert bend is not None
    (pair,) = next_runs(ahead, (bend, hypotheses.base), 0.05)
    assert pair.resolved, "the present runs reject that nothing is missing"
    assert pair.gap > 10.0
    assert (pair.chance >= 0.9).all()
    (other,) = next_runs(ahead, (hypotheses.base, bend), 0.05)
    assert other.chance == pytest.approx(pair.chance)
    assert other.gap == pytest.approx(-pair.gap)


def test_runs_that_show_the_same_are_worth_the_same(rivals: tuple[Ahead, Hypotheses]) -> None:
    """The draws are the same at every run: runs differ by what they show and not by chance."""
    ahead, hypotheses = rivals
    twins = copy(ahead)
    twins.by = {name: rows.copy() for name, rows in ahead.by.items()}
    twist = 0.2 * ahead.by["twist"][:, N + MORE :]  # weak enough not to be certain
    for name, rows in twins.by.items():
        rows[:, N:] = np.tile(twist if name == "twist" else 0.0 * twist, 2)
    bend, twist_too = (hypotheses.at([name]) for name in ("bend", "twist"))
    assert bend is not None
    assert twist_too is not None
    (pair,) = next_runs(twins, (bend, twist_too), 0.05)
    assert pair.std[0] > 0.0
    for both in (pair.chance, pair.separation, pair.std):
        # the toy's rough laws are waves over all samples, which differ in the two runs
        assert both[0] == pytest.approx(both[1], rel=1e-4)


def test_a_run_that_is_done_again_counts_twice(rivals: tuple[Ahead, Hypotheses]) -> None:
    base = rivals[1].base.null
    twice = _with(base, base.view.white).view.normal
    np.testing.assert_allclose(twice.gram, 2.0 * base.view.normal.gram)
    assert twice.count == 2 * base.view.normal.count
