"""Least squares, folds and a shrunk covariance, held against what two libraries gave.

The numbers are those of statsmodels 0.15 (`OLS`) and scikit-learn 1.9 (`GroupKFold`, `LedoitWolf`).
"""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.units import from_si
from tirelib.estimators.crossval import FACTOR, LEVELS, REPORT_UNIT
from tirelib.estimators.floor import with_floor
from tirelib.estimators.folds import held_out_folds
from tirelib.estimators.least_squares import least_squares
from tirelib.estimators.likeness_fit import shrunk_covariance
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.train import Trained
from tirelib.measured.observations import Observations

K = np.arange(24.0)
X = np.column_stack((np.sin(K), 120.0 + np.cos(1.7 * K), (K % 5) ** 2))
Y = 3.0 + 2.0 * X[:, 0] - 0.5 * X[:, 1] + 0.1 * np.sin(9.1 * K) + 0.02 * X[:, 2]
GROUPS = np.array([3, 3, 1, 7, 7, 7, 2, 2, 5, 9, 9, 9, 9, 4, 4, 8, 8, 8, 6, 6, 0, 0, 0, 0])
FOLDS = [0, 0, 3, 3, 3, 3, 1, 1, 2, 0, 0, 0, 0, 3, 3, 2, 2, 2, 2, 2, 1, 1, 1, 1]


def test_least_squares_and_its_statistics_are_the_library_s() -> None:
    fit = least_squares(np.column_stack((np.ones(24), X)), Y)
    assert fit.coefficients == pytest.approx(
        [3.45911001483, 1.99410562322, -0.503831220004, 0.0206161553177], rel=1e-8
    )
    assert fit.std_errors == pytest.approx(
        [2.65988659733, 0.022289916324, 0.0221754964488, 0.00275927188763], rel=1e-8
    )
    assert fit.p_values == pytest.approx(
        [0.208225605118, 1.6336452018e-27, 9.34265971797e-16, 3.29499595635e-07], rel=1e-6
    )
    assert fit.r2 == pytest.approx(0.997864223771, rel=1e-10)
    assert fit.fitted == pytest.approx(Y, abs=0.2)


def test_groups_share_folds_as_in_the_library() -> None:
    """Up to the order of groups of one size, which no one may rely on: sizes of folds are equal."""
    folds = list(held_out_folds(GROUPS, 4))
    assert sorted(int(rows.sum()) for rows in folds) == sorted(np.bincount(FOLDS).tolist())


@given(st.lists(st.integers(0, 12), min_size=1, max_size=60), st.integers(1, 8))
def test_every_row_is_held_out_once_with_its_whole_group(groups: list[int], most: int) -> None:
    every = np.array(groups)
    for folds in (list(held_out_folds(every)), list(held_out_folds(every, most))):
        assert (np.sum(folds, axis=0) == 1).all()
        assert all(not set(every[rows]) & set(every[~rows]) for rows in folds)
    assert len(folds) == min(most, len(set(groups)))
    assert len(list(held_out_folds(every))) == len(set(groups))


def test_the_shrunk_covariance_is_the_library_s() -> None:
    wanted = [[1.92200678338, 0.256993062271], [0.256993062271, 30.6493801573]]
    np.testing.assert_allclose(shrunk_covariance(X[:, [0, 2]] - [0.0, 6.0]), wanted, rtol=1e-10)


def test_many_errors_keep_their_covariance_and_few_are_drawn_together() -> None:
    many = np.random.default_rng(1).standard_normal((200_000, 2)) * [1.0, 3.0]
    sample = many.T @ many / len(many)
    np.testing.assert_allclose(shrunk_covariance(many), sample, rtol=1e-3, atol=1e-3)
    few = shrunk_covariance(np.array([[1.0, 0.0], [0.0, 2.0]]))
    np.testing.assert_allclose(few, 1.25 * np.eye(2))  # the sample's variances are 0.5 and 2


def test_the_floor_is_how_the_turns_of_a_run_scatter_about_its_mean(
    observed: Observations, trained: Trained
) -> None:
    chain, rows = trained.calibration.chains[-1], observed.usable
    regressors = compute_regressors(observed.features, chain.gages)
    floored = with_floor(chain, regressors, observed.unit, rows).load
    assert floored is not None
    loads = pd.Series(chain.predict(regressors)[0]["Fz"].value[rows])
    runs = loads.groupby(observed.unit[rows])
    pooled = (runs.var() * (runs.count() - 1)).sum() / (runs.count() - 1).sum()
    assert floored.floor == pytest.approx(np.sqrt(pooled))


def test_errors_at_held_out_levels_are_told_in_the_units_that_they_name() -> None:
    dimension = {"N": "force", "deg": "angle", "1": "ratio", "bar": "pressure", "km/h": "speed"}
    named = {*REPORT_UNIT.values(), *(unit for _, unit in LEVELS.values())}
    assert named == set(FACTOR)
    for unit, factor in FACTOR.items():
        assert factor == pytest.approx(from_si(1.0, unit, dimension[unit]))
