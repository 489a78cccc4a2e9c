"""A disk that is full ends nothing: the recorder says so, and goes on when there is room."""

import errno
import pickle
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from click.testing import CliRunner

from tirebench.cli import program, record
from tirebench.errors import RecordingError
from tirebench.links import BACK, LOST, PASSED, RESUMED, Read
from tirebench.live.exchange import Exchange
from tirebench.live.recorder import _Recorder
from tirebench.live.recording_state import Order, RecorderState, RecordingRule
from tirebench.live.supervised import CONTEXT
from tirebench.recording.header import RecordingHeader
from tirebench.recording.mcap_log import McapLog
from tirebench.recording.recorder import Recorder
from tirebench.recording.recording import Recording
from tirebench.wire.conditions import Conditions

STEADY = Conditions.constant(18.0)
PIECES = [bytes([number]) * 5000 for number in range(9)]


class Disk:
    """Room for so many bytes of all files together."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.full = False
        write = McapLog._write

        def write_if_room(log: McapLog, data: bytes) -> None:
            if self.full:
                write(log, data[: len(data) // 2])  # a full disk takes a part
                raise OSError(errno.ENOSPC, "No space left on device")
            write(log, data)

        monkeypatch.setattr(McapLog, "_write", write_if_room)


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    monkeypatch.setattr("tirebench.live.recorder.settled", lambda: None)
    monkeypatch.setattr("tirebench.live.recorder.RETRY", 0.0)
    monkeypatch.setattr("tirebench.live.recorder.CHUNK", -1.0)
    return Disk(monkeypatch)


class Bench:
    """A recorder that does a step at a time, and the run's side of it."""

    def __init__(self, file: Path, rule: RecordingRule | None = None) -> None:
        self.exchange = Exchange.create(CONTEXT, 1)
        state = RecorderState()
        self.recorder = _Recorder(
            RecordingHeader({}), STEADY, rule or RecordingRule(), self.exchange, state
        )
        self.order("start", str(file))
        self.step()

    def order(self, kind: str, what: Any) -> None:
        self.exchange.orders.put(pickle.dumps(Order(kind, what, 5)))

    def step(self, *pieces: bytes, arrival: int = 7) -> RecorderState:
        for piece in pieces:
            self.exchange.raw.put(pickle.dumps(Read(arrival, piece)))
        obeyed = self.recorder._obey()
        self.recorder._write()
        self.recorder._publish(obeyed=obeyed)
        saved: RecorderState = pickle.loads(self.exchange.recorded.get() or b"")
        return saved

    def close(self) -> RecorderState:
        self.order("close", "stopped")
        self.recorder.run()
        state = self.step()
        self.exchange.close()
        return state


def recorded(path: Path) -> tuple[list[bytes], bool | None]:
    recording = Recording(path)
    data = [data for _, data in recording.raw()]
    recording.close()
    return data, recording.complete


def test_what_a_full_disk_did_not_take_stands_in_the_next_part(disk: Disk, tmp_path: Path) -> None:
    bench = Bench(tmp_path / "a.mcap")
    assert bench.step(*PIECES[:3]).error == ""
    disk.full = True
    failed = bench.step(*PIECES[3:5])
    assert "a.mcap: cannot be written (No space left on device)" in failed.error
    assert failed.as_document(0)["failures"] == 1
    bench.order("event", {"event": "marker", "text": "while it was full"})
    assert bench.step(PIECES[5]).error
    assert not (tmp_path / "a.part2.mcap").exists()
    assert recorded(tmp_path / "a.mcap") == (PIECES[:3], False)
    disk.full = False
    going = bench.step(PIECES[6])
    assert (going.error, going.part, going.path) == ("", 2, tmp_path / "a.part2.mcap")
    assert bench.step(*PIECES[7:]).bytes == 9 * 5000
    assert bench.close().error == ""
    assert recorded(tmp_path / "a.mcap") == (PIECES, True)
    recording = Recording(tmp_path / "a.mcap")
    events = [data for channel, _, data in recording.messages() if channel.topic == "/events"]
    recording.close()
    assert [b"while it was full" in event for event in events].count(True) == 1


def test_a_disk_that_stays_full_ends_the_recording_and_nothing_else(
    disk: Disk, tmp_path: Path
) -> None:
    bench = Bench(tmp_path / "a.mcap")
    bench.step(*PIECES[:2])
    disk.full = True
    bench.step(PIECES[2])
    assert "No space left" in bench.close().error
    assert recorded(tmp_path / "a.mcap") == (PIECES[:2], False)
    assert [file.name for file in tmp_path.iterdir()] == ["a.mcap"]


def test_a_recording_that_cannot_be_begun_leaves_no_file(disk: Disk, tmp_path: Path) -> None:
    disk.full = True
    with pytest.raises(RecordingError, match="No space left"):
        Recorder(tmp_path / "a.mcap", RecordingHeader({}), STEADY)
    assert list(tmp_path.iterdir()) == []


def test_a_recorder_that_starts_again_on_a_full_disk_goes_on_trying(
    disk: Disk, tmp_path: Path
) -> None:
    bench = Bench(tmp_path / "a.mcap")
    bench.step(*PIECES[:2])
    disk.full = True
    state = bench.step(*PIECES[2:4])
    bench.recorder = _Recorder(RecordingHeader({}), STEADY, RecordingRule(), bench.exchange, state)
    assert bench.step().error
    disk.full = False
    assert bench.step().error == ""
    bench.close()
    assert recorded(tmp_path / "a.mcap") == (PIECES[:4], True)


@pytest.mark.parametrize("rule", [RecordingRule(split_size=1500), RecordingRule(split_time=-1.0)])
def test_a_recording_in_parts_is_read_as_one(
    disk: Disk, tmp_path: Path, rule: RecordingRule
) -> None:
    bench = Bench(tmp_path / "a.mcap", rule)
    for piece in PIECES:
        bench.step(piece)
    state = bench.close()
    assert state.part > 3
    assert recorded(tmp_path / "a.mcap") == (PIECES, True)
    later, complete = recorded(tmp_path / "a.part3.mcap")
    assert complete
    assert 0 < len(later) < len(PIECES)
    assert later == PIECES[-len(later) :]


def test_a_name_whose_second_part_is_there_is_refused(disk: Disk, tmp_path: Path) -> None:
    (tmp_path / "a.part2.mcap").touch()
    bench = Bench(tmp_path / "a.mcap")
    assert (
        "a.part2.mcap: already exists and belongs to another recording"
        in bench.recorder._state.answer
    )
    bench.close()


SECOND = 1_000_000_000


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Give what the recorder takes for this moment, [ns]."""
    now = [0]
    monkeypatch.setattr("tirebench.live.recorder.time.monotonic_ns", lambda: now[0])
    return now


def test_a_trigger_records_what_was_before_and_after_it(
    disk: Disk, tmp_path: Path, clock: list[int]
) -> None:
    bench = Bench(tmp_path / "a.mcap", RecordingRule(around=(2.0, 1.0)))
    for second, piece in enumerate(PIECES):
        clock[0] = second * SECOND
        if second == 4:
            bench.exchange.orders.put(
                pickle.dumps(Order("event", {"event": "marker", "text": "kerb"}, clock[0]))
            )
        state = bench.step(piece, arrival=clock[0])
        assert (state.path is not None) == (second in (4, 5))
        assert state.as_document(0)["waits_for_trigger"] == (second not in (4, 5))
    bench.exchange.raw.put(pickle.dumps(Read(8 * SECOND, b"", LOST)))
    assert bench.close().recordings == 2
    assert recorded(tmp_path / "a.mcap") == (PIECES[1:7], True)
    assert recorded(tmp_path / "a-2.mcap") == (PIECES[7:], True)


def test_only_what_begins_triggers(disk: Disk, tmp_path: Path, clock: list[int]) -> None:
    bench = Bench(tmp_path / "a.mcap", RecordingRule(around=(2.0, 3.0)))
    bench.order("event", {"event": "alarm", "state": "off", "text": "Fz"})
    for event in (BACK, RESUMED, PASSED, "raw bytes lost: 9"):
        bench.exchange.raw.put(pickle.dumps(Read(1, b"", event)))
    assert bench.step(PIECES[0]).path is None
    bench.exchange.raw.put(pickle.dumps(Read(1, b"", LOST)))
    assert bench.step().path is not None
    clock[0] = 3 * SECOND  # before the recording ends
    bench.exchange.raw.put(pickle.dumps(Read(clock[0], b"", LOST)))
    bench.step(arrival=clock[0])
    clock[0] = 5 * SECOND
    bench.exchange.orders.put(
        pickle.dumps(Order("event", {"event": "alarm", "state": "off"}, clock[0]))
    )
    assert bench.step().path is not None  # for longer, because the port was lost again
    clock[0] = 7 * SECOND
    assert bench.step().path is None  # an alarm that ends does not
    assert bench.close().recordings == 1


def test_what_was_before_a_trigger_waits_for_room(disk: Disk, tmp_path: Path) -> None:
    bench = Bench(tmp_path / "a.mcap", RecordingRule(around=(9.0, 1e9)))
    bench.step(*PIECES[:4])
    disk.full = True
    bench.order("event", {"event": "alarm", "state": "on", "text": "Fz"})
    assert "No space left" in bench.step(PIECES[4]).error
    disk.full = False
    assert bench.step(PIECES[5]).error == ""
    bench.close()
    assert recorded(tmp_path / "a.mcap") == (PIECES[:6], True)


def test_a_long_time_before_a_trigger_is_written_piece_by_piece_and_the_queue_stays_empty(
    disk: Disk, tmp_path: Path, clock: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What comes meanwhile stands behind it, also where the disk is full in the middle."""
    monkeypatch.setattr("tirebench.live.recorder.CHUNK_BYTES", 9000)  # two pieces
    bench = Bench(tmp_path / "a.mcap", RecordingRule(around=(60.0, 0.0)))
    bench.step(*PIECES[:5])
    bench.order("event", {"event": "marker", "text": "kerb"})
    written, sent = [], list(PIECES[5:])
    clock[0] = 10  # the time after the trigger is over
    while bench.step(*sent[:1]).path is not None:
        disk.full = len(sent) == 4
        written.append(bench.recorder._state.bytes)
        assert bench.exchange.raw.waiting == 0 or bench.recorder._state.error
        sent = sent[1:]
    assert len(written) > 3
    assert max(np.diff([0, *written])) <= 4 * 5000  # two at a time, twice where there is room again
    bench.close()
    data, complete = recorded(tmp_path / "a.mcap")
    assert complete
    assert data == PIECES[: len(data)]
    assert len(data) > 5


def test_an_incomplete_recording_is_said_before_the_counters_fail_on_the_same_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = "No space left on device"

    def unwritable(*_: Any) -> None:
        raise RecordingError(f"record.json: cannot be written ({full})")

    chain = MagicMock()
    chain.__enter__.return_value.counts.return_value = {"recording": {"error": full}}
    session = MagicMock()
    session.return_value.run.return_value = SimpleNamespace(message="", reason="duration")
    stand_ins = {
        "LiveChain": lambda *_: chain,
        "Session": session,
        "realtime": lambda _: "",
        "counters": lambda _: "",
        "line_document": MagicMock(),
        "write_json": unwritable,
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(record, name, stand_in)
    line = ["--port", "tcp://127.0.0.1:9", "--out", str(tmp_path / "a.mcap")]
    result = CliRunner().invoke(program, ["record", *line, "--json", str(tmp_path / "record.json")])
    assert isinstance(result.exception, RecordingError)
    assert f"the recording is incomplete: {full}" in result.output
