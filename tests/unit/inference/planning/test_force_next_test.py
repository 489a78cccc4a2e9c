"""A drift and a condition that was visited in order: who is named, and which point parts them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.unit.inference.planning.drifting import NOISE, PRESSURES, case, side_force
from tirelib.cli.next_test import _idle
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.assess import ForceAssessment, assess_forces
from tirelib.inference.diagnose.document import diagnosis_document
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.models import plain_tires
from tirelib.inference.planning.document import Plan, advice, plan_document, plan_force_test
from tirelib.inference.planning.envelope import Envelope
from tirelib.inference.planning.force_runs import bench_ahead, force_axes
from tirelib.inference.planning.next_test import NOTHING, NextTest
from tirelib.inference.planning.suspects import given_suspects, suspects_of
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.problem import Point

PAIR = ["friction_pressure", "friction_drift"]
BRUSH = [effect for effect in CATALOGUE.values() if effect.hook == "brush"]
WEAK = ("pressure", 0.06)
"""So little that these points leave both of the pair in the confidence set."""


@cache
def told(kind: str, size: float) -> ForceAssessment:
    return assess_forces(case(kind, size), BRUSH)


def envelope(made: ForceCase) -> Envelope:
    return Envelope.of(
        made.bench.conditions,
        force_axes(made),
        speed=(20.0, 20.0),
        pressure=(PRESSURES[0], PRESSURES[-1]),
    )


@cache
def planned() -> NextTest:
    made = case(*WEAK)
    suspects = given_suspects(PAIR, [], CATALOGUE, "Fy")
    test = plan_force_test(made, suspects, envelope(made)).test
    assert test is not None
    return test


def test_wear_is_never_taken_for_the_pressure_that_was_visited_in_order() -> None:
    found = told("wear", 0.12)
    assert "friction_drift" in found.named
    assert found.verdict in ("named", "indistinguishable")
    if found.verdict == "named":
        assert found.named == ("friction_drift",)


def test_pressure_that_was_visited_in_order_is_never_taken_for_wear() -> None:
    found = told("pressure", 0.35)
    assert "friction_pressure" in found.named
    if found.verdict == "named":
        assert "friction_drift" not in found.named


def test_what_serves_as_well_is_indistinguishable_and_the_test_is_told() -> None:
    # a drift so small that nothing is missing at 5 %: at 10 % something is, and these runs do not
    # tell it from the pressure; a larger one is named
    found = assess_forces(case("wear", 0.05, seed=2), BRUSH, false_alarm=0.1)
    assert assess_forces(case("wear", 0.08, seed=2), BRUSH).named == ("friction_drift",)
    assert found.verdict == "indistinguishable"
    assert set(PAIR) <= set(found.named)
    document = diagnosis_document(found)
    assert document["sets"] == [[name] for name in found.named]
    assert document["next_test"]["between"] == list(found.named)
    assert "repeat the first pressure at the end" in document["next_test"]["what"]
    assert suspects_of(document, CATALOGUE).names == found.named


def test_beside_sure_names_what_would_serve_as_well_is_on_trial() -> None:
    document = diagnosis_document(told("pressure", 0.35))
    sets = [["carcass", PAIR[0]], ["carcass", PAIR[1]]]
    document |= {"verdict": "form_inadequate", "named": sets[0], "sets": sets}
    found = suspects_of(document, CATALOGUE)
    assert found.names == tuple(PAIR)
    assert found.beside == ("carcass",)


def test_the_advised_point_is_the_first_pressure_once_more_at_the_end() -> None:
    test = planned()
    names = test.envelope.names
    best = dict(zip(names, test.points[0], strict=True))
    assert best["pressure"] == PRESSURES[0]
    assert abs(best["slip_angle"]) > np.deg2rad(4.0)
    assert test.score[0] > 5.0 * np.median(test.score)
    assert test.dropped == 0


def test_the_advised_point_leaves_the_planted_effect_alone_in_the_set() -> None:
    made, test = case(*WEAK), planned()
    n, times = len(made.bench.points), 8
    again = np.repeat(test.points[:1], times, axis=0)
    bench = bench_ahead(made.bench, made.model, test.envelope, again)
    at = bench.conditions.take(np.arange(n, n + times))
    assert (at.order == 1.0).all()
    side = side_force(WEAK, at.load, at.pressure, at.slip_angle, at.order)
    side = side + NOISE * np.random.default_rng(8).standard_normal(times)
    data = replace(bench.points.data, Fy=np.concatenate([made.bench.points.data.Fy, side]))
    bench = replace(bench, points=replace(bench.points, data=data))
    after = replace(made, bench=bench)
    inside = {}
    for when, each in (("before", made), ("after", after)):
        among = Hypotheses(each.as_given(BRUSH), plain_tires("Fy"))
        inside[when] = {
            name: fit is not None and fit.p > among.false_alarm
            for name in PAIR
            for fit in [among.at([name])]
        }
    assert inside["before"] == dict.fromkeys(PAIR, True)
    assert inside["after"] == {PAIR[0]: True, PAIR[1]: False}


def test_points_ahead_are_seen_with_the_coefficients_of_the_present_ones() -> None:
    """What may explain a residual ahead goes on as it does in the present points."""
    made, test = case(*WEAK), planned()
    problem = made.as_given(BRUSH)
    n, more = (
        len(made.bench.points),
        2 * len(made.bench.points),
    )  # they would rule all means
    wanted = np.repeat(test.points[:1], more, axis=0)
    bench = bench_ahead(made.bench, made.model, test.envelope, wanted)
    ahead = problem.followed_by(bench, np.ones(more))
    assert ahead.run_ahead.tolist() == [-1] * n + list(range(more))
    here, there = problem.solve(problem.start), ahead.solve(problem.start)
    assert there.rest[:n] == pytest.approx(here.rest)
    assert there.rest[n:] == pytest.approx(-there.force[n:])
    for name, rows in problem.remainder(problem.start, here).items():
        found = ahead.remainder(problem.start, there)[name][:, :n]
        assert found == pytest.approx(rows, abs=1e-4 * np.abs(rows).max())
    point = Point(problem.start.base, (CATALOGUE["friction_load"],), (np.array([0.1]),))
    errors = []
    for each in (problem, ahead):
        solved = each.solve(point)
        errors.append(each.roughly(point, solved, each.slopes(point, solved), 1)[0][:, :n])
    assert errors[1] == pytest.approx(errors[0], abs=1e-4 * np.abs(errors[0]).max())
    # the same points once more behind themselves: every row is repeated
    joint = made.bench.take(np.tile(np.arange(n), 2))
    block = np.concatenate([np.arange(n), n + np.arange(n)])
    points = replace(joint.points, data=replace(joint.points.data, block=block))
    twice = problem.followed_by(replace(joint, points=points), np.ones(n))
    solved = twice.solve(problem.start)
    for rows in twice.remainder(problem.start, solved).values():
        assert rows[:, n:] == pytest.approx(rows[:, :n], abs=1e-9 * np.abs(rows).max())
    white = twice.whitener(0.001)(solved.force[None])[0]
    assert white[n:] == pytest.approx(white[:n])
    # the mean of four is twice as sure, noise and set points
    four = problem.followed_by(twice.bench, np.full(n, 4.0)).whitener(0.0)
    white = four(solved.force[None])[0]
    assert white[n:] == pytest.approx(2.0 * white[:n])


def test_a_point_ahead_is_told_in_engineers_units_and_repeats_add() -> None:
    made, test = case(*WEAK), planned()
    suspects = given_suspects(PAIR, [], CATALOGUE, "Fy")
    plan = plan_force_test(made, suspects, test.envelope)
    document = plan_document(plan)
    assert (document["quantity"], document["between"]) == ("Fy", PAIR)
    best = document["best"]
    assert best["slip_angle_deg"] == pytest.approx(np.rad2deg(test.points[0, 3]))
    assert best["speed_kmh"] == pytest.approx(72.0)
    assert document["noise"]["unit"] == "N"
    assert document["noise"]["random"] == pytest.approx(NOISE)
    reached = list(test.pairs[0].repeats.values())
    assert reached == sorted(reached)
    assert reached[-1] <= test.pairs[0].limit


def test_a_run_that_separates_nothing_is_said_so_without_a_chance() -> None:
    test, suspects = planned(), given_suspects(PAIR, [], CATALOGUE, "Fy")
    none = np.full(len(test.points), np.nan)

    def said(separation: float) -> str:
        pairs = tuple(
            replace(p, resolved=False, separation=np.full(none.size, separation), probability=none)
            for p in test.pairs
        )
        score = np.full(len(test.points), separation)
        planned_so = replace(test, pairs=pairs, score=score, probability=none)
        return advice(Plan(suspects, planned_so, {}, 20.0, "x", "Fy"))

    assert said(0.0) == (
        "No run of this envelope separates friction_pressure and friction_drift (separation at "
        "most 0.0 in chi-square)"
    )
    assert "(chi-square 30.0); the present runs reject both as they stand, so no" in said(30.0)


def test_conditions_that_matter_to_no_suspect_are_merged() -> None:
    runs = [
        {
            "load_N": load,
            "speed_kmh": speed,
            "separation": load / 1e3,
            "separation_std": 1.0,
            "resolves_probability": None,
        }
        for load in (2e3, 4e3)
        for speed in (20.0, 60.0)
    ]
    assert _idle(runs, ["load_N", "speed_kmh"]) == {"speed_kmh"}
    runs[0]["separation"] = 7.0
    assert _idle(runs, ["load_N", "speed_kmh"]) == set()


def test_the_whole_plan_again_shows_an_effect_more_likely() -> None:
    made = case(*WEAK)
    alone = given_suspects(PAIR[:1], [], CATALOGUE, "Fy")
    plan = plan_force_test(made, alone, envelope(made))
    assert plan.test is not None
    assert [rival.name for rival in plan.test.rivals] == [PAIR[0], NOTHING]
    chances = list(plan.gains[PAIR[0]].values())
    assert (np.diff(chances) >= -1e-9).all()
    assert 0.0 < chances[0] < chances[-1] <= 1.0


def test_what_a_force_cannot_have_is_refused() -> None:
    made = case(*WEAK)
    with pytest.raises(ParameterError, match="low_pass acts on strain, which Fy does not show"):
        given_suspects(["low_pass"], [], CATALOGUE, "Fy")
    at = made.bench.conditions
    with pytest.raises(ParameterError, match="a range of camber is declared"):
        Envelope.of(at, force_axes(made), camber=(0.0, 0.1))
    with pytest.raises(ParameterError, match=r"slip angle 5\.73 to -5\.73 deg"):
        Envelope.of(at, force_axes(made), slip_angle=(0.1, -0.1))
