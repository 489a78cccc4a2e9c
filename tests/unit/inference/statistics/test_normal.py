"""Normal equations say what thousands of samples say."""

import numpy as np
import pytest
from scipy import stats

from tirelib.inference.statistics.normal import Normal, Weighed, taken


@pytest.fixture(scope="module")
def case() -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    random = np.random.default_rng(3)
    rows = {"base": random.standard_normal((4, 60)), "one": random.standard_normal((2, 60))}
    return random.standard_normal(60) + 0.7 * rows["one"][0], np.array([2.0, 0.3]), rows


def dense(rows: dict[str, np.ndarray], variance: dict[str, float]) -> np.ndarray:
    total = np.eye(60)
    for name, block in rows.items():
        total = total + variance.get(name, 0.0) * block.T @ block
    return total


@pytest.mark.parametrize("size", [1, 2])
def test_what_a_block_takes_is_its_density_beside_the_volume_of_its_prior(
    case: tuple, size: int
) -> None:
    rest, _, rows = case
    rows = {**rows, "one": rows["one"][:size]}
    normal = Normal.of(rows, rest, lambda block: block)
    before, more = {"base": 9.0, "one": 0.01}, 0.25
    weighed = Weighed(normal, normal.spread(before))
    block = normal.blocks["one"]
    found = taken(
        weighed.gram, weighed.right(normal.right)[:, None], [block], np.full(4 + size, more)
    )[0, 0]
    volume = np.linalg.slogdet(np.eye(size) + more * weighed.gram[block, block])[1]
    densities = [
        stats.multivariate_normal(cov=dense(rows, {**before, "one": one})).logpdf(rest)
        for one in (0.01 + more, 0.01)
    ]
    assert found - 0.5 * volume == pytest.approx(densities[0] - densities[1], abs=1e-8)


def test_likelihood_is_that_of_the_samples(case: tuple) -> None:
    rest, _, rows = case
    normal = Normal.of(rows, rest, lambda block: block)
    found = [
        Weighed(normal, normal.spread(spread)).log_likelihood()
        for spread in ({"base": 9.0, "one": 0.5}, {"base": 1.0})
    ]
    wanted = [
        stats.multivariate_normal(cov=dense(rows, spread)).logpdf(rest)
        for spread in ({"base": 9.0, "one": 0.5}, {"base": 1.0})
    ]
    assert found[0] - found[1] == pytest.approx(wanted[0] - wanted[1], abs=1e-8)


def test_what_has_coefficients_taken_off_is_the_residual_without_them(case: tuple) -> None:
    rest, _, rows = case
    found = (
        Normal.of(rows, rest).about({"one": 0.7, "absent": 3.0}).about({"base": -0.2, "one": 0.1})
    )
    mean = np.array([-0.2] * 4 + [0.8] * 2)
    wanted = Normal.of(rows, rest - mean @ np.concatenate(list(rows.values())))
    assert found.right == pytest.approx(wanted.right)
    assert found.square == pytest.approx(wanted.square)
    assert found.mean == pytest.approx(mean)


def test_draws_have_the_posterior(case: tuple) -> None:
    rest, _, rows = case
    normal = Normal.of(rows, rest, lambda block: block)
    weighed = Weighed(normal, normal.spread({"base": 9.0, "one": 0.5}))
    random = np.random.default_rng(0)
    draws = weighed.draws(random, 4000)
    assert draws.mean(axis=0) == pytest.approx(weighed.mean(normal.right), abs=0.02)
    assert np.cov(draws.T) == pytest.approx(weighed.covariance, abs=3e-3)
