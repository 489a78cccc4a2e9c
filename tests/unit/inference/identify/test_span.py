"""The space that columns span holds what they know, and not what rounding adds."""

import numpy as np
import pytest

from tirelib.inference.identify.span import span

RANDOM = np.random.default_rng(8)
COLUMNS = RANDOM.standard_normal((30, 4)) * np.array([1.0, 1e-6, 1e3, 1e-9])


def test_it_is_the_space_of_the_columns_whatever_their_units() -> None:
    basis = span(COLUMNS)
    assert basis.T @ basis == pytest.approx(np.eye(4), abs=1e-12)
    size = np.linalg.norm(COLUMNS, axis=0)
    assert basis @ (basis.T @ COLUMNS / size) == pytest.approx(COLUMNS / size)


@pytest.mark.parametrize("error", [0.0, 1e-14, 1e-7])
def test_what_depends_on_others_but_for_errors_of_differences_adds_no_direction(
    error: float,
) -> None:
    size = float(np.linalg.norm(COLUMNS[:, 0]))
    same = 3.0 * COLUMNS[:, :1] + error * size * RANDOM.standard_normal((30, 1))
    more = np.concatenate([COLUMNS, same, np.zeros((30, 1))], axis=1)
    basis = span(more)
    assert basis.shape == (30, 4)
    assert basis @ basis.T == pytest.approx(span(COLUMNS) @ span(COLUMNS).T, abs=1e-6)


def test_nothing_spans_nothing() -> None:
    assert span(np.zeros((5, 2))).shape == (5, 0)


def test_what_is_no_number_is_not_dropped() -> None:
    with pytest.raises(ValueError, match="infs or NaNs"):
        span(np.array([[1.0, np.nan], [2.0, 1.0]]))
