"""Bus load bit by bit: known frames, known bounds, and the table of measured loads."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from tirebench.cli import program
from tirebench.errors import DeviceError
from tirebench.protocols.bus_load import (
    Load,
    LoadPlan,
    frame_bits,
    highest_rate,
    load_of,
    suggestions,
    worst_bits,
)
from tirebench.protocols.layouts import RAW12, RAW12C, RAW16
from tirebench.wire.can_batch import same_kind

M = 1_000_000
TABLE = [
    (RAW12C, M // 2, None, (117, 233, 467, 933), None),
    (RAW12C, M, None, (58, 117, 233, 467), (68, None, None, None)),
    (RAW16, M // 2, 2 * M, (30, 59, 119, 237), (None, 68, None, None)),
    (RAW12, M // 2, 2 * M, (22, 45, 89, 178), None),
    (RAW16, M // 2, 5 * M, (15, 30, 60, 120), None),
    (RAW12, M // 2, 5 * M, (11, 22, 45, 90), None),
    (RAW16, M, 5 * M, (12, 25, 50, 99), (None, None, None, 113)),
    (RAW12, M, 5 * M, (9, 19, 37, 74), (None, None, None, 85)),
    (RAW16, M, 8 * M, (9, 17, 35, 70), (None, None, None, 79)),
    (RAW12, M, 8 * M, (7, 13, 26, 52), (None, None, None, 59)),
]
"""Format, bit rates, percent at 1 and 4 wheels of 5 and 10 kHz: mean, and where known worst."""


@pytest.mark.parametrize(("kind", "slow", "fast", "mean", "worst"), TABLE)
def test_loads_are_those_that_were_measured(
    kind: str, slow: int, fast: int | None, mean: tuple[int, ...], worst: tuple[int | None] | None
) -> None:
    """The worst case to the percent; the mean to 3 % (other waves) beside the rounding."""
    for place, (wheels, rate) in enumerate(((1, 5e3), (1, 1e4), (4, 5e3), (4, 1e4))):
        found = load_of(LoadPlan(kind, slow, fast, wheels, rate))
        assert abs(100 * found.mean - mean[place]) <= 0.5 + 0.03 * mean[place]
        if worst is not None and worst[place] is not None:
            assert round(100 * found.worst) == worst[place]


def test_serial_lines_are_those_that_were_computed() -> None:
    for wheels, rate, baud in ((1, 5e3, 0.56), (1, 1e4, 1.13), (4, 5e3, 2.3), (4, 1e4, 4.5)):
        found = load_of(LoadPlan("serial", 2 * M, None, wheels, rate))
        assert found.mean * 2 == pytest.approx(baud, rel=0.025)


def bits_by_hand(identifier: int, data: bytes) -> int:
    """A classic frame in text, stuffed by replacing runs: another way to the same number."""
    body = f"0{identifier:011b}000{len(data):04b}" + "".join(f"{b:08b}" for b in data)
    crc = 0
    for bit in body:
        crc = ((crc << 1) ^ 0x4599 if (crc >> 14 & 1) != int(bit) else crc << 1) & 0x7FFF
    text, out = body + f"{crc:015b}", ""
    for bit in text:
        out += bit
        if out[-5:] in ("00000", "11111"):
            out += "1" if bit == "0" else "0"
    return len(out) + 13


@given(st.integers(0, 2047), st.binary(max_size=8))
def test_a_classic_frame_has_the_bits_that_a_pencil_finds(identifier: int, data: bytes) -> None:
    batch = same_kind(identifier, np.frombuffer(data, np.uint8)[None, :], fd=False)
    slow, fast = frame_bits(batch)
    assert (slow[0], fast[0]) == (bits_by_hand(identifier, data), 0)
    assert 47 + 8 * len(data) <= slow[0] <= worst_bits(len(data), False)[0]


@given(st.integers(0, 2047), st.binary(min_size=64, max_size=64))
def test_an_fd_frame_lies_within_its_bounds(identifier: int, data: bytes) -> None:
    slow, fast = frame_bits(same_kind(identifier, np.frombuffer(data, np.uint8)[None, :], fd=True))
    most = worst_bits(64, True)
    assert 30 <= slow[0] <= most[0]
    assert 549 <= fast[0] <= most[1]


def test_the_worst_case_can_be_reached() -> None:
    """Data 1111 0000 .. after a header that ends in zeros stuff after every fourth bit."""
    pattern = np.unpackbits(np.array([[0x0F] * 64], np.uint8)).reshape(1, -1)
    best = 0.0
    for shift in range(8):
        data = np.packbits(np.roll(pattern, shift, axis=1), axis=1)
        best = max(best, float(frame_bits(same_kind(0x7C0, data, fd=True))[1][0]))
    assert best >= 0.99 * worst_bits(64, True)[1]


def test_the_highest_rate_fits_and_a_little_more_does_not() -> None:
    for plan in (LoadPlan(RAW16, M // 2, 2 * M, 4, 1e4), LoadPlan(RAW12C, M, None, 1, 1e4)):
        rate = highest_rate(plan)
        assert load_of(LoadPlan(plan.kind, plan.bitrate, plan.data_bitrate, plan.wheels, rate)).fits
        more = LoadPlan(plan.kind, plan.bitrate, plan.data_bitrate, plan.wheels, rate + 200.0)
        assert not load_of(more).fits
        assert suggestions(plan)[0] == f"{rate / 1e3:g} kHz sample rate on the same line"


@pytest.mark.parametrize(
    ("mean", "worst", "service", "fits"),
    [
        (0.78, 0.9, 0.015, True),
        (0.78, 0.9, 0.025, False),
        (0.7, 0.98, 0.015, True),
        (0.7, 0.98, 0.025, False),
    ],
)
def test_a_line_carries_its_service_frames_as_well(
    mean: float, worst: float, service: float, fits: bool
) -> None:
    """Four fifths of the capacity on average, and all of it at worst."""
    load = Load(mean, worst, service, 1e3, (0.0, 0.0), (0.0, 0.0), 0.0)
    assert load.fits == fits


def test_the_program_refuses_what_does_not_fit(tmp_path: Path) -> None:
    words = ["load", "--bus", "classic", "--wheels", "4", "--json", str(tmp_path / "l.json")]
    outcome = CliRunner().invoke(program, words)
    assert outcome.exit_code == 1
    assert "does not fit" in outcome.output
    assert "CAN FD 1000 kbit/s / 8 Mbit/s, RAW12, 4 x 10 kHz" in outcome.output
    found = json.loads((tmp_path / "l.json").read_text())
    assert (found["format"], found["fits"]) == ("tirebench-load/1", False)
    assert CliRunner().invoke(program, ["load", "--bus", "serial"]).exit_code == 0


def test_a_format_of_the_other_kind_of_bus_is_refused() -> None:
    with pytest.raises(
        DeviceError, match=r"RAW16: the bus cannot carry this format; it needs CAN FD"
    ):
        load_of(LoadPlan(RAW16, M, None, 1, 1e4))
