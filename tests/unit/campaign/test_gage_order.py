"""Which swaps of gages are believed, and what a contact of few samples is not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.synthetic import header, synthetic_run
from tirelib.campaign.check_gages import gage_findings
from tirelib.campaign.check_order import _lateral_order, _swapped

ONE = np.ones((3, 1))


@pytest.mark.parametrize(("share", "believed"), [(0.2, True), (0.3, False)])
def test_an_exchange_is_believed_where_it_leaves_a_quarter_of_the_squared_residual(
    share: float, believed: bool
) -> None:
    """Two gages fit each other's place better; the other three are off in any order."""
    whole, others = 450.0, 60.0
    apart, near = (np.sqrt((left - others) / 6.0) for left in (whole, share * whole))
    measured, model = np.zeros((3, 5)), np.zeros((3, 5))
    measured[:, 2:] = np.sqrt(others / 9.0)
    measured[:, :2] = 0.5 * (apart + near) * np.array([1.0, -1.0])
    model[:, :2] = -0.5 * (apart - near) * np.array([1.0, -1.0])
    found = _swapped("a.mf4", measured, model, ONE)
    assert (found is not None) == believed


@pytest.mark.parametrize(
    ("highest", "lowest", "told"),
    [("sound", "swapped", False), ("swapped", "sound", False), ("swapped", "swapped", True)],
)
def test_positions_are_contradicted_only_by_the_highest_and_the_lowest_strain_together(
    highest: str, lowest: str, told: bool
) -> None:
    slopes = {
        "sound": np.array([5.0, 4.0, 3.0, 2.0, 1.0]),
        "swapped": np.array([5.0, 2.0, 3.0, 4.0, 1.0]),
    }
    force = np.linspace(-1.0, 1.0, 9)
    regressors = np.stack([np.ones(9), force], axis=1)
    coefficients = np.zeros((2, 3, 5))
    coefficients[1, 0], coefficients[1, 2] = slopes[highest], slopes[lowest]
    assert bool(_lateral_order(regressors, coefficients, 1e-3 * ONE, header())) == told


@pytest.mark.parametrize("every", [2, 5, 7])
def test_a_contact_of_few_samples_is_no_spike(every: int) -> None:
    run = synthetic_run(0, load=700.0)
    assert run.strain is not None
    slow = replace(run, strain=run.strain[:, ::every], rate=run.rate / every, trigger=None)
    assert gage_findings(slow, header(), whole=True) == []
