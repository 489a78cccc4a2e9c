"""Device files: counts mean strain, saturation is never a number, faults have their message."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirebench.errors import BenchError, DeviceError
from tirebench.wire.device import Device, parse_device, read_device
from tirebench.wire.frames import GAGES

GOOD = """
format = "tirebench-device/1"
name = "wheel 3"
[gages]
lateral_m = [0.06, 0.03, 0.0, -0.03, -0.06]
zero_counts = [10, -20, 0, 5, 1]
[bridge]
gage_factor = 2.0
excitation_V = 5.0
volt_per_count = 1e-6
"""


def test_the_bridge_follows_equation_20() -> None:
    device = parse_device(GOOD, "w.toml")
    strain = 1e-3
    out = 0.25 * 2.0 * strain * 5.0  # e0 = Ks strain E / 4
    counts = np.full((1, 1, GAGES), round(out / 1e-6), np.int16)
    expected = strain - np.array(device.zero) * device.scale
    np.testing.assert_allclose(device.strain(counts, np.zeros(1, np.int64))[0][0], expected)


@given(seed=st.integers(0, 1000), zero=st.integers(-3000, 3000))
def test_counts_are_the_inverse_of_strain(seed: int, zero: int) -> None:
    device = Device(zero=(float(zero),) * GAGES)
    sent = np.random.default_rng(seed).integers(-32767, 32767, (16, GAGES)).astype(np.int16)
    strain, saturated = device.strain(sent[None], np.zeros(1, np.int64))
    assert not saturated.any()
    np.testing.assert_array_equal(device.counts(strain)[0], sent)


def test_a_saturated_sample_is_nan_and_said() -> None:
    counts = np.zeros((2, 16, GAGES), np.int16)
    counts[0, 3, 1], counts[1, 4, 2] = 32767, -32768
    strain, saturated = Device().strain(counts, np.array([0b00010, 0b01000]))
    assert np.isnan(strain[3, 1])
    assert np.isnan(strain[20, 2])
    assert np.isnan(strain[16:, 3]).all()  # flagged, but no sample is marked: all are suspect
    assert saturated.sum() == 18
    np.testing.assert_array_equal(np.isnan(strain), saturated)


def test_what_cannot_be_sent_is_marked() -> None:
    counts, marked = Device().counts(np.array([[0.0, 0.03, -0.03, np.nan, 0.0199]]))
    assert counts[0].tolist()[1:4] == [32767, -32768, -32768]
    assert marked[0].tolist() == [False, True, True, True, False]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "device/1",
            "device/2",
            r"format = 'tirebench-device/2'; this program reads 'tirebench-device/1'",
        ),
        ("gage_factor = 2.0", "", r"bridge.gage_factor is missing; a number is needed"),
        (
            "gage_factor = 2.0",
            "gage_factor = 2e6",
            r"gage_factor = 2e\+06; a magnitude of 0.1 .. 300 is allowed",
        ),
        (
            "gage_factor = 2.0",
            "gage_factor = nan",
            r"gage_factor = nan; a magnitude of 0.1 .. 300 is allowed",
        ),
        ("-0.06]", "-60]", r"lateral_m of gage 5 = -60; -0.5 .. 0.5 is allowed; check its unit"),
        (
            "-0.03, -0.06]",
            "-0.06]",
            r"zero_counts has 5 numbers, but lateral_m has 4; one number per gage",
        ),
        ("[gages]", "[gage]", r"gage is an unknown key; allowed keys are bridge, format"),
        ("[bridge]", "[scale]\nstrain_per_count = 1e-6\n[bridge]", r"\[scale\] and \[bridge\] is"),
        ("[bridge]", "[bridge", r"not valid TOML"),
    ],
)
def test_a_wrong_device_file_says_what_is_wrong(old: str, new: str, message: str) -> None:
    with pytest.raises(DeviceError, match=message):
        parse_device(GOOD.replace(old, new), "w.toml")


def test_all_faults_of_a_device_file_are_told_at_once() -> None:
    text = GOOD.replace("2.0", "'x'").replace("5.0", "1e9").replace("name =", "nmae =")
    with pytest.raises(DeviceError) as caught:
        parse_device(text, "w.toml")
    assert len(caught.value.problems) == 3
    assert all(p.startswith("w.toml: ") and p.count(";") >= 2 for p in caught.value.problems)


def test_a_file_that_is_not_there_is_a_bench_error(tmp_path: Path) -> None:
    with pytest.raises(BenchError, match=r"nowhere.toml: cannot be read"):
        read_device(tmp_path / "nowhere.toml")


def test_another_layout_is_refused() -> None:
    device = parse_device(GOOD, "w.toml")
    device.check_layout((0.06, 0.03, 0.0, -0.03, -0.06), "here")
    with pytest.raises(DeviceError, match=r"here: its gages are at -60, -30, \+0, \+30, \+60 mm"):
        device.check_layout((-0.06, -0.03, 0.0, 0.03, 0.06), "here")
