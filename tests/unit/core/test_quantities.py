"""Quantities as people say them: every unit is one of its dimension, and the way back is exact."""

import numpy as np
import pytest

from tirelib.core.quantities import QUANTITIES, Quantity
from tirelib.core.units import TABLE


@pytest.mark.parametrize("quantity", QUANTITIES.values(), ids=list(QUANTITIES))
def test_a_quantity_is_said_in_a_unit_of_its_dimension_and_comes_back(quantity: Quantity) -> None:
    assert (quantity.unit, quantity.dimension) in {(row.unit, row.dimension) for row in TABLE}
    values = np.array([-0.7, 0.0, 310.0])
    np.testing.assert_allclose(quantity.measured(quantity.told(values)), values, atol=1e-12)


def test_engineers_units() -> None:
    said = {
        "load": (4000.0, 4000.0),
        "pressure": (2.1e5, 2.1),
        "speed": (25.0, 90.0),
        "slip_angle": (np.pi / 60.0, 3.0),
        "slip_ratio": (-0.04, -0.04),
        "temperature": (333.15, 60.0),
    }
    for name, (inside, outside) in said.items():
        assert QUANTITIES[name].told(inside) == pytest.approx(outside), name


def test_the_sign_of_what_is_symmetric_to_the_axes_is_nobodys() -> None:
    """Only quantities along or about an axis change with the axis system, or with the direction."""
    unsigned = {name for name, quantity in QUANTITIES.items() if not quantity.signed}
    assert unsigned == {"load", "pressure", "speed", "temperature"}
