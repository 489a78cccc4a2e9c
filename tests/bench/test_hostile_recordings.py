"""A recording that is damaged or made to do harm: a message or a break-off, in bounded memory."""

import io
import json
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from mcap.data_stream import RecordBuilder
from mcap.exceptions import EndOfFile
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from tirebench.cli import program
from tirebench.errors import BenchError, RecordingError
from tirebench.protocols import CAN, SERIAL
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording import records
from tirebench.recording.header import FORMER as FORMAT
from tirebench.recording.recording import Recording
from tirebench.recording.topics import CONDITIONS, ESTIMATE, EVENTS
from tirebench.wire.conditions import Conditions, RunMark, condition, conditions_document

NESTED = "[" * 100_000
MARK = RunMark(1, 0, 0.0, {}, {"kind": "free", "load": 3000.0})
SOUND = conditions_document(Conditions((0,), (condition(18.0, 2.3e5, 0.0),), (MARK,)))
JUMP = {
    "event": "jump",
    "wheel": 0,
    "from": [0, 0],
    "to": [0, 9],
    "why": "x",
    "samples": 9,
    "turns": 0,
}


def made(
    path: Path,
    conditions: Any = SOUND,
    event: Any = JUMP,
    encoding: str = SERIAL,
    packed: CompressionType | None = None,
    times: int = 1,
    arrivals: tuple[int, ...] = (),
    estimate: Any = None,
    **header: Any,
) -> Path:
    """Write a recording as this program would not."""
    with path.open("wb") as file:
        writer = Writer(
            file, use_chunking=packed is not None, compression=packed or CompressionType.NONE
        )
        writer.start("tirebench", FORMAT)
        text = {
            "settings": "{}",
            "device": "",
            "fmu_sha256": "",
            "wall_ns": "2",
            "protocol": json.dumps(ProtocolPlan(encoding).as_header()),
            "monotonic_ns": "1",
        }
        texts = {k: v if isinstance(v, str) else json.dumps(v) for k, v in header.items()}
        writer.add_metadata("tirebench", {"format": FORMAT, **text, **texts})
        parts = {CONDITIONS: conditions, EVENTS: event, ESTIMATE.format(0): estimate}
        for topic, content in parts.items():
            if content is None:
                continue
            channel = writer.register_channel(topic, "json", 0)
            data = content if isinstance(content, str) else json.dumps(content)
            for _ in range(times if topic == EVENTS else 1):
                writer.add_message(channel, 1, data.encode(), 1)
        raw = writer.register_channel(f"/{encoding.partition('-')[0]}", encoding, 0)
        for arrival in arrivals:
            frame = bytes([16]) + (0x120).to_bytes(4, "little") + bytes([8, 0, 0, 0]) + bytes(8)
            writer.add_message(raw, arrival, frame, arrival)
        writer.finish()
    return path


def invoke(*words: object) -> tuple[int, str]:
    """Return exit code and text as `tirebench.cli.main` gives them."""
    outcome = CliRunner().invoke(program, [str(word) for word in words])
    if outcome.exception is not None and not isinstance(outcome.exception, SystemExit):
        assert isinstance(outcome.exception, BenchError), repr(outcome.exception)
        return 2, str(outcome.exception)
    return outcome.exit_code, outcome.output


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        ({"conditions": NESTED}, "the conditions are damaged (JSON is nested too deeply)"),
        ({"settings": NESTED}, "the header is damaged (JSON is nested too deeply)"),
        ({"settings": {"wheels": 1e308}}, "wheels = 1e+308; a list of 0 .. 255 is allowed"),
        ({"settings": {"wheels": [2**70]}}, "a list of 0 .. 255 is allowed"),
        ({"protocol": {"rate_hz": 10**400}}, "rate_hz = 1000000"),
        ({"protocol": {"rate_hz": float("nan")}}, "rate_hz = nan; 153 .. 200000 Hz is allowed"),
        ({"protocol": {"rate_hz": 0}}, "rate_hz = 0; 153"),
        ({"protocol": {"rate_hz": [1e4]}}, "rate_hz = [10000.0]; 153"),
        ({"protocol": {"map": "not valid TOML"}}, "the map is not valid TOML"),
        ({"wall_ns": str(2**70)}, "the header is damaged (a time of 1180591620717411303424 ns"),
        ({"device": "# wheel x\n"}, "device file of wheel 'x'; 0 .. 255 is allowed"),
        ({"device": "# wheel " + "9" * 5000}, "0 .. 255 is allowed"),
        (
            {
                "conditions": SOUND
                | {"runs": [{"run": 1, "t_us": 0, "start_s": 0.0, "plan_si": {"load": "much"}}]}
            },
            "the conditions are damaged",
        ),
    ],
)
@pytest.mark.parametrize("verb", ["export", "replay"])
def test_damage_of_what_a_recording_says_of_itself_is_named(
    verb: str, damage: dict[str, Any], said: str, tmp_path: Path, toy_fmus: dict[int, Path]
) -> None:
    path = made(tmp_path / "a.mcap", **damage)
    target = ("--out", tmp_path / "a.csv") if verb == "export" else ("--fmu", toy_fmus[16])
    code, text = invoke(verb, path, *target)
    assert code == 2
    assert said in text


@pytest.mark.parametrize("event", [NESTED, JUMP | {"samples": float("inf")}, [1], JUMP])
def test_an_event_that_says_nothing_is_passed_over(event: Any, tmp_path: Path) -> None:
    recording = Recording(made(tmp_path / "a.mcap", event=event))
    assert [jump.samples for jump in recording.jumps()] == ([9] if event is JUMP else [])
    assert list(recording.reads()) == []
    assert recording.complete
    recording.close()


@pytest.mark.parametrize("ending", ["csv", "parquet", "mf4"])
@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"event": {"event": [1]}}, "event = '[1]'; a string is needed"),
        ({"event": {"event": "marker", "text": "\ud800"}}, "a string is needed"),
        ({"event": {"event": "marker", "wheel": {}}}, "wheel = '{}'; a number or null is needed"),
        ({"estimate": {"Fz": "much"}}, "Fz = 'much'; a number or null is needed"),
        ({"estimate": {"turn": 1, "segment": 2**70}}, "a number or null is needed"),
        ({"estimate": {"flags": 5}}, "flags = '5'; a list of strings is needed"),
    ],
)
def test_an_estimate_or_event_that_no_table_can_hold_is_named(
    parts: dict[str, Any], said: str, ending: str, tmp_path: Path
) -> None:
    path = made(tmp_path / "a.mcap", **parts)
    code, text = invoke("export", path, "--out", tmp_path / f"a.{ending}")
    assert code == 2
    assert said in text


@pytest.mark.parametrize("campaign", [{"name": None}, {"name": "\ud800"}])
def test_a_campaign_that_cannot_be_written_is_named(campaign: Any, tmp_path: Path) -> None:
    path = made(tmp_path / "a.mcap", SOUND | {"campaign": campaign})
    code, text = invoke("export", path, "--out", tmp_path / "out")
    assert code == 2
    assert "its tire and gage data are damaged" in text


@pytest.mark.parametrize("ending", ["blf", "asc", "log"])
def test_a_recording_breaks_off_at_a_time_that_is_none(ending: str, tmp_path: Path) -> None:
    path = made(tmp_path / "a.mcap", encoding=CAN, arrivals=(10**9, 2**64 - 1, 2 * 10**9))
    code, text = invoke("export", path, "--out", tmp_path / f"a.{ending}")
    assert code == 1
    assert "1 frames in" in text
    assert "is incomplete (a time of 18446744073709551615 ns; 0 .. 2^63 is allowed)" in text


@pytest.mark.parametrize("packed", [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_chunk_of_many_small_records_takes_little_memory(
    packed: CompressionType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = made(tmp_path / "a.mcap", packed=packed, event="{}", times=15_000)  # 0.5 MB
    monkeypatch.setattr(records, "LARGEST_RECORD", 2**20)
    tracemalloc.start()
    try:
        with path.open("rb") as file:
            count = sum(isinstance(record, Message) for record in records.records(file))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert count == 15_001
    assert peak < 3 * 2**20  # as a list they took eight times as much


def chunks(count: int, packed: CompressionType, change: Callable[[Chunk], None]) -> io.BytesIO:
    """Return a file of a chunk, changed and repeated."""
    source = io.BytesIO()
    writer = Writer(source, compression=packed)
    writer.start()
    writer.add_message(writer.register_channel("t", "json", 0), 1, bytes(2**18), 1)
    writer.finish()
    source.seek(0)
    chunk = next(r for r in StreamReader(source, emit_chunks=True).records if isinstance(r, Chunk))
    change(chunk)
    builder = RecordBuilder()
    chunk.write(builder)
    return io.BytesIO(source.getvalue()[:8] + count * builder.end())


def told(size: int) -> Callable[[Chunk], None]:
    def change(chunk: Chunk) -> None:
        chunk.uncompressed_size = size

    return change


def packed_by(name: str) -> Callable[[Chunk], None]:
    def change(chunk: Chunk) -> None:
        chunk.compression = name

    return change


def nested(chunk: Chunk) -> None:
    builder = RecordBuilder()
    chunk.write(builder)
    chunk.data, chunk.compression = builder.end(), ""
    chunk.uncompressed_size = len(chunk.data)


ZSTD, LZ4 = CompressionType.ZSTD, CompressionType.LZ4


@pytest.mark.parametrize(
    ("count", "packed", "change", "said"),
    [
        (1, ZSTD, told(2**62), "a chunk unpacks to 4611686018427387904 bytes; 1048576 are allowed"),
        (1, ZSTD, told(100), "unpacks to 262205 bytes or more, but states 100"),
        (1, LZ4, told(100), "unpacks to 262205 bytes or more, but states 100"),
        (1, ZSTD, packed_by("brotli"), "compressed with 'brotli'; zstd and lz4 are allowed"),
        (1, ZSTD, nested, "a chunk contains a chunk"),
    ],
)
def test_a_chunk_that_lies_is_refused(
    count: int,
    packed: CompressionType,
    change: Callable[[Chunk], None],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(records, "LARGEST_RECORD", 2**20)
    with pytest.raises(RecordingError, match=said):
        list(records.records(chunks(count, packed, change)))


def test_chunks_that_unpack_to_much_more_than_the_file_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def same(_: Chunk) -> None:
        pass

    monkeypatch.setattr(records, "LARGEST_RECORD", 2**20)
    few, many = chunks(3, ZSTD, same), chunks(8, ZSTD, same)
    with pytest.raises(EndOfFile):  # they have no footer
        list(records.records(few))
    with pytest.raises(RecordingError, match="a factor of 100 is allowed"):
        list(records.records(many))
