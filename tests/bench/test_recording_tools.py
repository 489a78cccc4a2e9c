"""Other programs list and plot a recording; one without its end is repaired."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

from tests.bench.campaigns import tiny_runs
from tests.bench.disks import little_room
from tests.bench.test_bridges import TURN
from tests.bench.test_journal import DOCUMENTS, TURNS
from tests.bench.test_recording import READS
from tirebench.cli import program
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.errors import RecordingError
from tirebench.estimator.wheels import BusCondition, Wheels
from tirebench.links import Read
from tirebench.protocols.decoder import SerialDecoder
from tirebench.recording.document import line_document, turn_document, wheel_document
from tirebench.recording.header import RecordingHeader
from tirebench.recording.recorder import Recorder
from tirebench.recording.recording import Recording
from tirebench.wire.conditions import Conditions, Measured
from tirebench.wire.device import Device
from tirebench.wire.timeline import Samples

PERIOD = 100_000
"""Period of the samples, [ns]."""
MODULES = os.environ.get("MCAP_MODULES", "")
READER = Path(__file__).parents[2] / "build" / "mcap_index.cjs"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a second of a wheel with two sources, and all that a run makes of it."""
    path = tmp_path_factory.mktemp("tools") / "a.mcap"
    wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
    header = RecordingHeader(
        {},
        protocol={"encoding": "serial-v1", "name": "/dev/ttyUSB0"},
        more=({"encoding": "can", "name": "can0"},),
    )
    frames = list(write_script(tiny_runs()[:1], Device(), Faults({})).frames[:200])
    frames[50] = frames[151] = b""  # lost
    with Recorder(path, header, Conditions.constant(18.0)) as recorder:
        start = header.monotonic_ns
        for number in range(0, len(frames), 4):
            read = Read(start + (number + 4) * 16 * PERIOD, b"".join(frames[number : number + 4]))
            recorder.read(read)
            for block in wheels.push(read.data, read.arrival):
                recorder.block(block)
        recorder.read(Read(start, b"bus", "", 1))
        told = BusCondition(0, Measured("pressure", 2.3e5))
        recorder.block(type(block)(0, start, 0, told))
        recorder.estimate(2, start, json.dumps(turn_document(TURN)).encode())
        recorder.link(None, line_document(*wheels.counts))
        recorder.link(0, wheel_document(wheels, 0))
        recorder.event({"event": "marker", "text": "kerb"})
    return path


def contents(path: Path) -> dict[str, list[Any]]:
    """Return what an indexed reader finds under each topic, its JSON checked by its schema."""
    found: dict[str, list[Any]] = {}
    checks: dict[int, Any] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            content: Any = message.data
            if channel.message_encoding == "json":
                assert schema is not None
                assert schema.encoding == "jsonschema"
                if schema.id not in checks:
                    checks[schema.id] = jsonschema.Draft202012Validator(json.loads(schema.data))
                content = json.loads(message.data, parse_constant=pytest.fail)
                checks[schema.id].validate(content)
            found.setdefault(channel.topic, []).append((message, content))
    return found


TOPICS = {
    "/raw/0",
    "/raw/1",
    "/events",
    "/conditions",
    "/line",
    "/wheel/0/strain",
    "/wheel/0/conditions",
    "/wheel/0/link",
    "/wheel/2/estimate",
}


def test_an_indexed_reader_lists_all_topics_and_every_message_follows_its_schema(
    recording: Path,
) -> None:
    found = contents(recording)
    assert set(found) == TOPICS
    assert found["/wheel/2/estimate"][0][1]["Fz"] == 4321.5
    assert found["/wheel/0/conditions"][0][1] == {"pressure_bar": pytest.approx(2.3)}
    assert found["/raw/1"][0][1] == b"bus"
    assert all(
        message.publish_time == message.log_time > 1.5e18
        for topic in found.values()
        for message, _ in topic
    )


def test_strain_stands_in_the_recording_as_it_was_decoded(recording: Path) -> None:
    reader = Recording(recording)
    wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
    decoded = [
        block.content
        for read in reader.reads()
        if read.source == 0
        for block in wheels.push(read.data, read.arrival)
    ]
    reader.close()
    strain = np.concatenate([b.strain for b in decoded if isinstance(b, Samples)]).T * 1e6
    messages = contents(recording)["/wheel/0/strain"]
    messages.sort(key=lambda message: message[1]["t_us"])
    for gage in range(5):
        column = [value for _, content in messages for value in content[f"gage_{gage + 1}"]]
        seen = np.array([np.nan if value is None else value for value in column])
        np.testing.assert_allclose(seen, strain[gage], atol=0.0501)
    assert np.isnan(strain).any()
    steps = np.diff([message.log_time for message, _ in messages])
    np.testing.assert_allclose(steps[4:], 16 * PERIOD, atol=0.05 * PERIOD)  # drift that is allowed


def test_the_reader_that_foxglove_publishes_reads_all_of_it_by_its_index(recording: Path) -> None:
    node = shutil.which("node")
    if node is None or not MODULES:
        pytest.skip("node and MCAP_MODULES are needed, see build/mcap_index.cjs")
    said = subprocess.run([node, READER, MODULES, recording], capture_output=True, check=True)
    found = json.loads(said.stdout)
    assert set(found["topics"]) == TOPICS
    assert found["messages"] == sum(topic["messages"] for topic in found["topics"].values())
    assert found["topics"]["/wheel/0/strain"]["schema"] == "tirebench.Strain"


def invoke(*words: object) -> tuple[int, str]:
    outcome = CliRunner().invoke(program, [str(word) for word in words])
    if outcome.exception is not None and not isinstance(outcome.exception, SystemExit):
        assert isinstance(outcome.exception, RecordingError), repr(outcome.exception)
        return 2, str(outcome.exception)
    return outcome.exit_code, outcome.output


@pytest.mark.parametrize("version", ["tirebench-recording/1", "tirebench-recording/2"])
def test_a_recording_without_its_end_is_repaired(
    recording: Path, tmp_path: Path, version: str
) -> None:
    broken, whole = tmp_path / "b.mcap", tmp_path / "whole.mcap"
    if version.endswith("2"):
        recorder = Recorder(broken, RecordingHeader({}), Conditions.constant())
        for data in READS:
            recorder.read(Read(5, data))
            recorder.flush()
        recorder.abandon()
    else:
        _former(broken)
    with broken.open("ab") as file:
        file.write(b"\6" + (500).to_bytes(8, "little") + b"half a chunk")
    code, said = invoke("repair", broken, "--out", whole)
    assert code == 0
    assert "is incomplete" in said
    raw = "/raw/0" if version.endswith("2") else "/serial"
    assert [content for _, content in contents_of_raw(whole, raw)] == READS
    again = Recording(whole)
    assert [(read.arrival, read.data) for read in again.reads()] == [(5, data) for data in READS]
    assert again.complete
    again.close()
    assert invoke("repair", broken, "--out", whole)[0] == 2


def test_what_follows_a_damaged_chunk_is_repaired(tmp_path: Path) -> None:
    """One chunk in the middle is damaged: its bytes are lost, and no others."""
    broken, whole = tmp_path / "b.mcap", tmp_path / "whole.mcap"
    recorder = Recorder(broken, RecordingHeader({}), Conditions.constant())
    pieces = [bytes([number]) * 40 + bytes(range(256)) for number in range(9)]
    for data in pieces:
        recorder.read(Read(5, data))
        recorder.flush()
    recorder.close("closed")
    with broken.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    middle = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)[4]
    content = bytearray(broken.read_bytes())
    content[middle.chunk_start_offset + middle.chunk_length // 2] ^= 1
    broken.write_bytes(content)
    code, said = invoke("repair", broken, "--out", whole)
    assert code == 0
    assert "1 chunk is left out" in said
    again = Recording(whole)
    kept = [data for _, data in again.raw()]
    assert len(kept) == 8
    assert kept == [data for data in pieces if data in kept]
    assert again.complete
    again.close()


def test_options_of_a_line_are_refused_where_a_recording_is_replayed(
    recording: Path, tmp_path: Path
) -> None:
    """The recording holds how its lines were read; a map would be passed over in silence."""
    (tmp_path / "map.toml").write_text('format = "tirebench-map/1"\n[seed]\n')
    (tmp_path / "x.fmu").write_bytes(b"")
    words = ("run", "--replay", recording, "--fmu", tmp_path / "x.fmu", "--no-page")
    for option, value in (("--map", tmp_path / "map.toml"), ("--baud", "115200")):
        code, said = invoke(*words, option, value)
        assert code == 2
        assert f"{option} cannot be used with --replay" in said


def contents_of_raw(path: Path, topic: str) -> list[tuple[Any, bytes]]:
    with path.open("rb") as file:
        return [(m, m.data) for _, c, m in make_reader(file).iter_messages() if c.topic == topic]


def _former(path: Path) -> None:
    """Write a recording of the former version, without its end."""
    from mcap.writer import Writer

    from tirebench.wire.conditions import conditions_document

    header = RecordingHeader({})
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start("tirebench", "tirebench-recording/1")
        text = header.as_text()
        text |= {"format": "tirebench-recording/1", "protocol": "{}"}
        del text["sources"], text["recording"], text["part"]
        writer.add_metadata("tirebench", text)
        raw = writer.register_channel("/serial", "serial-v1", 0)
        conditions = writer.register_channel("/conditions", "json", 0)
        document = json.dumps(conditions_document(Conditions.constant())).encode()
        writer.add_message(conditions, header.wall_ns, document, header.monotonic_ns)
        for data in READS:
            writer.add_message(raw, header.wall_ns + 5, data, 5)


def test_what_is_no_recording_cannot_be_repaired(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"nonsense" * 99)
    code, said = invoke("repair", tmp_path / "a.mcap", "--out", tmp_path / "b.mcap")
    assert code == 2
    assert "nothing in it can be read" in said
    assert not (tmp_path / "b.mcap").exists()


def test_the_json_of_a_killed_run_is_repaired(tmp_path: Path) -> None:
    from tirebench.recording.journal import Journal

    journal = Journal(tmp_path / "r.json")
    journal.add(TURNS)
    journal.close()
    assert invoke("repair", tmp_path / "r.json", "--out", tmp_path / "w.json")[0] == 0
    assert json.loads((tmp_path / "w.json").read_text())["turns"] == DOCUMENTS


def test_a_repair_that_a_full_disk_ends_leaves_nothing(recording: Path, tmp_path: Path) -> None:
    words = ("repair", recording, "--out", tmp_path / "whole.mcap")
    with little_room():
        code, said = invoke(*words)
    assert (code, "no partial copy is left" in said) == (2, True)
    assert list(tmp_path.iterdir()) == []
    assert invoke(*words)[0] == 0


def test_a_chunk_that_was_altered_is_not_believed(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", RecordingHeader({}), Conditions.constant())
    start = recorder.length
    recorder.read(Read(5, bytes(range(256)) * 20))
    recorder.close("closed")
    content = bytearray((tmp_path / "a.mcap").read_bytes())
    place = content.index(bytes(range(100, 140)), start)
    content[place] ^= 1
    (tmp_path / "a.mcap").write_bytes(content)
    reading = Recording(tmp_path / "a.mcap")
    assert list(reading.reads()) == []
    assert reading.complete is False
    assert "a chunk is damaged" in reading.damage
    reading.close()
