"""Effects planted in tires unlike the model, and how the plan's chances are told."""

import numpy as np
import pytest

from tests.unit.diagnose.planted import runs
from tests.unit.identify.model_waves import TIRE
from tests.unit.planning.made import NOISE, case
from tirelib.effects import CATALOGUE
from tirelib.model.base import values_of
from tirelib.planning.selftest import Planting, SelfTest, selftest
from tirelib.planning.selftest_document import selftest_document
from tirelib.planning.variants import Track, draw_variants


@pytest.fixture(scope="module")
def tested() -> SelfTest:
    return selftest(
        runs(),
        values_of(TIRE),
        list(CATALOGUE.values()),
        only=("temperature", "rotary_inertia"),
        ratios=(1.02, 1.5),
        repeats=4,
        members=16,
    )


def planting(tested: SelfTest, name: str, ratio: float) -> Planting:
    return next(p for p in tested.plantings if (p.effect.name, p.ratio) == (name, ratio))


def test_the_error_grows_by_about_the_ratio_that_was_asked_for(tested: SelfTest) -> None:
    # to first order, and the parameters of each tire are others
    assert planting(tested, "temperature", 1.5).reached == pytest.approx(1.5, abs=0.15)


def test_a_strong_effect_is_found_more_often_than_a_faint_one(tested: SelfTest) -> None:
    strong, faint = (planting(tested, "temperature", ratio) for ratio in (1.5, 1.02))
    assert strong.strength > faint.strength
    assert strong.right >= faint.right
    assert strong.right >= 3
    assert len(strong.named) == 4


def test_what_no_plausible_strength_reaches_is_not_planted(tested: SelfTest) -> None:
    far = planting(tested, "rotary_inertia", 1.5)
    assert not far.reachable
    assert far.named == ()
    assert tested.largest["rotary_inertia"] < 1.5
    assert abs(far.strength) > CATALOGUE["rotary_inertia"].high


def test_the_document_tells_chances_with_intervals_and_that_they_are_optimistic(
    tested: SelfTest,
) -> None:
    told = selftest_document(tested)
    assert told["format"] == "tirelib-selftest/1"
    assert told["optimistic"] is True
    assert [entry["effect"] for entry in told["effects"]] == ["temperature", "rotary_inertia"]
    strong = told["effects"][0]["results"][1]
    assert strong["found"] == planting(tested, "temperature", 1.5).right / 4
    assert strong["found_low"] < strong["found"] <= strong["found_high"]
    assert told["effects"][1]["results"][1]["found"] is None
    assert told["false_alarms"]["n"] == 4
    summary = {entry["ratio"]: entry for entry in told["summary"]}
    assert summary[1.5]["effects"] == 1
    assert told["dead"]["camber"] == "no run has a camber"
    # what a diagnosis ranks beside the catalogue can be planted no more than named
    assert set(tested.largest) <= set(CATALOGUE)


def test_variants_repeat_with_their_seed_and_differ_with_another() -> None:
    made = case()
    waves = []
    for seed in (1, 1, 2):
        random = np.random.default_rng(seed)
        track = Track.of(
            draw_variants(2, 0.3, random),
            made.base,
            made.data,
            made.data.points,
            noise=NOISE,
            random=random,
        )
        waves.append(track.measured([], made.data))
    assert np.array_equal(waves[0], waves[1])
    assert np.abs(waves[0] - waves[2]).max() > 1e-5
    assert np.abs(waves[0].mean(axis=2)).max() < 3e-6  # the noise alone has a mean


def test_a_planted_effect_changes_only_what_its_law_changes() -> None:
    made, random = case(), np.random.default_rng(3)
    track = Track.of(
        draw_variants(2, 0.0, random),
        made.base,
        made.data,
        made.data.points,
        noise=0.0,
        random=random,
    )
    plain = track.measured([], made.data)
    assert np.array_equal(track.measured([CATALOGUE["temperature"].at(0.0)], made.data), plain)
    assert np.abs(track.measured([CATALOGUE["temperature"].at(0.1)], made.data) - plain).max() > 0
