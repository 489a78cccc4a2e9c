"""Zero and shunt: what is written makes the standing strain nothing, and the step known."""

import threading
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

from tests.bench.campaigns import tiny_runs
from tests.bench.in_process import FakeSource
from tirebench.cli import program
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.errors import DeviceError
from tirebench.estimator.standing import Level
from tirebench.links import Read
from tirebench.links.pseudo import PseudoTerminal
from tirebench.page.commands import Command, CommandDesk, parse_command
from tirebench.page.gages import GageSetup
from tirebench.recording.header import RecordingHeader
from tirebench.recording.recorder import Recorder
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device, parse_device, read_device
from tirebench.wire.frames import encode, strain_frames
from tirebench.wire.gage_setup import apparent_strain, device_text, shunted, zeroed
from tirelib.core.arrays import FloatArray

OFFSET = np.array([120.0, -340.0, 5.0, 0.0, 1800.0])
WHEEL = Device("wheel 3", scale=1e-6, lateral=(0.06, 0.03, 0.0, -0.03, -0.06))
SHUNT = ("--gage-resistance", 350, "--shunt", 100_000, "--gage-factor", 2.1)


def standing(level: FloatArray = OFFSET, seed: int = 1) -> list[bytes]:
    """Return the frames of four seconds of a wheel that stands, with some counts of noise."""
    noise = np.random.default_rng(seed).normal(0.0, 3.0, (40_000, 5))
    return encode(strain_frames(np.rint(level + noise).astype(np.int16), period=1000))


def recorded(path: Path, wire: list[bytes]) -> Path:
    header = RecordingHeader({"port": "p"}, device_text(WHEEL))
    with Recorder(path, header, Conditions.constant()) as recorder:
        for first in range(0, len(wire), 50):
            recorder.read(Read(10**9 + first, b"".join(wire[first : first + 50])))
    return path


def call(*words: object) -> Result:
    return CliRunner().invoke(program, [str(word) for word in words])


def strain_of(device: Device, counts: FloatArray) -> FloatArray:
    return device.strain(np.asarray(counts)[None, None, :], np.zeros(1, np.int64))[0][0]


@given(
    zero=st.lists(st.floats(-9000.0, 9000.0), min_size=5, max_size=5),
    gain=st.lists(st.floats(0.5, 2.0), min_size=5, max_size=5),
    counts=st.lists(st.floats(-9000.0, 9000.0), min_size=5, max_size=5),
)
def test_the_zero_makes_the_standing_strain_nothing_whatever_the_device_was(
    zero: list[float], gain: list[float], counts: list[float]
) -> None:
    device = Device("x", 1e-6, tuple(zero), gain=tuple(gain))
    new = zeroed(device, strain_of(device, np.array(counts)))
    np.testing.assert_allclose(strain_of(new, np.array(counts)), 0.0, atol=2e-9)
    again = parse_device(device_text(new, "a note"), "again")
    assert (again.zero, again.gain, again.scale) == (new.zero, new.gain, new.scale)


def test_counts_and_strain_are_inverse_with_gains_too() -> None:
    device = Device("x", 1e-6, (5.0,) * 5, gain=(1.0, 0.9, 1.1, 2.0, 0.5))
    strain = 1e-6 * np.array([[100.0, -90.0, 220.0, 2000.0, 50.0]])
    counts, marked = device.counts(strain)
    assert not marked.any()
    np.testing.assert_allclose(strain_of(device, counts[0]), strain[0], atol=1e-6)


def test_a_shunt_is_the_strain_that_the_whole_bridge_gives() -> None:
    """Eq. (20) before its approximation, written out: R1 R3 - R2 R4 over (R1 + R2)(R3 + R4)."""
    gage, resistor, factor = 120.0, 15e3, 2.1
    with_shunt = gage * resistor / (gage + resistor)
    output = (with_shunt * gage - gage * gage) / ((with_shunt + gage) * 2.0 * gage)
    assert apparent_strain(gage, resistor, factor) == pytest.approx(4.0 * output / factor)


def test_zero_writes_a_device_file_of_a_wheel_that_stands(tmp_path: Path) -> None:
    out = tmp_path / "new.toml"
    outcome = call("zero", "--replay", recorded(tmp_path / "a.mcap", standing()), "--out", out)
    assert outcome.exit_code == 0, outcome.output
    new = read_device(out)
    np.testing.assert_allclose(new.zero, OFFSET, atol=0.2)
    assert (new.name, new.scale, new.lateral) == (WHEEL.name, WHEEL.scale, WHEEL.lateral)
    assert "gage 5: +1800" in outcome.output
    before = out.read_bytes()
    again = call("zero", "--replay", tmp_path / "a.mcap", "--out", out)
    assert isinstance(again.exception, DeviceError)
    assert out.read_bytes() == before


@pytest.mark.parametrize("period_us", [1600.0, 1648.0])
def test_zero_warns_of_a_wheel_whose_clock_contradicts_its_rate(
    tmp_path: Path, period_us: float
) -> None:
    counts = np.rint(np.tile(OFFSET, (40_000, 1))).astype(np.int16)
    frames = strain_frames(counts, period=1000)
    time = np.rint(np.arange(len(frames)) * period_us).astype(np.int64)
    file = recorded(tmp_path / "a.mcap", encode(replace(frames, t_us=time)))
    outcome = call("zero", "--replay", file, "--out", tmp_path / "new.toml")
    assert outcome.exit_code == 0, outcome.output
    wrong = period_us != 1600.0
    assert ("WARNING: wheel 0: its clock shows 9709 samples a second" in outcome.output) == wrong
    np.testing.assert_allclose(read_device(tmp_path / "new.toml").zero, OFFSET, atol=0.5)


def test_zero_of_a_wheel_that_turns_is_refused(tmp_path: Path) -> None:
    wire = list(write_script(tiny_runs(), WHEEL, Faults({})).frames)
    outcome = call(
        "zero", "--replay", recorded(tmp_path / "a.mcap", wire), "--out", tmp_path / "new.toml"
    )
    assert "stop the wheel" in str(outcome.exception)
    assert not (tmp_path / "new.toml").exists()


def test_a_wheel_that_creeps_is_refused_and_so_is_too_little(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(0.0, 3.0, (40_000, 5))
    creeping = np.rint(noise + np.linspace(0.0, 60.0, 40_000)[:, None]).astype(np.int16)
    wire = encode(strain_frames(creeping, period=1000))
    outcome = call(
        "zero", "--replay", recorded(tmp_path / "a.mcap", wire), "--out", tmp_path / "new.toml"
    )
    assert "drifts by" in str(outcome.exception)
    outcome = call(
        "zero",
        "--replay",
        recorded(tmp_path / "b.mcap", standing()[:300]),
        "--out",
        tmp_path / "new.toml",
    )
    assert "at least 1 s are needed" in str(outcome.exception)


def test_a_shunt_gives_each_gage_its_gain(tmp_path: Path) -> None:
    apparent = apparent_strain(350.0, 100e3, 2.1)
    gains = np.array([1.0, 0.8, 1.25, 1.0, 2.0])
    after = OFFSET + apparent / gains / WHEEL.scale
    off = recorded(tmp_path / "off.mcap", standing())
    on = recorded(tmp_path / "on.mcap", standing(after, 2))
    out = tmp_path / "new.toml"
    outcome = call("shunt", "--replay", off, on, *SHUNT, "--out", out)
    assert outcome.exit_code == 0, outcome.output
    new = read_device(out)
    np.testing.assert_allclose(new.gain, gains, rtol=3e-4)
    step = strain_of(new, after) - strain_of(new, OFFSET)
    np.testing.assert_allclose(step, apparent, rtol=3e-4)
    one = tmp_path / "one.toml"
    assert call("shunt", "--replay", off, on, *SHUNT, "--gage", 2, "--out", one).exit_code == 0
    assert tomllib.loads(one.read_text())["gages"]["gain"][0::2] == [1.0, 1.0, 1.0]
    wrong = call("shunt", "--replay", off, on, *SHUNT, "--positive", "--out", tmp_path / "x.toml")
    assert "gage 1" in str(wrong.exception)


def test_a_shunt_of_a_device_that_has_gains_multiplies_them() -> None:
    known = replace(WHEEL, gain=(1.0, 0.8, 1.25, 1.0, 2.0))
    step = -1e-3 * np.array([1.0, 0.5, 1.6, 1.0, 0.9])
    new = shunted(known, np.zeros(5), step, -1e-3, [2, 3, 5])
    np.testing.assert_allclose(new.gain, [1.0, 1.6, 0.78125, 1.0, 2.0 / 0.9], rtol=1e-6)


def test_one_recording_where_two_are_needed_does_not_swallow_an_option(tmp_path: Path) -> None:
    outcome = call("shunt", "--replay", "off.mcap", *SHUNT, "--out", tmp_path / "x.toml")
    assert outcome.exit_code == 2
    assert "--gage-resistance stands in the place of a recording; two are needed" in outcome.stderr


def test_a_shunt_that_nobody_put_on_is_told() -> None:
    with pytest.raises(DeviceError, match=r"gage 4: a step of 2 microstrain") as refused:
        shunted(WHEEL, np.zeros(5), np.array([-900e-6, np.nan, -1e-3, 2e-6, -2e-3]), -1e-3)
    assert "gage 2" not in str(refused.value)  # it shows nothing at all, as before
    with pytest.raises(DeviceError, match="gage 2"):
        shunted(WHEEL, np.zeros(5), np.full(5, np.nan), -1e-3, [2])


def shown(mean: FloatArray, spread: float = 2e-5, blocks: int = 12) -> list[Level]:
    none = np.zeros(5)
    return [Level(0, 0.25, mean, mean - spread / 2, mean + spread / 2, none)] * blocks


def test_the_page_takes_zero_and_shunt_of_a_standing_wheel_and_of_no_other(tmp_path: Path) -> None:
    gages, desk_said = GageSetup(source := FakeSource(0), tmp_path), []
    desk = CommandDesk(None, gages)
    device = source.wheels.heard[0].timeline.device

    def told(**words: object) -> str:
        desk._pipes.append(Pipe(Command(**words).pack()))
        desk._next = 0.0
        desk.poll()
        desk_said.append(desk.state()["answers"][-1])
        return str(desk_said[-1]["text"])

    assert "no data come at this moment" in told(kind="zero")
    gages.watch(shown(OFFSET * 1e-6, spread=3e-3))
    assert "stop the wheel" in told(kind="zero")
    gages.watch(shown(OFFSET * 1e-6))
    assert "zero written to wheel-0-zero-" in told(kind="zero")
    (file,) = tmp_path.glob("wheel-0-zero-*.toml")
    np.testing.assert_allclose(read_device(file).zero, OFFSET * 1e-6 / device.scale, atol=1e-3)
    numbers = "350 100000 2.1"
    assert "no mean without the shunt" in told(kind="shunt", on=True, text=numbers)
    assert "connect the shunt" in told(kind="shunt", text=numbers)
    gages.watch(shown(OFFSET * 1e-6 + apparent_strain(350.0, 1e5, 2.1) / 1.25))
    assert "three numbers" in told(kind="shunt", on=True, text="350 ohm")
    assert "shunt written" in told(kind="shunt", on=True, text=numbers)
    (file,) = tmp_path.glob("wheel-0-shunt-*.toml")
    np.testing.assert_allclose(read_device(file).gain, 1.25, rtol=1e-4)
    assert [one["good"] for one in desk_said] == [False, False, True, False, True, False, True]
    assert gages.state()["0"]["range"] == [20.0] * 5
    desk = CommandDesk(None)
    assert "in a replay" in told(kind="zero")


class Pipe:
    """A pipe with one message."""

    def __init__(self, message: bytes) -> None:
        self._messages = [message]

    def poll(self, _: float) -> bool:
        return bool(self._messages)

    def recv_bytes(self, _: int) -> bytes:
        return self._messages.pop()

    def close(self) -> None: ...


@pytest.mark.parametrize("wrong", [{"wheel": -1}, {"wheel": 256}, {"wheel": True}, {"wheel": "0"}])
def test_a_wheel_that_is_none_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(DeviceError, match=r"0 \.\. 255"):
        parse_command({"command": "zero", **wrong})


def test_zero_reads_a_port(tmp_path: Path) -> None:
    terminal, wire, ended = PseudoTerminal(), standing(), threading.Event()

    def send() -> None:
        while not ended.is_set():
            if terminal.listened:
                terminal.send(b"".join(wire[:20]))
                wire[:] = wire[20:] or standing()

    sender = threading.Thread(target=send)
    sender.start()
    try:
        outcome = call(
            "zero", "--port", terminal.path, "--seconds", 1, "--out", tmp_path / "new.toml"
        )
    finally:
        ended.set()
        sender.join()
        terminal.close()
    assert outcome.exit_code == 0, (outcome.output, outcome.exception)
    np.testing.assert_allclose(read_device(tmp_path / "new.toml").zero, OFFSET, atol=0.5)
