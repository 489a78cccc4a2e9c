import pytest

from tirelib.core.errors import ParameterError
from tirelib.rig.plans import PLANS, kind, plan, with_repeats
from tirelib.rig.tire import Condition


def test_plans_have_the_runs_of_the_tables() -> None:
    counts = {name: len(plan(name).conditions) for name in PLANS}
    assert counts["set1"] == 55
    assert counts["set2"] == 66
    assert counts["set3"] == 7 + 12
    assert counts["straight"] == 60
    assert plan("straight").repeats == 6
    assert counts["combined"] == 25


def test_set1_is_table_3_1() -> None:
    conditions = plan("set1").conditions
    assert sorted({round(c.load) for c in conditions}) == [1200, 3000, 4800, 6600, 8400]
    assert len({c.slip_angle for c in conditions}) == 11
    assert {round(c.speed * 3.6) for c in conditions} == {65}
    assert {round(c.pressure) for c in conditions} == {230000}


def test_kinds_follow_the_set_points() -> None:
    base = Condition(4800.0, 2.3e5, 18.0)
    assert kind(base) == "free"
    for change, name in (
        ({"slip_angle": 0.1}, "corner"),
        ({"camber": 0.1, "slip_angle": 0.1}, "camber"),
        ({"slip_ratio": -0.1}, "brake"),
        ({"slip_ratio": 0.1}, "drive"),
        ({"slip_ratio": 0.1, "slip_angle": 0.1}, "combined"),
    ):
        assert kind(Condition(4800.0, 2.3e5, 18.0, **change)) == name


def test_repeats_are_runs_of_the_plan() -> None:
    p = plan("set1")
    runs = with_repeats(p, 6)
    assert len(runs) == 61
    assert len(set(runs[55:])) == 6
    assert set(runs[55:]) <= set(p.conditions)
    with pytest.raises(ParameterError, match="allowed"):
        with_repeats(p, 56)


def test_unknown_plan_names_the_known_ones() -> None:
    with pytest.raises(ParameterError, match="set3_cornering"):
        plan("set9")
