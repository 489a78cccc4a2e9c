"""A case of strain that the advised run resolves."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.planning.made import (
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
from tirelib.core.errors import ParameterError
from tirelib.inference.planning.document import Plan, advice, plan_document
from tirelib.inference.planning.next_test import NOTHING, gains, next_test
from tirelib.inference.statistics.next_run import DRAWS


def test_both_look_alikes_are_in_the_confidence_set() -> None:
    test = planned()
    assert [rival.name for rival in test.rivals] == [TWIN, PLANTED]
    assert made().base.p <= 0.05
    (pair,) = test.pairs
    assert not pair.resolved
    # the second is planted: that the first is worse is a negative gap
    assert pair.gap < 0.0
    assert pair.better == PLANTED
    assert test.rivals[1].strength == pytest.approx([STRENGTH], rel=0.05)


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
    assert planted.p > 0.05 >= after.against(twin, planted).p


def test_a_suspect_that_the_plan_cannot_show_is_left_out_with_the_reason() -> None:
    test = next_test(made(), suspects(PLANTED, "camber"), envelope())
    assert test.left_out == {"camber": "no run has a camber"}
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
    assert [rival.name for rival in test.rivals] == [PLANTED, NOTHING]
    by = list(gains(made(), alone, test)[PLANTED].values())
    assert (np.diff(by) >= -1e-9).all()
    assert by[0] > 0.9
    assert gains(made(), suspects(), planned()) == {}
