"""Effects that are stronger than their range: named with a word up to twice of it, else unknown."""

from dataclasses import replace

import pytest

from tests.unit.diagnose.planted import EFFECT, STRENGTH, model_file, runs
from tirelib.compare.model import model_of
from tirelib.diagnose.diagnose import Diagnosis, diagnose
from tirelib.diagnose.document import assess
from tirelib.effects import CATALOGUE

MEMBERS = 12
OTHERS = [CATALOGUE[name] for name in ("gage_drift", "gage_saturation")]


def with_range(high: float, low: float = 0.0) -> Diagnosis:
    """Return what is said of a strong effect where its range is this."""
    narrow = replace(CATALOGUE[EFFECT], low=low, high=high)
    values = model_of(model_file()).values
    return diagnose(runs(EFFECT, STRENGTH), values, [narrow, *OTHERS], members=MEMBERS)


def test_what_explains_all_is_named_and_told_to_be_too_large() -> None:
    high = STRENGTH / 1.6
    found = with_range(high)
    assert found.named == (EFFECT,)
    best = found.findings[0]
    assert (best.level, best.in_range) == ("alarm", False)
    assert best.strength[0] == pytest.approx(STRENGTH, rel=0.05)
    (told,) = (text for text in assess(found, model_of(model_file())).messages if EFFECT in text)
    assert f"0 to {high:g} is plausible" in told


def test_what_is_named_for_its_share_is_told_to_be_so() -> None:
    found = diagnose(
        runs(EFFECT, STRENGTH),
        model_of(model_file()).values,
        [CATALOGUE[EFFECT], *OTHERS],
        members=MEMBERS,
    )
    assert found.named == (EFFECT,)
    assert found.by_share == (), "its score names it"
    given = model_of(model_file())
    shares = [
        [text for text in assess(one, given).messages if "share of the error" in text]
        for one in (found, replace(found, by_share=(EFFECT,)))
    ]
    assert shares[0] == []
    assert shares[1][0].startswith(f"{EFFECT} is named for its share")


def test_what_is_far_too_large_is_not_named() -> None:
    found = with_range(STRENGTH / 3.0)
    assert found.verdict == "unknown"
    assert found.named == ()


def test_the_wrong_sign_is_not_named_however_small() -> None:
    found = with_range(0.0, low=-STRENGTH)
    assert found.verdict == "unknown"
    assert found.named == ()
