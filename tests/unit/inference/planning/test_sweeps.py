"""A campaign of sweeps is advised a sweep: its kind of run is told from the data."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.unit.inference.planning.drifting import PRESSURES, case
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.identify.force_points import ForcePoints, force_points
from tirelib.inference.planning.document import Plan, plan_document, plan_force_test
from tirelib.inference.planning.envelope import Envelope
from tirelib.inference.planning.force_runs import bench_ahead, force_envelope
from tirelib.inference.planning.suspects import given_suspects
from tirelib.inference.planning.sweep import campaign_sweep
from tirelib.report.next_test import parts_of, write_next_test

PAIR = ["friction_pressure", "friction_drift"]
DECLARED = {"speed": (20.0, 20.0), "pressure": (PRESSURES[0], PRESSURES[-1])}
ANGLES = np.deg2rad([-8.0, -4.0, -1.5, 1.5, 4.0, 8.0])


def scattered() -> ForceCase:
    """Return the same points in another order of measurement: none follows its neighbour."""
    made = case("pressure", 0.03)
    points = made.bench.points
    time = np.random.default_rng(3).permutation(points.data.time)
    mixed = replace(points, data=replace(points.data, time=time))
    return replace(made, bench=replace(made.bench, points=mixed))


@cache
def planned() -> Plan:
    made = case("pressure", 0.03)
    suspects = given_suspects(PAIR, [], CATALOGUE, "Fy")
    return plan_force_test(made, suspects, force_envelope(made, **DECLARED))


def test_the_campaign_s_kind_of_run_is_told_from_the_order_of_its_points() -> None:
    blocks = campaign_sweep(case("pressure", 0.03).bench.points, "slip_angle")
    assert blocks is not None
    assert blocks.values == pytest.approx(ANGLES, abs=1e-3)
    assert campaign_sweep(scattered().bench.points, "slip_angle") is None
    assert force_envelope(scattered(), **DECLARED).sweep is None
    assert force_envelope(scattered(), **DECLARED).points == 1


def in_runs(slips: list[int], camber: float = 0.0) -> ForcePoints:
    """Return points in runs of so many slips, at two loads or, if it is given, two cambers."""
    data, n = case("pressure", 0.03).bench.points.data, sum(slips)
    number = np.repeat(np.arange(len(slips)), slips)
    here = data.take(np.zeros(n, dtype=np.int64))
    level = np.zeros(n) if camber else 2e3 * (number % 2)
    return force_points(
        replace(
            here,
            slip_angle=np.deg2rad(np.arange(n) % 24 - 12.0),
            load=2e3 + level,
            camber=camber * (number % 2),
            time=np.arange(float(n)),
            block=np.arange(n),
        )
    )


def test_a_slip_that_is_visited_twice_has_the_rate_of_each_visit() -> None:
    made, angles = in_runs([12] * 4), np.deg2rad([-6.0, -3.0, -1.0, 1.0, 3.0, 6.0])
    visited = replace(made.data, slip_angle=np.tile(np.repeat(angles, 2), 4))
    found = campaign_sweep(
        replace(made, data=visited, slip_rate=np.full(len(made), 0.05)), "slip_angle"
    )
    assert found is not None
    assert found.values == pytest.approx(angles)
    assert found.rates == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("slips", "camber", "several"),
    [
        ([4] * 6, 0.0, True),
        ([3] * 6, 0.0, False),  # three slips are no sweep
        ([6] * 5 + [1] * 20, 0.0, True),  # more than half of the points are in runs of many
        ([6] * 5 + [1] * 40, 0.0, False),
        ([2] * 12, 0.05, False),  # another camber begins another run
    ],
)
def test_most_points_are_in_runs_of_four_slips_or_each_is_a_run(
    slips: list[int], camber: float, several: bool
) -> None:
    assert (campaign_sweep(in_runs(slips, camber), "slip_angle") is not None) == several


def test_either_kind_may_be_asked_for() -> None:
    points = scattered().bench.points
    asked = campaign_sweep(points, "slip_angle", wanted=True)
    assert asked is not None
    assert asked.values == pytest.approx(ANGLES, abs=1e-3)
    assert force_envelope(case("pressure", 0.03), sweep=False, **DECLARED).sweep is None


def test_a_sweep_there_and_back_keeps_both_directions_and_their_rates() -> None:
    data = case("pressure", 0.03).bench.points.data
    turn = np.concatenate([np.arange(12), np.arange(12)[::-1]])
    angle = np.linspace(-0.15, 0.15, 12)[turn]
    base = data.take(np.zeros(48, dtype=np.int64))
    time = np.concatenate([0.5 * np.arange(24), 40.0 + 0.5 * np.arange(24)])
    load = np.repeat([2e3, 4e3], 24)
    swept = replace(
        base, slip_angle=np.tile(angle, 2), time=time, load=load, block=np.repeat([0, 1], 24)
    )
    found = campaign_sweep(force_points(swept), "slip_angle")
    assert found is not None
    # where it turns, both directions are one pass
    assert len(found) == 23
    inner = found.rates[np.abs(found.values) < 0.1]
    assert np.sort(np.sign(inner)).tolist() == [-1.0] * 8 + [1.0] * 8
    assert np.abs(inner) == pytest.approx(np.full(16, 2.0 * 0.3 / 11.0), rel=1e-6)
    wide = found.over(-0.3, 0.15)
    assert wide.values.min() == pytest.approx(-0.3)
    assert wide.values.max() == pytest.approx(0.15)
    assert np.abs(wide.rates).max() == pytest.approx(2.0 * np.abs(found.rates).max())


def test_a_declared_range_stretches_the_sweep_and_one_without_slips_is_refused() -> None:
    made = case("pressure", 0.03)
    envelope = force_envelope(made, slip_angle=(-0.05, np.deg2rad(12.0)), **DECLARED)
    assert envelope.sweep is not None
    assert envelope.sweep.values[[0, -1]] == pytest.approx([-0.05, np.deg2rad(12.0)])
    assert "slip_angle" not in envelope.names
    right = force_envelope(made, slip_angle=(0.0, 0.1), **DECLARED).sweep
    assert right is not None
    assert (right.values > 0.0).all()
    with pytest.raises(ParameterError, match="no slip of the campaign's sweeps"):
        force_envelope(made, slip_angle=(0.0, 0.0), **DECLARED)


def test_the_points_of_a_sweep_are_one_block_and_follow_the_campaign() -> None:
    made = case("pressure", 0.03)
    envelope = force_envelope(made, **DECLARED)
    wanted = envelope.grid()[:3]
    present, n = made.bench, len(made.bench.points)
    bench = bench_ahead(present, made.model, envelope, wanted)
    assert len(bench.points) == n + 3 * 6
    ahead = bench.take(np.arange(n, n + 18))
    assert ahead.conditions.slip_angle.reshape(3, 6) == pytest.approx(
        np.tile(ANGLES, (3, 1)), abs=1e-3
    )
    assert ahead.conditions.load == pytest.approx(np.repeat(wanted[:, 0], 6))
    block = ahead.points.data.block
    assert block.tolist() == np.repeat(block[::6], 6).tolist()
    assert np.unique(block).size == 3
    assert block.min() > present.points.data.block.max()


def test_set_points_that_are_off_alike_cost_a_sweep_more_than_independent_ones() -> None:
    """A load that is off shifts the force of all points alike, in proportion."""
    made = case("pressure", 0.03)
    envelope, n = force_envelope(made, **DECLARED), len(made.bench.points)
    bench = bench_ahead(made.bench, made.model, envelope, envelope.grid()[:1])
    data = bench.points.data
    single = np.concatenate([data.block[:n], data.block[n] + np.arange(6)])
    apart = replace(bench, points=replace(bench.points, data=replace(data, block=single)))
    problem, more = made.as_given(list(CATALOGUE.values())), np.ones(6)
    sizes = {}
    for name, each in (("together", bench), ("apart", apart)):
        ahead = problem.followed_by(each, more)
        like_load = ahead.solve(problem.start).force.copy()
        like_load[:n] = 0.0
        sizes[name] = float(np.sum(ahead.whitener(0.0)(like_load[None]) ** 2))
    assert sizes["together"] < 0.5 * sizes["apart"]


def test_a_sweep_adds_more_than_its_best_point_and_is_told_so() -> None:
    made = case("pressure", 0.03)
    plan = planned()
    point = plan_force_test(made, plan.suspects, force_envelope(made, sweep=False, **DECLARED))
    assert plan.test is not None
    assert point.test is not None
    assert plan.test.score[0] > point.test.score[0]
    document = plan_document(plan)
    best = document["best"]
    assert best["slip_angle_deg"] is None
    assert best["slip_angles_deg"] == pytest.approx(np.rad2deg(ANGLES), abs=0.05)
    assert best["pressure_bar"] == pytest.approx(PRESSURES[0] / 1e5)
    assert document["envelope"]["slip_angle_deg"] == pytest.approx([-8.0, 8.0], abs=0.05)
    assert document["envelope"]["points_of_run"] == 6
    said = plan.test.envelope.text(plan.test.points[0])
    assert said.endswith("a sweep of 6 slip angles from -8.0 to 8.0 deg")


def test_the_page_of_sweeps_tells_their_slips(tmp_path: object) -> None:
    from pathlib import Path

    page, words = write_next_test(planned(), Path(str(tmp_path)))
    assert "-8.0 to 8.0 deg" in words.read_text(encoding="utf-8")
    assert "Every run is a sweep" in page.read_text(encoding="utf-8")


def test_a_map_of_sweeps_may_have_load_and_pressure_alone() -> None:
    plan, sweep = planned(), force_envelope(case("pressure", 0.03), **DECLARED).sweep
    envelope = Envelope(
        {"load": (2e3, 6e3), "pressure": (PRESSURES[0], PRESSURES[-1])}, sweep=sweep
    )
    other = plan_force_test(case("pressure", 0.03), plan.suspects, envelope)
    (plot,) = next(part for part in parts_of(other) if part.plots).plots
    assert [len(trace.y) for trace in plot.figure.data] == [1, 1, 1, 1]
    assert len(plot.rows) == 5 * 3
