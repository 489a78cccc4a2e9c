"""Sentences after an estimate: what lies beyond the calibration is said with its range."""

from dataclasses import replace

import pytest

from tirelib.campaign import Campaign
from tirelib.cli.limits import extrapolated
from tirelib.estimators.result import estimate_document
from tirelib.estimators.train import Trained
from tirelib.measured.observations import observe


@pytest.mark.parametrize(
    ("change", "said"),
    [({}, False), ({"speed": 0.25}, True), ({"pressure": 0.85}, True)],
)
def test_turns_at_an_uncalibrated_speed_or_pressure_are_said_with_what_was_calibrated(
    trained: Trained, another_day: Campaign, change: dict[str, float], said: bool
) -> None:
    day = observe([another_day])
    moved = {name: share * getattr(day.features, name) for name, share in change.items()}
    seen = replace(day, features=replace(day.features, **moved))
    found = trained.calibration.estimate(seen.features)
    turns = estimate_document(seen, found, trained.calibration)["turns"]
    sentence = extrapolated(turns, trained.calibration)
    assert bool(sentence) == said
    if said:
        low, high = trained.calibration.chains[-1].laws.speed
        assert f"speeds from {3.6 * low:.3g} to {3.6 * high:.3g} km/h" in sentence
        assert f"of {len(turns)} turns" in sentence
