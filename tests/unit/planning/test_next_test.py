"""Laws of the criterion, and a case that the advised run resolves."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.planning.made import (
    PLANTED,
    STRENGTH,
    TWIN,
    envelope,
    hypotheses,
    made,
    planned,
    runs,
    suspects,
)
from tirelib.errors import ParameterError
from tirelib.infer.next_run import DRAWS
from tirelib.planning.criterion import ENDLESS, NOTHING, RESOLVED, Forecast, Noise, resolving
from tirelib.planning.document import Plan, advice, plan_document
from tirelib.planning.next_test import gains, next_test

SPLIT = Noise(random=2.0, staying=1.5)


def missed(told: Forecast, wave: np.ndarray, repeats: float = 1.0) -> np.ndarray:
    """Return by how much a rival misses another waveform that is as unsure as its own."""
    return told.missed(replace(told, wave=wave), SPLIT, repeats)[0]


def forecast(scale: float = 1.0) -> tuple[Forecast, np.ndarray]:
    random = np.random.default_rng(1)
    factor = random.standard_normal((3, 3))
    told = Forecast(
        random.standard_normal((2, 20)),
        random.standard_normal((3, 2, 20)),
        random.standard_normal((2, 20, 4)),
        scale * (factor @ factor.T + np.eye(3)),
    )
    return told, told.wave + random.standard_normal((2, 20))


@pytest.mark.parametrize("repeats", [1.0, 3.0])
def test_the_separation_is_the_squared_difference_in_the_metric_of_all_that_is_unsure(
    repeats: float,
) -> None:
    told, other = forecast()
    found = missed(told, other, repeats)
    for p in range(2):
        slopes, tangents = told.slopes[:, p], told.tangents[p]
        whole = (
            (SPLIT.staying**2 + SPLIT.random**2 / repeats) * np.eye(20)
            + tangents @ tangents.T / repeats
            + slopes.T @ told.covariance @ slopes
        )
        difference = other[p] - told.wave[p]
        assert found[p] == pytest.approx(difference @ np.linalg.solve(whole, difference))


def test_who_predicts_the_same_is_not_separated_and_twice_the_difference_counts_four_times() -> (
    None
):
    told, other = forecast()
    assert missed(told, told.wave) == pytest.approx(0.0)
    twice = told.wave + 2.0 * (other - told.wave)
    assert missed(told, twice) == pytest.approx(4.0 * missed(told, other))


def test_what_is_told_is_the_mean_and_the_variance_of_the_chi_square_between_rivals() -> None:
    """By draws of the true one's forecast; the one that misses has numbers of its own."""
    one, wave = forecast()
    other = replace(
        one,
        wave=wave,
        slopes=2.0 * one.slopes[::-1],
        tangents=0.5 * one.tangents,
        covariance=1.5 * one.covariance,
    )
    mean, variance = one.missed(other, SPLIT, 2.0)
    random = np.random.default_rng(6)
    for p in range(2):
        own, true = (each.spread(SPLIT, 2.0)[p] for each in (one, other))
        drawn = random.multivariate_normal(other.wave[p], true, 40000)
        costs = [
            np.sum((drawn - each.wave[p]) * np.linalg.solve(v, (drawn - each.wave[p]).T).T, axis=1)
            for each, v in ((one, own), (other, true))
        ]
        gap = costs[0] - costs[1]
        assert mean[p] == pytest.approx(gap.mean(), abs=5.0 * gap.std() / 200.0)
        assert variance[p] == pytest.approx(gap.var(), rel=0.1)


def test_an_effect_whose_strength_is_open_may_be_far_from_its_best_guess() -> None:
    """Two best guesses alike say nothing of a run at which one of them is hardly known."""
    told, _ = forecast()
    vague = replace(told, covariance=50.0 * told.covariance)
    assert (told.missed(vague, SPLIT, 1.0)[0] > 10.0).all()
    # the other way round it only gives away what it is unsure of
    assert (vague.missed(told, SPLIT, 1.0)[0] < 0.0).all()


def test_a_rival_that_knows_its_numbers_less_is_harder_to_catch() -> None:
    sharp, other = forecast(1e-6)
    vague, _ = forecast(100.0)
    assert (missed(vague, other) < missed(sharp, other)).all()


@given(first=st.integers(1, 30), more=st.integers(1, 30))
def test_repeats_never_harm_and_structure_limits_them(first: int, more: int) -> None:
    told, other = forecast()
    few, many = (missed(told, other, n) for n in (first, first + more))
    limit = missed(told, other, ENDLESS)
    assert (few <= many).all()
    assert (many <= limit).all()


@given(gap=st.floats(-9.0, 9.0), first=st.floats(0.01, 200.0), second=st.floats(0.01, 200.0))
def test_the_chance_to_resolve_is_a_chance_and_blind_to_names(
    gap: float, first: float, second: float
) -> None:
    one = resolving(np.array([first]), np.array([second]), gap)[0]
    other = resolving(np.array([second]), np.array([first]), -gap)[0]
    assert 0.0 <= one <= 1.0 + 1e-12
    assert one == pytest.approx(other)


def test_a_separation_as_large_as_the_bar_resolves_every_other_time() -> None:
    size = np.array([RESOLVED, 4.0 * RESOLVED, 0.0])
    chance = resolving(size, size, 0.0)
    # the wrong rival gains the bar by chance in 1 of 1000
    assert chance[0] == pytest.approx(0.5, abs=2e-3)
    assert chance[1] > 0.98
    assert chance[2] == pytest.approx(0.0, abs=1e-12)


def test_a_run_counts_by_what_it_does_if_the_likelier_one_is_right() -> None:
    clear, faint = np.array([60.0]), np.array([0.0])
    # 8 in chi-square are odds of 55 to 1
    assert resolving(clear, faint, 8.0)[0] > 0.95
    assert resolving(faint, clear, 8.0)[0] < 0.05
    assert resolving(clear, faint, 0.0)[0] == pytest.approx(0.5, abs=0.01)
    # likelihoods are exp of minus half a chi-square: three to one
    assert resolving(100.0 * clear, faint, 2.0 * np.log(3.0))[0] == pytest.approx(0.75, abs=0.01)


def test_both_look_alikes_are_in_the_confidence_set() -> None:
    test = planned()
    assert [rival.name for rival in test.trial.rivals] == [TWIN, PLANTED]
    assert made().base.p <= 0.05
    (pair,) = test.pairs
    assert not pair.resolved
    # the second is planted: that the first is worse is a negative gap
    assert pair.gap < 0.0
    assert pair.better == PLANTED
    assert test.trial.rivals[1].strength == pytest.approx([STRENGTH], rel=0.05)


def test_runs_are_ranked_and_the_slow_one_at_the_end_of_the_day_is_advised() -> None:
    """Only there has the tire had its time and not its speed."""
    test = planned()
    assert (np.diff(np.round(test.probability, 3)) <= 0.0).all()
    assert test.points[0, 2] == test.points[:, 2].min()
    # a run that tells nothing rejects at the false-alarm rate, up to the scatter of its draws
    nothing = 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / DRAWS)
    assert test.probability[0] > 0.7 > nothing > test.probability[-1]
    assert len(test.points) + test.dropped == len(test.envelope.grid())
    (pair,) = test.pairs
    assert pair.repeats[1] == pytest.approx(pair.separation[0], rel=1e-6)
    assert pair.limit >= 0.9 * max(pair.repeats.values())


def test_the_advised_run_leaves_the_planted_effect_alone_in_the_set() -> None:
    load, pressure, speed = planned().points[0]
    after = hypotheses(runs(further=(load, pressure, speed)))
    planted, twin = (after.at([name]) for name in (PLANTED, TWIN))
    assert planted is not None
    assert twin is not None
    assert planted.p > 0.05 >= twin.p


def test_a_suspect_that_the_plan_cannot_show_is_left_out_with_the_reason() -> None:
    test = next_test(made(), suspects(PLANTED, "camber"), envelope())
    assert test.trial.left_out == {"camber": "no run has a camber"}
    assert not len(test.points)
    assert "fewer than two suspects" in advice(
        Plan(suspects(PLANTED, "camber"), test, {}, 20.0, "")
    )


def test_runs_beyond_the_tires_validity_are_dropped_and_counted() -> None:
    far = envelope(load=(4e3, 4e4), pressure=(2e5, 2e5), speed=(20.0, 20.0))
    test = next_test(made(), suspects(), far)
    assert test.dropped == 1
    assert len(test.points) == 1
    assert np.isfinite(test.score).all()
    hopeless = replace(far, ranges={**far.ranges, "load": (4e4, 5e4)})
    with pytest.raises(ParameterError, match="no solution at any of its 2 runs"):
        next_test(made(), suspects(), hopeless)


def test_the_document_holds_the_contracts_keys_in_engineers_units() -> None:
    test = planned()
    plan = Plan(suspects(), test, {}, 20.0, "made")
    told = plan_document(plan)
    assert told["format"] == "tirelib-next-test/1"
    assert told["best"] == told["candidates"][0]
    best = told["best"]
    assert best["load_N"] == pytest.approx(test.points[0, 0])
    assert best["pressure_bar"] == pytest.approx(1e-5 * test.points[0, 1])
    assert best["speed_kmh"] == pytest.approx(3.6 * test.points[0, 2])
    assert best["separation_std"] == pytest.approx(test.std[0])
    assert best["pair"] == [TWIN, PLANTED]
    assert told["random_median"]["separation"] < best["separation"]
    assert told["envelope"]["declared"] == []
    assert told["envelope"]["load_N"] == pytest.approx([2250.0, 7500.0])
    assert "measure" in advice(plan)


def test_repeats_of_the_plan_show_a_strong_effect_and_never_lower_the_chance() -> None:
    alone = suspects(PLANTED)
    assert alone.with_nothing
    test = next_test(made(), alone, envelope())
    assert [rival.name for rival in test.trial.rivals] == [PLANTED, NOTHING]
    by = list(gains(made(), alone, test)[PLANTED].values())
    assert (np.diff(by) >= -1e-9).all()
    assert by[0] > 0.9
    assert gains(made(), suspects(), planned()) == {}
