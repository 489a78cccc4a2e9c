"""Effects planted in plain tires, and how the plan's chances are given."""

import pytest

from tests.unit.inference.diagnose.planted import runs
from tests.unit.inference.identify.model_waves import TIRE
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.inference.planning.selftest import Planting, SelfTest, selftest, selftest_document
from tirelib.inference.statistics.chance import Judged, Plans
from tirelib.model.base import values_of

REPEATS = 6


def self_tested(repeats: int) -> SelfTest:
    return selftest(
        runs(),
        values_of(TIRE),
        list(CATALOGUE.values()),
        only=("temperature", "tread_load"),
        ratios=(1.001, 1.5, 5000.0),
        repeats=repeats,
    )


@pytest.fixture(scope="module")
def tested() -> SelfTest:
    return self_tested(REPEATS)


def planting(tested: SelfTest, name: str, ratio: float) -> Planting:
    return next(p for p in tested.plantings if (p.effect.name, p.ratio) == (name, ratio))


def test_plain_tires_raise_no_more_alarms_than_a_faint_effect(tested: SelfTest) -> None:
    assert tested.alarms <= planting(tested, "temperature", 1.001).seen <= 1


def test_the_strength_grows_with_the_ratio(tested: SelfTest) -> None:
    """Squares add: the strength goes with the root of the squared ratio less one."""
    faint, strong = (planting(tested, "temperature", ratio) for ratio in (1.001, 1.5))
    share = ((1.5**2 - 1.0) / (1.001**2 - 1.0)) ** 0.5
    assert strong.strength == pytest.approx(share * faint.strength)
    assert strong.seen >= faint.seen
    assert len(strong.named) == REPEATS


def test_what_is_planted_is_the_strength_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """In ranges of the effect: at its plausible end it has its largest ratio."""
    planted, done = Plans.planted, []

    def noted(plans: Plans, name: str, strength: float) -> Judged:
        done.append(CATALOGUE[name].scale * strength)
        return planted(plans, name, strength)

    monkeypatch.setattr(Plans, "planted", noted)
    found = self_tested(3)
    told = [each for each in found.plantings if each.reachable]
    assert done == pytest.approx([each.strength for each in told])
    for each in told:
        share = (each.strength / each.effect.toward) ** 2
        most = found.largest[each.effect.name]
        assert share == pytest.approx((each.ratio**2 - 1.0) / (most**2 - 1.0))


def test_what_no_plausible_strength_reaches_is_not_planted(tested: SelfTest) -> None:
    far = planting(tested, "temperature", 5000.0)
    assert not far.reachable
    assert far.named == ()
    assert tested.largest["temperature"] < 5000.0
    assert abs(far.strength) > CATALOGUE["temperature"].high


def test_the_document_gives_chances_with_intervals_and_that_they_are_optimistic(
    tested: SelfTest,
) -> None:
    told = selftest_document(tested)
    assert told["format"] == "tirelib-selftest/1"
    assert told["optimistic"] is True
    assert {entry["effect"] for entry in told["effects"]} == {"temperature", "tread_load"}
    entry = next(e for e in told["effects"] if e["effect"] == "temperature")
    strong = entry["results"][1]
    assert strong["found"] == planting(tested, "temperature", 1.5).right / REPEATS
    assert strong["found_low"] <= strong["found"] <= strong["found_high"]
    assert strong["found"] <= strong["in_set"] <= strong["seen"]
    assert entry["results"][2]["found"] is None
    assert told["false_alarms"]["n"] == REPEATS
    assert told["dead"]["camber"] == "no run has a camber"


def test_more_tires_than_there_are_is_refused() -> None:
    with pytest.raises(ParameterError, match="100000 tires are asked for"):
        self_tested(100000)
