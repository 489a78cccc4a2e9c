"""The ridge regression of many parts is the library's, part by part."""

import warnings
from typing import Any

import numpy as np
import pytest

from tirelib.estimators.ridge import LEAST_CHANGE, MOST_STEPS, ridge_fit, ridge_fits

N, K = 40, 12


def data(seed: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x = np.column_stack((np.ones(N), rng.standard_normal((N, K - 1)) * 10.0 ** np.arange(1 - K, 0)))
    y = 3e3 + x @ (300.0 / np.abs(x).max(axis=0)) + 20.0 * rng.standard_normal(N)
    return x, y, rng.uniform(0.2, 2.0, N)


def library(x: np.ndarray, y: np.ndarray, weights: np.ndarray, centre: bool) -> Any:
    """Fit with scikit-learn what is standardised by hand."""
    # slow to import: not where a process only collects these tests
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.linear_model import BayesianRidge

    middle = np.average(y, weights=weights) if centre else 0.0
    spread = np.sqrt(np.average((y - middle) ** 2, weights=weights))
    ridge = BayesianRidge(fit_intercept=False, max_iter=MOST_STEPS, tol=LEAST_CHANGE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        ridge.fit(
            x / np.sqrt(np.mean(x**2, axis=0)),
            (y - middle) / spread,
            sample_weight=weights / weights.mean(),
        )
    ridge.middle_, ridge.spread_ = middle, spread
    return ridge


@pytest.mark.parametrize("centre", [True, False])
def test_each_part_is_fitted_as_the_library_fits_it(centre: bool) -> None:
    """Parts of many sizes, one with fewer rows than terms; to rounding of the singular values."""
    x, y, weights = data()
    kept = [np.arange(N) != 7, np.arange(N) >= 15, np.arange(N) < K - 3, np.ones(N, dtype=bool)]
    for rows, fit in zip(kept, ridge_fits(x, y, weights, centre, kept), strict=True):
        wanted = library(x[rows], y[rows], weights[rows], centre)
        coefficients = wanted.coef_ * wanted.spread_ / fit.size
        coefficients[0] += wanted.middle_
        np.testing.assert_allclose(
            fit.coefficients * fit.size,
            coefficients * fit.size,
            rtol=1e-8,
            atol=1e-8 * wanted.spread_,
        )
        covariance = wanted.sigma_ * wanted.spread_**2 / np.outer(fit.size, fit.size)
        np.testing.assert_allclose(
            fit.covariance, covariance, rtol=1e-7, atol=1e-9 * np.abs(covariance).max()
        )
        assert fit.noise == pytest.approx(wanted.spread_ / np.sqrt(wanted.alpha_), rel=1e-8)
        assert fit.penalty == pytest.approx(wanted.lambda_ / wanted.alpha_, rel=1e-7)


def test_a_part_does_not_depend_on_the_others() -> None:
    """They end their iteration at different steps; one that has ended stays."""
    x, y, weights = data()
    kept = [np.arange(N) < 20, np.arange(N) >= 25]
    for rows, fit in zip(kept, ridge_fits(x, y, weights, True, kept), strict=True):
        alone = ridge_fit(x[rows], y[rows], weights[rows], True)
        np.testing.assert_array_equal(fit.coefficients, alone.coefficients)
        assert fit.noise == alone.noise
    assert ridge_fits(x, y, weights, True, []) == []


def test_rows_without_weight_say_nothing_of_the_coefficients() -> None:
    x, y, _ = data()
    few = (np.arange(N) < 30).astype(float)
    wrong = np.where(few > 0.0, y, 1e6)
    np.testing.assert_array_equal(
        ridge_fit(x, y, few, True).coefficients, ridge_fit(x, wrong, few, True).coefficients
    )


def test_a_target_that_stands_still_and_a_term_that_is_zero_are_no_fault() -> None:
    x = np.column_stack((np.ones(N), np.zeros(N)))
    fit = ridge_fit(x, np.full(N, 5.0), np.ones(N), True)
    np.testing.assert_allclose(fit.coefficients, [5.0, 0.0], atol=1e-12)
    assert np.isfinite(fit.covariance).all()
