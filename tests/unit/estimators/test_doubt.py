"""What an uncertain wheel angle and an uncertain offset leave uncertain."""

from dataclasses import fields, replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.synthetic import LATERAL, RATE, record
from tirelib.estimators.doubt import ANGLE_STEP, doubt, with_moved
from tirelib.measured.features import Features
from tirelib.measured.features.extract import reference_features
from tirelib.measured.signal import cut_turns


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


def test_moved_features_are_those_of_a_trace_over_longer_angles_and_under_a_higher_offset() -> None:
    strain, trigger, _ = record(tilt=0.1, imbalance=4e-4)
    turns = cut_turns(strain, RATE, LATERAL, trigger=trigger)
    offset = 1e-6 * np.arange(1.0, 6.0) + np.zeros((len(turns), 1))
    turns, trace = replace(turns, offset_std=offset), turns.trace
    scale = 1.0 + ANGLE_STEP
    longer = replace(trace, phi=scale * trace.phi, rate=trace.rate / scale)
    higher = replace(trace, strain=trace.strain - offset[:, :, None])
    read = [reference_features(replace(turns, trace=each)) for each in (trace, longer, higher)]
    moved = with_moved(read[0])
    n = len(turns)
    for k, found in enumerate(read):
        for field in fields(Features):
            # the signal tells a mean and an offset; a skew is over the area, which is hardly moved
            if field.name in ("lateral", "offset", "mean") or (k == 2 and field.name == "skew"):
                continue
            one = getattr(moved, field.name)[k * n : (k + 1) * n][1:]
            other = getattr(found, field.name)[1:]
            np.testing.assert_allclose(one, other, rtol=2e-6, atol=1e-9, err_msg=field.name)
    for sign, name in ((-1.0, "mean"), (1.0, "offset")):
        step = getattr(moved, name)[2 * n :] - getattr(moved, name)[:n]
        np.testing.assert_allclose(step[1:], sign * offset[1:], rtol=1e-6, err_msg=name)
