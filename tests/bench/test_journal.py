"""Estimates stand in the run's JSON as they come, and the whole document in the end."""

import errno
import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.bench.test_bridges import OUTPUTS
from tirebench.cli import program
from tirebench.errors import RecordingError
from tirebench.estimator.chain import Turn
from tirebench.recording.document import turn_document
from tirebench.recording.header import RecordingHeader
from tirebench.recording.journal import Journal, completed
from tirebench.recording.recorder import Recorder
from tirebench.wire.conditions import Conditions

TURNS = [
    Turn(1, 0, number, number, number, OUTPUTS, {}, 0, (0,) * 5, arrival=number)
    for number in range(5)
]
DOCUMENTS = [turn_document(turn) for turn in TURNS]


class FullDisk:
    """A file on a disk that takes ten bytes more."""

    def __init__(self, file: Any) -> None:
        self.truncate, self.seek, self.close = file.truncate, file.seek, file.close
        self._file, self._room = file, 10

    def write(self, data: bytes) -> int:
        if not self._room:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken, self._room = self._room, 0
        return int(self._file.write(data[:taken]))


def test_a_run_that_is_killed_leaves_its_turns(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    journal = Journal(path)
    journal.add(TURNS[:2])
    journal.add([])
    journal.add(TURNS[2:])
    text = path.read_text()
    journal.close()
    with pytest.raises(ValueError, match="Expecting"):
        json.loads(text)
    document = completed(text)
    assert document is not None
    assert document["turns"] == DOCUMENTS
    assert document["summary"]["Fz"]["n"] == 0
    cut = completed(text[:-30])  # in the middle of the last turn
    assert cut is not None
    assert cut["turns"] == DOCUMENTS[:-1]
    assert completed('{"format": "another"}') is None


def test_the_document_takes_the_place_of_the_turns(tmp_path: Path) -> None:
    path = tmp_path / "new" / "r.json"
    journal = Journal(path)
    journal.add(TURNS)
    journal.finish({"format": "x", "turns": DOCUMENTS, "nothing": float("nan")})
    assert json.loads(path.read_text()) == {"format": "x", "turns": DOCUMENTS, "nothing": None}
    assert [file.name for file in path.parent.iterdir()] == ["r.json"]


def test_turns_wait_while_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.json"
    journal = Journal(path)
    journal.add(TURNS[:2])
    whole, file = path.read_bytes(), journal._file
    assert file is not None

    monkeypatch.setattr(journal, "_file", FullDisk(file))
    journal.add(TURNS[2:3])
    assert journal.error.endswith(
        "turns cannot be written (No space left on device); they are kept in memory until they can"
    )
    assert path.read_bytes() == whole
    monkeypatch.setattr(journal, "_file", file)
    journal.add(TURNS[3:])
    document = completed(path.read_text())
    assert journal.error == ""
    assert document is not None
    assert document["turns"] == DOCUMENTS
    journal.close()


def test_a_document_that_cannot_be_written_leaves_the_turns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.json"
    journal = Journal(path)
    journal.add(TURNS)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(RecordingError, match="tirebench repair"):
        journal.finish({})
    document = completed(path.read_text())
    assert document is not None
    assert len(document["turns"]) == 5


@pytest.mark.parametrize("name", ["a.mcap", "a.part2.mcap", "./b/../a.mcap"])
def test_no_json_takes_the_place_of_a_recording(tmp_path: Path, name: str) -> None:
    (tmp_path / "b").mkdir()
    recording, fmu = tmp_path / "a.mcap", tmp_path / "x.fmu"
    fmu.touch()
    runs = ["run", "--port", "tcp://127.0.0.1:9", "--fmu", fmu, "--record", recording]
    records = ["record", "--port", "tcp://127.0.0.1:9", "--out", recording]
    for command in (runs, records):
        said = refused(*command, "--json", tmp_path / name)
        assert "is never overwritten" in said
        assert not recording.exists()
    Recorder(recording, RecordingHeader({}), Conditions.constant()).close("closed")
    shutil.copy(recording, tmp_path / "a.part2.mcap")
    shutil.copy(recording, tmp_path / "another.mcap")
    before = {path: path.read_bytes() for path in tmp_path.glob("*.mcap")}
    replays = ["run", "--replay", recording, "--fmu", fmu]
    exports = ["export", recording, "--out", tmp_path / "a.csv"]
    for command in (replays, exports):
        for file in (tmp_path / name, tmp_path / "another.mcap"):
            assert "is never overwritten" in refused(*command, "--json", file)
    with pytest.raises(RecordingError, match="never overwritten"):
        Journal(tmp_path / "another.mcap")
    assert {path: path.read_bytes() for path in tmp_path.glob("*.mcap")} == before


def refused(*words: object) -> str:
    """Return the error of a command that must be refused."""
    with pytest.raises(RecordingError) as refusal:
        program([str(word) for word in words], standalone_mode=False)
    return str(refusal.value)


def test_a_path_that_cannot_be_written_is_refused_and_a_pipe_gets_the_document_alone(
    tmp_path: Path,
) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="cannot be written"):
        Journal(tmp_path / "file" / "r.json")
    journal = Journal(Path(os.devnull))
    journal.add(TURNS)
    journal.finish({})
    assert Path(os.devnull).is_char_device()
