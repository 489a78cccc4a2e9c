"""Laws of the state: whoever restores it goes on exactly alike."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fmu import live
from tests.synthetic import record
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag
from tirelib.measured.signal import TurnCutter
from tirelib.stream import StreamEstimator
from tirelib.stream.snapshot import from_plain, restore_cutter, snapshot_cutter, to_plain

HELD = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}


def stream() -> StreamEstimator:
    return StreamEstimator(live.calibration(), live.RATE)


def faulty_strain() -> np.ndarray:
    strain, _ = live.strain_of(4.2e3, 0.06, turns=6.4)
    strain[1, 900:1500] = np.nan
    strain[:, 2100:2110] = np.nan
    return strain


def track(estimator: StreamEstimator, strain: np.ndarray) -> str:
    """All that can be seen of an estimator over the samples, to the last digit."""
    seen = []
    for first in range(0, strain.shape[1], 7):
        turns = estimator.push(strain[:, first : first + 7], **HELD)
        seen.append((to_plain(turns), estimator.flags, estimator.valid, repr(estimator.age)))
    return json.dumps(seen)


@settings(max_examples=12)
@given(at=st.integers(0, 3300))
def test_restored_through_json_it_goes_on_exactly_alike(at: int) -> None:
    strain = faulty_strain()
    one, other = stream(), stream()
    one.push(strain[:, :at], **HELD)
    other.push(strain[:, ::-1][:, :500].copy(), **HELD)  # whatever it was, it is forgotten
    text = json.dumps(one.state(), allow_nan=False)
    other.restore(json.loads(text))
    assert other.time == one.time
    assert track(other, strain[:, at:]) == track(one, strain[:, at:])


def test_it_goes_on_alike_from_every_sample_round_the_edges_of_a_contact() -> None:
    strain, _ = live.strain_of(4.2e3, 0.06, turns=3.4)
    last = stream().push(strain, **HELD)[-1]
    half = last.features.trail[0, 2] / last.features.omega[0]
    wanted = track(stream(), strain)
    for edge in (last.time - half, last.time + half):
        for at in range(int(edge * live.RATE) - 8, int(edge * live.RATE) + 8):
            one, other = stream(), stream()
            one.push(strain[:, :at], **HELD)
            other.restore(json.loads(json.dumps(one.state())))
            turns = other.push(strain[:, at:], **HELD)
            assert json.dumps(to_plain(turns[-1])) in wanted


@pytest.mark.parametrize("gap", [6, 7])
def test_a_gap_before_the_first_contact_is_remembered_within_it(gap: int) -> None:
    """At 200 Hz the contact begins with sample 8; what lies before tells that it is damaged."""
    strain = record(turns=4.6, speed=live.SPEED, rate=200.0)[0]
    strain[2, gap] = np.nan
    one, other = (TurnCutter(live.calibration().lateral, 200.0) for _ in range(2))
    one.push(strain[:, :12], speed=live.SPEED)
    restore_cutter(other, snapshot_cutter(one))
    wanted, got = (cutter.push(strain[:, 12:], speed=live.SPEED) for cutter in (one, other))
    assert wanted[1].flags & TurnFlag.GAP
    assert [turn.flags for turn in got] == [turn.flags for turn in wanted]


def test_restoring_twice_rolls_back() -> None:
    strain = faulty_strain()
    estimator = stream()
    estimator.push(strain[:, :1700], **HELD)
    state = estimator.state()
    first = track(estimator, strain[:, 1700:])
    estimator.restore(state)
    assert track(estimator, strain[:, 1700:]) == first


def test_the_state_holds_the_current_turn_not_the_whole_past() -> None:
    strain, _ = live.strain_of(4e3, 0.0, turns=30.0)
    estimator = stream()
    sizes = []
    for first in range(0, strain.shape[1], 400):
        estimator.push(strain[:, first : first + 400], **HELD)
        sizes.append(len(json.dumps(estimator.state())))
    # a turn and a half of nine rows of float64 in base64, and the latest estimate
    assert max(sizes[4:]) < 1.5 * 533 * 9 * 8 * 4 / 3 + 20_000


def test_another_version_rate_or_layout_is_refused() -> None:
    state = stream().state()
    with pytest.raises(FormatError, match="this version reads"):
        stream().restore({**state, "format": "tirelib-stream-state/9"})
    with pytest.raises(FormatError, match="restore it where it was saved"):
        StreamEstimator(live.calibration(), 2 * live.RATE).restore(state)


def test_every_number_survives_to_the_last_bit() -> None:
    values = [0.1, -0.0, np.nan, np.inf, 5e-324, np.float64(1 / 3), np.int64(-7), True, None, "x"]
    again = from_plain(json.loads(json.dumps(to_plain(values), allow_nan=False)))
    np.testing.assert_array_equal(np.array(again[:6]), np.array(values[:6]))
    assert again[6:] == [-7, True, None, "x"]
    assert np.signbit(again[1])
    array = np.array([[1, 2], [3, 4]], dtype=np.int32)
    twin = from_plain(to_plain(array))
    assert twin.dtype == array.dtype
    np.testing.assert_array_equal(twin, array)


def test_an_unknown_type_is_an_error() -> None:
    with pytest.raises(FormatError, match="cannot be saved"):
        to_plain({1, 2})
