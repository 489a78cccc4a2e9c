"""Limits of scores: the largest that variants without any effect are expected to have."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tirelib.diagnose.ranking import limits

MEMBERS, COMPONENTS = 100, (1, 2)


def members(scores: np.ndarray) -> Any:
    return [SimpleNamespace(score=row) for row in scores]


def drawn(seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.stack([random.chisquare(c, MEMBERS) for c in COMPONENTS], axis=1)


@pytest.fixture(scope="module")
def told() -> tuple[np.ndarray, np.ndarray]:
    """Return limits and largest scores of many ensembles."""
    draws = [drawn(seed) for seed in range(400)]
    limit = np.array([limits(members(x), COMPONENTS) for x in draws])
    return limit, np.array([x.max(axis=0) for x in draws])


def test_the_limit_is_the_usual_largest(told: tuple[np.ndarray, np.ndarray]) -> None:
    limit, largest = told
    usual = stats.chi2.isf(1.0 - 0.5 ** (1.0 / MEMBERS), COMPONENTS)
    assert np.median(largest, axis=0) == pytest.approx(usual, rel=0.05)
    assert np.median(limit, axis=0) == pytest.approx(usual, rel=0.05)


def test_it_depends_on_the_draws_half_as_much(told: tuple[np.ndarray, np.ndarray]) -> None:
    limit, largest = told
    assert (limit.std(axis=0) < 0.65 * largest.std(axis=0)).all()


def test_heavier_tails_exceed_it_by_little() -> None:
    random = np.random.default_rng(9)
    draws = random.standard_t(10, (400, MEMBERS, 1)) ** 2
    limit = np.array([limits(members(x), (1,)) for x in draws])
    assert 0.8 < np.median(limit) / np.median(draws.max(axis=1)) < 1.0


def test_it_goes_with_the_scores_and_not_with_their_order() -> None:
    scores = drawn(1)
    limit = limits(members(scores), COMPONENTS)
    assert limits(members(3.0 * scores), COMPONENTS) == pytest.approx(3.0 * limit)
    assert limits(members(scores[::-1]), COMPONENTS) == pytest.approx(limit)


def test_rare_large_scores_raise_it() -> None:
    scores = drawn(2)
    often = scores.copy()
    often[:5] = 40.0
    assert (limits(members(often), COMPONENTS) > 1.5 * limits(members(scores), COMPONENTS)).all()


def test_of_few_members_it_is_the_largest() -> None:
    scores = drawn(3)[:8]
    assert limits(members(scores), COMPONENTS) == pytest.approx(scores.max(axis=0))
