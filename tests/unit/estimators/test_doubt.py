"""What an uncertain wheel angle and an uncertain offset leave uncertain."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tirelib.estimators.doubt import ANGLE_STEP, doubt


@given(
    load=st.floats(500.0, 8e3),
    std=st.floats(0.0, 0.1),
    power=st.floats(-2.0, 2.0),
    higher=st.floats(-500.0, 500.0),
)
def test_doubt_is_the_slope_over_the_angle_times_its_std_beside_what_the_offset_moves(
    load: float, std: float, power: float, higher: float
) -> None:
    value = np.array([load, load * (1.0 + power * ANGLE_STEP), load + higher])
    found = doubt(value, np.array([std]))
    np.testing.assert_allclose(found, np.hypot(power * load * std, higher), atol=1e-6, rtol=1e-9)
