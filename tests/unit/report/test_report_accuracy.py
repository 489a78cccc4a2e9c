"""Laws of the accuracy table, the levels and the study of the cut-off."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pages.cutoff_study import nearest_runs, study_cut_off

from tests.unit.report.conftest import World
from tirelib.estimators.result import TRUTH
from tirelib.measured.signal.lowpass import DEFAULT_ORDER
from tirelib.report.accuracy import WIDTH, Compared, accuracies, accuracy, compare
from tirelib.report.levels import camber_levels, find_levels, load_levels, reference_level, upright


def made(error: np.ndarray, std: float = 1.0, turns_per_run: int = 4) -> Compared:
    unit = np.repeat(np.arange(error.size // turns_per_run), turns_per_run)
    truth = 1000.0 + 100.0 * unit.astype(np.float64)
    return Compared("Fz", truth, truth + error, np.full(error.size, std), truth, unit, error.size)


def test_a_perfect_estimate_has_no_error_and_full_determination() -> None:
    row = accuracy(made(np.zeros(40)))
    assert (row.rmse, row.r2, row.coverage, row.runs, row.turns) == (0.0, 1.0, 1.0, 10, 40)


def test_errors_that_cancel_within_a_run_do_not_count() -> None:
    row = accuracy(made(np.tile([3.0, -3.0, 5.0, -5.0], 10), std=2.0))
    assert row.rmse == pytest.approx(0.0, abs=1e-9)
    assert row.coverage == pytest.approx(0.5)  # 3 lies within 1.96 times 2, 5 does not


def test_the_coverage_of_honest_intervals_is_95_percent() -> None:
    error = np.random.default_rng(1).standard_normal(40000)
    assert accuracy(made(error)).coverage == pytest.approx(0.95, abs=0.004)  # 3.7 sigma of 40000


def test_an_estimate_that_always_says_the_mean_determines_nothing() -> None:
    truth = made(np.zeros(40)).measured
    assert accuracy(made(truth.mean() - truth)).r2 == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("quantity", ["Fz", "alpha", "kappa", "Fy"])
def test_an_interval_is_told_in_the_unit_of_its_quantity(world: World, quantity: str) -> None:
    """As many turns lie within it as within the interval of the estimate in SI."""
    observations, estimates = world.observations["set1"], world.estimates["set1"]
    found = compare(observations, estimates, quantity)
    truth, rows = observations.truth[TRUTH[quantity]], estimates.valid[quantity]
    apart = np.abs(estimates.value[quantity] - truth)[rows]
    np.testing.assert_array_equal(found.inside, apart <= WIDTH * estimates.std[quantity][rows])
    assert 0.5 < found.inside.mean() <= 1.0


def test_a_constant_error_is_a_share_of_the_range() -> None:
    row = accuracy(made(np.full(40, 9.0)))
    assert row.rmse == pytest.approx(9.0)
    assert row.percent_of_range == pytest.approx(1.0)  # the range is 900


def test_a_quantity_that_was_not_varied_has_no_share_of_its_range(world: World) -> None:
    rows = {r.quantity: r for r in accuracies(world.observations["set1"], world.estimates["set1"])}
    assert np.isnan(rows["kappa"].r2)
    assert np.isnan(rows["kappa"].percent_of_range)
    assert rows["Fz"].r2 > 0.99


def test_invalid_turns_are_left_out(world: World) -> None:
    observations, estimates = world.observations["set1"], world.estimates["set1"]
    none = {q: np.zeros_like(v) for q, v in estimates.valid.items()}
    assert accuracies(observations, replace(estimates, valid=none)) == []
    compared = compare(observations, estimates, "alpha")
    assert np.isfinite(compared.measured).all()
    assert np.abs(compared.measured).max() < 6.0  # degrees


def test_levels_part_at_gaps_and_hold_every_known_value() -> None:
    values = np.array([1200.0, 3010.0, 1190.0, 2990.0, np.nan, 4800.0])
    levels = load_levels(values)
    assert [level.text for level in levels] == ["1200 N", "3000 N", "4800 N"]
    assert (sum(level.rows for level in levels) == np.isfinite(values)).all()
    assert reference_level(levels).text == "3000 N"
    assert find_levels(np.array([np.nan]), 1.0, str) == []
    assert [x.text for x in camber_levels(np.array([-4.0, 0.0, 4.01]))] == [
        "camber -4 deg",
        "camber 0 deg",
        "camber +4 deg",
    ]


def test_the_level_that_stands_for_all_is_one_with_many_runs() -> None:
    loads = np.repeat([1200.0, 3000.0, 4800.0, 6600.0], [5, 1, 5, 5])
    assert reference_level(load_levels(loads)).text == "4800 N"


def test_a_wheel_that_leans_to_either_side_is_not_upright() -> None:
    leaning: Any = SimpleNamespace(camber=np.array([-2.0, -0.4, 0.0, np.nan, 0.4, 2.0]))
    assert upright(leaning).tolist() == [False, True, True, True, True, False]


def test_runs_for_the_cut_off_are_at_one_load(world: World) -> None:
    plans = nearest_runs(world.campaigns["set3"])
    assert [round(3.6 * plan.speed) for plan in plans] == [10, 65, 150]
    assert {plan.load for plan in plans} == {4500.0}


def test_the_shift_depends_on_the_order_and_not_on_the_speed(world: World) -> None:
    campaign = world.campaigns["set3"]
    study = study_cut_off(campaign, nearest_runs(campaign))
    near = int(np.argmin(np.abs(study.order - DEFAULT_ORDER)))
    assert np.abs(study.cp1_shift[:, near]).max() < 1.5e-4  # the nearest order is not the default
    low = study.order < 20.0
    # the made-up tire is the same at every speed; the noise is 20 microstrain
    assert np.ptp(study.cp1_shift[:, low], axis=0).max() < 6e-5
    refused = np.isnan(study.fixed_cp1_shift)  # 300 Hz are order 209 at 10 km/h
    assert refused.tolist() == [True, False, False]
    assert np.ptp(study.fixed_cp1_shift[~refused]) > 1e-4
    assert np.isfinite(study.cp1_shift).all()
    assert (study.angle_scatter[:, -1] > study.angle_scatter[:, near]).all()
