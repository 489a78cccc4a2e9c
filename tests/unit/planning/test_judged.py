"""Laws of how possible runs are judged, on rivals and forecasts that are made up."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.planning.criterion import (
    NOTHING,
    RESOLVED,
    Forecast,
    NextTest,
    Noise,
    judged,
    resolving,
)
from tirelib.planning.envelope import Envelope

NOISE = Noise(random=1.0, staying=0.0)
SAMPLES = 4
ENVELOPE = Envelope({"load": (1e3, 5e3), "pressure": (2e5, 2e5), "speed": (20.0, 20.0)})


SPREADS = [np.sqrt([4.0 * 0.36 + 2.0 * 0.9**2]), np.sqrt([4.0 * 360.0 + 2.0 * 9.0**2])]


def rival(name: str, cost: float) -> Any:
    return SimpleNamespace(name=name, cost=cost, strength=np.zeros(1), in_range=True)


def forecast(first: Sequence[float], second: Sequence[float] = (), adapts: float = 0.0) -> Forecast:
    """Return waveforms of two samples that count, by run; `adapts` frees the first of them."""
    n = len(first)
    wave = np.zeros((n, SAMPLES))
    wave[:, 0] = first
    if len(second):
        wave[:, 1] = second
    slopes = np.zeros((1, n, SAMPLES))
    slopes[0, :, 0] = adapts
    return Forecast(wave, slopes, np.zeros((n, SAMPLES, 1)), np.eye(1))


def plan_of(rivals: Sequence[Any], told: Sequence[Forecast]) -> NextTest:
    n = len(told[0].wave)
    points = np.column_stack([np.linspace(1e3, 5e3, n), np.full(n, 2e5), np.full(n, 20.0)])
    trial: Any = SimpleNamespace(rivals=tuple(rivals), left_out={}, size=1.0)
    return judged(ENVELOPE, points, trial, told, 0, NOISE)


def test_the_smaller_of_both_directions_is_told() -> None:
    """One that adapts to the other is not caught, however clearly the other is."""
    told = [forecast([6.0], adapts=3.0), forecast([0.0])]
    for pair in (told, told[::-1]):
        found = plan_of([rival("a", 0.0), rival("b", 0.0)], pair)
        # 36 over a variance of 1 + 9, less what it gives away; against 36 and those 9
        assert found.score == pytest.approx([3.6 - 0.9])


def test_the_chance_weighs_the_direction_that_the_present_runs_favor() -> None:
    """If the first is right, what counts is by how much the second misses it."""
    told = [forecast([6.0]), forecast([0.0], adapts=3.0)]
    for gap in (6.0, -6.0):
        found = plan_of([rival("a", 0.0), rival("b", gap)], told)
        assert found.pairs[0].gap == gap
        expected = resolving(np.array([2.7]), np.array([45.0]), gap, SPREADS)
        assert found.probability == pytest.approx(expected)
    likely = [plan_of([rival("a", 0.0), rival("b", gap)], told).probability[0] for gap in (6, -6)]
    assert likely[1] > likely[0] + 0.1


@pytest.mark.parametrize("first", [True, False])
def test_against_nothing_only_an_effect_that_exists_counts(first: bool) -> None:
    """That nothing is missing is an effect of strength zero: it never misses that."""
    rivals = [rival(NOTHING, 3.0), rival("effect", 0.0)]
    told = [forecast([0.0]), forecast([6.0], adapts=30.0)]
    order = slice(None) if first else slice(None, None, -1)
    found = plan_of(rivals[order], told[order])
    # the effect's strength is open by 30 standard deviations
    assert found.score == pytest.approx([36.0 + 900.0])


def test_the_hardest_pair_is_the_least_parted_of_those_that_are_open() -> None:
    told = [forecast([0.0]), forecast([3.0]), forecast([3.4]), forecast([3.5])]
    costs = (0.0, 1.0, 5.0 * RESOLVED, 2.0)
    found = plan_of([rival(name, cost) for name, cost in zip("abcd", costs, strict=True)], told)
    # c and d differ by 0.01, b and d by 0.25; c is ruled out already
    assert found.pairs[found.hardest[0]].names == ("b", "d")
    assert found.score == pytest.approx([0.25])
    assert {pair.names for pair in found.open_pairs} == {("a", "b"), ("a", "d"), ("b", "d")}


def test_runs_stand_in_the_order_of_their_chance_and_pairs_follow_them() -> None:
    sizes = np.array([1.0, 8.0, 3.0, 5.0])
    found = plan_of([rival("a", 0.0), rival("b", 0.0)], [forecast(np.zeros(4)), forecast(sizes)])
    assert found.points[:, 0].tolist() == [1e3 + 4e3 / 3 * k for k in (1, 3, 2, 0)]
    assert found.score == pytest.approx(sizes[[1, 3, 2, 0]] ** 2)
    (pair,) = found.pairs
    assert pair.separation == pytest.approx(found.score)
    assert pair.probability == pytest.approx(found.probability)
    assert (np.diff(found.probability) < 0.0).all()
    # repeats are those of the best run: all noise here averages out
    assert pair.repeats[4] == pytest.approx(4.0 * 64.0)
    assert pair.needed(130.0) == 3
    assert pair.needed(1e9) is None


def test_where_every_pair_is_parted_the_order_is_by_separation() -> None:
    sizes = np.array([1.0, 0.1, 5.0])
    rivals = [rival("a", 0.0), rival("b", 100.0 * RESOLVED)]
    found = plan_of(rivals, [forecast(np.zeros(3)), forecast(sizes)])
    assert found.open_pairs == ()
    assert found.score == pytest.approx(np.sort(sizes**2)[::-1])


def test_one_rival_alone_leaves_nothing_to_judge() -> None:
    found = plan_of([rival("a", 0.0)], [forecast([1.0, 2.0])])
    assert found.points.shape == (0, 3)
    assert found.pairs == ()
