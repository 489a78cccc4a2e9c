"""A recording holds the bytes as they came, and whatever is left of it can be read."""

import math
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, RecordingError
from tirebench.links import Read
from tirebench.recording.link import ReplayLink
from tirebench.recording.recording import Recorder, Recording, RecordingHeader
from tirebench.wire.conditions import (
    Conditions,
    RunMark,
    condition,
    conditions_document,
    parse_conditions,
    read_conditions,
)

CONDITIONS = Conditions(
    (0, 10_000, 20_000),
    (
        condition(18.0, 2.3e5, 0.01),
        condition(math.nan, 2.3e5, -0.01, 59.5),
        condition(18.1, math.nan, 0.0),
    ),
    (RunMark(7, 0, 0.25, {"Fz": 3000.0, "alpha": 0.02}),),
    30_000,
)
READS = [b"\0abc", bytes(range(256)), b"x" * 5000]


def write(path: Path) -> None:
    header = RecordingHeader({"port": "p", "wheel": 3}, "format = 'x'", "ab" * 32)
    with Recorder(path, header, CONDITIONS) as recorder:
        for number, data in enumerate(READS):
            recorder.read(Read(time.monotonic_ns() + number, data))
            recorder.flush()


def assert_same(a: Conditions, b: Conditions) -> None:
    assert (a.t_us, a.loop_us, len(a.runs)) == (b.t_us, b.loop_us, len(b.runs))
    for x, y in zip(a.values, b.values, strict=True):
        assert x == pytest.approx(y, rel=1e-15, nan_ok=True)
    assert a.runs[0].truth == pytest.approx(b.runs[0].truth, rel=1e-15)


def test_what_was_recorded_comes_back(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    recording = Recording(tmp_path / "a.mcap")
    assert recording.header.settings == {"port": "p", "wheel": 3}
    assert recording.header.device == "format = 'x'"
    assert recording.header.fmu == "ab" * 32
    assert_same(recording.conditions, CONDITIONS)
    assert [data for _, data in recording.raw()] == READS
    assert recording.complete
    recording.close()


def test_a_replay_gives_the_same_reads_and_then_ends(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    link = ReplayLink(tmp_path / "a.mcap")
    reads = [link.receive(Deadline.never()) for _ in range(4)]
    assert [read.data for read in reads[:3] if read] == READS
    assert reads[3] is None
    link.close()


def test_other_programs_can_read_a_recording(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as file:
        messages = [(c.topic, m.data) for _, c, m in make_reader(file).iter_messages()]
    assert [data for topic, data in messages if topic == "/raw/0"] == READS
    assert "/conditions" in [topic for topic, _ in messages]


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("recording") / "a.mcap"
    write(path)
    return path.read_bytes()


@given(share=st.floats(0.0, 1.0), flip=st.integers(-1, 10**6))
def test_a_recording_cut_or_damaged_anywhere_gives_what_is_left(
    content: bytes, tmp_path_factory: pytest.TempPathFactory, share: float, flip: int
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    data = bytearray(content[: int(share * len(content))])
    if flip >= 0 and data:
        data[flip % len(data)] ^= 0x55
    path.write_bytes(data)
    try:
        recording = Recording(path)
    except RecordingError:
        return  # not even the header is whole
    reads = [data for _, data in recording.raw()]
    recording.close()
    if flip < 0:
        assert reads == READS[: len(reads)]
        assert recording.complete == (len(data) == len(content))


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    with pytest.raises(RecordingError, match=r"a.mcap: already exists; a recording is never"):
        write(tmp_path / "a.mcap")


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"nonsense" * 100)
    with pytest.raises(RecordingError, match=r"the header of a recording is missing"):
        Recording(tmp_path / "a.mcap")
    with pytest.raises(RecordingError, match=r"cannot be read"):
        Recording(tmp_path / "b.mcap")


def test_an_unknown_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tirebench.recording.header.FORMAT", "tirebench-recording/9")
    write(tmp_path / "a.mcap")
    monkeypatch.undo()
    with pytest.raises(
        RecordingError, match=r"'tirebench-recording/9'; this program reads 'tirebench-recording/2'"
    ):
        Recording(tmp_path / "a.mcap")


def test_conditions_are_held_and_repeat_in_a_loop() -> None:
    assert CONDITIONS.at(9_999.0)[0] == 18.0
    assert math.isnan(CONDITIONS.at(10_000.0)[0])
    assert CONDITIONS.at(60_000.0 + 25_000.0)[0] == 18.1
    assert CONDITIONS.run_at(61_000.0) == (CONDITIONS.runs[0], 60_000)
    later = Conditions((5000, 6000), (condition(1.0, 2.0, 3.0),) * 2)
    assert math.isnan(later.at(4000.0)[0])
    assert later.run_at(7000.0) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "format = None"),
        ("[]", "format = 'list'"),
        ("{", "cannot be read"),
        ('{"format": "tirebench-conditions/1"}', "KeyError 't_us'; t_us, speed"),
    ],
)
def test_a_wrong_sidecar_says_what_is_wrong(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "c.json").write_text(text)
    with pytest.raises(DeviceError, match=message):
        read_conditions(tmp_path / "c.json")


@pytest.mark.parametrize(
    "change",
    [
        {"loop_us": math.inf},
        {"speed": 5},
        {"speed": {"unit": "m/s", "values": 5}},
        {"t_us": [{}]},
        {"runs": [3]},
        {"runs": [{"run": 1, "t_us": 0, "start_s": 0.0, "truth": [1]}]},
        {"campaign": 7},
    ],
)
def test_a_sidecar_of_another_make_is_refused(change: dict[str, Any]) -> None:
    sound = conditions_document(Conditions.constant(18.0))
    assert parse_conditions(sound, "c.json").t_us == (0,)
    with pytest.raises(DeviceError, match=r"c\.json: .* lists of the same length"):
        parse_conditions(sound | change, "c.json")


def test_a_sidecar_of_the_first_format_knows_no_turn_rate() -> None:
    document = conditions_document(Conditions.constant(18.0, 2.3e5, 0.01, 59.5))
    assert parse_conditions(document, "a").values[0][:4] == pytest.approx((18.0, 2.3e5, 0.01, 59.5))
    del document["omega"]
    with pytest.raises(DeviceError, match="KeyError 'omega'"):
        parse_conditions(document, "a")
    first = parse_conditions({**document, "format": "tirebench-conditions/1"}, "a")
    assert first.values[0][:4] == pytest.approx((18.0, 2.3e5, 0.01, math.nan), nan_ok=True)
    assert all(math.isnan(value) for value in first.values[0][4:])
