"""An exported campaign holds what the FMU was given: the library finds the same estimates."""

import json
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from pyarrow import parquet

from tests.bench.campaigns import tiny_runs
from tests.bench.disks import little_room
from tirebench.cli import program
from tirebench.emulator.emulator import Player, record_tape
from tirebench.emulator.faults import Faults, parse_faults
from tirebench.errors import BenchError
from tirebench.links import BACK, LOST, Read
from tirebench.protocols import SERIAL, SLCAN
from tirebench.protocols.layouts import RAW16
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.transmitter import transmitter
from tirebench.recording.recording import Recorder, RecordingHeader
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device
from tirelib.campaign import check_campaign, read_campaign
from tirelib.core.version import __version__
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.result import estimate_document
from tirelib.measured.observations import observe


def write_recording(
    path: Path, campaign: Path, kind: str, line: str, faults: Faults, wheels: tuple[int, ...]
) -> Conditions:
    header = read_campaign(campaign).header
    tape = record_tape(tiny_runs(), Device(), faults, wheels, header)
    recording = RecordingHeader({}, protocol=ProtocolPlan(line, 1e4).as_header())
    with Recorder(path, recording, tape.conditions) as recorder:
        for piece in Player(transmitter(kind), line, faults).pieces(tape):
            recorder.read(Read(round(1e9 * (1 + piece.due[-1])), b"".join(piece.frames)))
            recorder.flush()
    return tape.conditions


@pytest.fixture(scope="module")
def serial(campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("serial") / "a.mcap"
    write_recording(path, campaign, "serial", SERIAL, Faults({}), (0,))
    return path


@pytest.fixture(scope="module")
def bus(campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bus") / "a.mcap"
    faults = Faults(parse_faults(["lost=0.002"]), 1)
    write_recording(path, campaign, RAW16, SLCAN, faults, (0, 1))
    return path


def invoke(*words: object) -> tuple[int, str]:
    outcome = CliRunner().invoke(program, [str(word) for word in words])
    if outcome.exception is not None and not isinstance(outcome.exception, SystemExit):
        assert isinstance(outcome.exception, BenchError)
        return 2, str(outcome.exception)
    return outcome.exit_code, outcome.output


def turns(campaign: Path, calibration: Calibration) -> list[dict[str, object]]:
    observations = observe([read_campaign(campaign)])
    estimates = calibration.estimate(observations.features)
    return list(estimate_document(observations, estimates, calibration)["turns"])


def test_the_library_finds_in_the_export_what_it_finds_in_the_campaign(
    campaign: Path, calibration: Calibration, serial: Path, tmp_path: Path
) -> None:
    code, said = invoke("export", serial, "--out", tmp_path / "out", "--json", tmp_path / "e.json")
    assert (code, said.split()[0]) == (0, "3")
    assert [p for p in check_campaign(tmp_path / "out") if p.severity == "error"] == []
    exported, original = turns(tmp_path / "out", calibration), turns(campaign, calibration)
    assert len(exported) == len(original) >= 15
    for mine, theirs in zip(exported, original, strict=True):
        for key, value in theirs.items():
            is_number = isinstance(value, float)
            expected = pytest.approx(value, rel=1e-9, abs=1e-12) if is_number else value
            assert mine[key] == expected, key
    assert json.loads((tmp_path / "e.json").read_text())["complete"]
    plans = read_campaign(tmp_path / "out").plans
    assert [(p.kind, p.load) for p in plans] == [
        (p.kind, p.load) for p in read_campaign(campaign).plans
    ]
    assert invoke("export", serial, "--out", tmp_path / "out")[1].endswith(
        "give another name to --out"
    )


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_table_has_every_sample_of_every_wheel(bus: Path, tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"a.{ending}"
    assert invoke("export", bus, "--out", out)[0] == 0
    table = pd.read_csv(out) if ending == "csv" else pd.read_parquet(out)
    if ending == "parquet":
        assert parquet.read_schema(out).metadata[b"tirelib"].decode() == __version__
    runs = tiny_runs()
    for wheel in (0, 1):
        for number, run in enumerate(runs):
            mine = table[(table.wheel == wheel) & (table.segment == number)]
            strain = np.asarray(run.strain)[2, : len(mine)] * 1e6
            sound = ~mine.lost.to_numpy()
            assert len(mine) > 0.98 * run.strain.shape[1]
            np.testing.assert_allclose(
                mine.strain_3_ustrain.to_numpy()[sound], strain[sound], atol=1e-6
            )
            assert set(mine.run) == {run.plan.run}
    assert 0 < table.lost.sum() < 0.05 * len(table)


@pytest.mark.parametrize("ending", ["blf", "asc", "log"])
def test_a_can_log_has_every_frame_of_the_bus(bus: Path, tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"a.{ending}"
    code, said = invoke("export", bus, "--out", out)
    assert code == 0
    with can.LogReader(out) as reader:
        seen = [m for m in reader if m.arbitration_id in (0x120, 0x121)]
    assert int(said.split()[0]) > len(seen) > 2000
    assert {len(m.data) for m in seen} == {64}


def test_a_serial_recording_is_no_can_log(serial: Path, tmp_path: Path) -> None:
    code, said = invoke("export", serial, "--out", tmp_path / "a.blf")
    assert code == 2
    assert "it was recorded from a serial line; a CAN log needs a recording of a CAN bus" in said
    assert not (tmp_path / "a.blf").exists()


@pytest.mark.parametrize("name", ["a.csv", "a.parquet", "a.mf4", "a.asc", "a.blf", "campaign"])
def test_an_export_that_a_full_disk_ends_leaves_nothing(
    request: pytest.FixtureRequest, tmp_path: Path, name: str
) -> None:
    recording = request.getfixturevalue("bus" if name in ("a.asc", "a.blf") else "serial")
    with little_room():
        code, said = invoke("export", recording, "--out", tmp_path / name)
    assert code == 2
    assert f"{name}: cannot be written (" in said
    assert list(tmp_path.iterdir()) == []
    assert invoke("export", recording, "--out", tmp_path / name)[0] == 0


def test_a_recording_that_breaks_off_is_exported_up_to_there(serial: Path, tmp_path: Path) -> None:
    data = serial.read_bytes()
    (tmp_path / "b.mcap").write_bytes(data[: len(data) * 2 // 3])
    code, said = invoke("export", tmp_path / "b.mcap", "--out", tmp_path / "b.parquet")
    assert code == 1
    assert "is incomplete" in said
    assert len(pd.read_parquet(tmp_path / "b.parquet")) > 5000


def test_an_export_that_holds_nothing_is_no_success(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap", RecordingHeader({}), Conditions.constant()) as recorder:
        recorder.read(Read(1, b"no frame"))
    code, said = invoke("export", tmp_path / "a.mcap", "--out", tmp_path / "a.csv")
    assert (code, said.partition(" in")[0]) == (1, "0 samples")


def test_a_recording_without_campaign_needs_one_like_it(
    campaign: Path, serial: Path, tmp_path: Path
) -> None:
    protocol = ProtocolPlan().as_header()
    with Recorder(
        tmp_path / "c.mcap",
        RecordingHeader({}, protocol=protocol),
        Conditions.constant(18.0, 2.3e5, 0.0),
    ) as recorder:
        for read in reads_of(serial):
            recorder.read(read)
    code, said = invoke("export", tmp_path / "c.mcap", "--out", tmp_path / "c")
    assert code == 2
    assert "with --like DIR" in said
    assert (
        invoke("export", tmp_path / "c.mcap", "--out", tmp_path / "c", "--like", campaign)[0] == 0
    )
    plans = read_campaign(tmp_path / "c").plans
    assert {plan.kind for plan in plans} == {"sweep"}


def reads_of(path: Path) -> Iterator[Read]:
    from tirebench.recording.recording import Recording

    recording = Recording(path)
    yield from recording.reads()
    recording.close()


def test_a_lost_port_is_recorded_and_replayed(serial: Path, tmp_path: Path) -> None:
    path = tmp_path / "d.mcap"
    with Recorder(path, RecordingHeader({}), Conditions.constant()) as recorder:
        for read in (Read(1, b"abc"), Read(2, b"", LOST), Read(3, b"", BACK), Read(4, b"d")):
            recorder.read(read)
        recorder.event({"event": "marker", "text": "here"})
    assert [(r.data, r.event) for r in reads_of(path)] == [
        (b"abc", ""),
        (b"", LOST),
        (b"", BACK),
        (b"d", ""),
    ]
