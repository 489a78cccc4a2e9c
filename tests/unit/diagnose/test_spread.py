"""Rows of one run each without their zeros: the same sums as with them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.arrays import FloatArray
from tirelib.diagnose.spread import Spread
from tirelib.planning.structure import run_by_run

SIZES = st.tuples(st.integers(0, 4), st.integers(1, 5), st.integers(0, 3), st.integers(1, 4))


def made(sizes: tuple[int, int, int, int]) -> tuple[Spread, FloatArray]:
    """Return rows and the same with all their zeros."""
    every, runs, k, samples = sizes
    random = np.random.default_rng(sum(sizes))
    spread = Spread(
        random.standard_normal((every, runs * samples)), random.standard_normal((runs, k, samples))
    )
    return spread, np.concatenate([spread.every, run_by_run(spread.each)])


@given(SIZES, st.integers(0, 3))
def test_products_and_sums_are_those_of_the_whole_rows(
    sizes: tuple[int, int, int, int], m: int
) -> None:
    spread, whole = made(sizes)
    random = np.random.default_rng(m)
    rows = random.standard_normal((m, whole.shape[1]))
    assert len(spread) == len(whole)
    assert spread.onto(rows) == pytest.approx(whole @ rows.T)
    assert spread.products() == pytest.approx(whole @ whole.T)
    weights = random.standard_normal((len(whole), m))
    assert spread.mixed(weights) == pytest.approx(weights.T @ whole)


def test_what_is_off_in_a_run_is_off_in_no_other() -> None:
    changes = np.arange(12.0).reshape(2, 2, 3) + 1.0
    rows = run_by_run(changes).reshape(2, 2, 2, 3)
    for run in range(2):
        assert np.array_equal(rows[run, :, run], changes[run])
        assert not rows[run, :, 1 - run].any()
