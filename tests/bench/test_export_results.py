"""An export holds what a bus told, the estimates of the run, events and markers."""

import json
import math
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from asammdf import MDF
from click.testing import CliRunner

from tests.bench.test_bridges import TURN
from tests.bench.test_user_map import DBC, MAP, frames_of, physical
from tirebench.cli import program
from tirebench.links import Read
from tirebench.protocols import CAN
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_map import parse_map
from tirebench.recording.document import turn_document
from tirebench.recording.export_results import write_mdf
from tirebench.recording.header import RecordingHeader
from tirebench.recording.recorder import Recorder, alarm_event
from tirebench.recording.recording import Recording
from tirebench.recording.segments import Segment
from tirebench.wire.can_batch import joined, pack, same_kind
from tirebench.wire.conditions import Conditions
from tirebench.wire.timeline import Samples
from tirelib.campaign import check_campaign, read_campaign
from tirelib.core.version import __version__

TURNS = [replace(TURN, ready=0.02 * n, texts={"note": "restarted"} if n else {}) for n in range(3)]
SPEEDS = [math.nan] * 10 + [36.0] * 51 + [72.0] * 39
"""What the bus told, of each sample [km/h]."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a wheel whose bus tells its speed twice, turns and a marker."""
    path = tmp_path_factory.mktemp("results") / "a.mcap"
    strain = same_kind(529, frames_of(physical(100)), fd=True)
    speed = np.zeros((2, 8), np.uint8)
    speed[:, :2] = np.array([3600, 7200], "<u2").view(np.uint8).reshape(2, 2)
    told = same_kind(700, speed, fd=True)
    rows = np.arange(100)
    batch = joined(
        [
            strain.take(rows[:10]),
            told.take(rows[:1]),
            strain.take(rows[10:61]),
            told.take(rows[1:2]),
            strain.take(rows[61:]),
        ]
    )
    protocol = ProtocolPlan(CAN, 1e3, parse_map(MAP, DBC, "m.toml")).as_header()
    header = RecordingHeader({}, protocol=protocol)
    start = header.monotonic_ns
    with Recorder(path, header, Conditions.constant(pressure=2.3e5, camber=0.0)) as recorder:
        for part in np.array_split(np.arange(102), 7):
            recorder.read(Read(start + 10**6 * int(part[-1]), pack(batch.take(part))))
        for number, turn in enumerate(TURNS):
            arrival = start + 10**7 * (number + 1)
            recorder.estimate(2, arrival, json.dumps(turn_document(turn)).encode())
        recorder.event({"event": "marker", "text": "wet, 50 %"}, start + 10**9)
        for seconds, on in ((2, True), (3, False)):
            recorder.event(alarm_event("Fz", "too high", on=on), start + seconds * 10**9)
    return path


def export(recording: Path, out: Path, *more: object) -> str:
    words = ["export", str(recording), "--out", str(out), *map(str, more)]
    outcome = CliRunner().invoke(program, words, catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def check_tables(estimates: pd.DataFrame, events: pd.DataFrame) -> None:
    assert list(estimates.wheel) == [2, 2, 2]
    np.testing.assert_allclose(estimates.t_s, [0.01, 0.02, 0.03], atol=1e-9)
    np.testing.assert_allclose(estimates.Fz_N, 4321.5)
    np.testing.assert_allclose(estimates.alpha_std_deg, 0.05)
    assert list(estimates.kappa_valid) == [False] * 3
    assert "restarted" in estimates["flags"][1]
    assert [tuple(row) for row in events[["t_s", "event", "text"]].values] == [
        (1.0, "marker", "wet, 50 %"),
        (2.0, "alarm begins", "too high"),
        (3.0, "alarm ends", "too high"),
    ]


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_table_has_the_speed_of_the_bus_and_estimates_and_markers_beside_it(
    recording: Path, tmp_path: Path, ending: str
) -> None:
    said = export(recording, tmp_path / f"a{ending}")
    read = pd.read_csv if ending == ".csv" else pd.read_parquet
    table = read(tmp_path / f"a{ending}")
    np.testing.assert_allclose(table.speed_kmh, SPEEDS)
    np.testing.assert_allclose(table.pressure_bar, 2.3)
    check_tables(*(read(tmp_path / f"a.{name}{ending}") for name in ("estimates", "events")))
    assert said.count("also written") == 2


def test_a_campaign_has_the_speed_of_the_bus_and_estimates_and_markers_beside_it(
    recording: Path, campaign: Path, tmp_path: Path
) -> None:
    said = export(recording, tmp_path / "out", "--like", campaign)
    assert "note: the first 10 samples are left out: the bus had not yet sent" in said
    (run,) = read_campaign(tmp_path / "out").runs()
    assert run.rig_time is not None
    times = run.start_time + np.arange(90) / run.rate
    held = np.searchsorted(run.rig_time, times + 1e-6, side="right") - 1
    np.testing.assert_allclose(3.6 * run.rig["speed"][held], SPEEDS[10:])
    tables = [pd.read_csv(tmp_path / "out" / f"{name}.csv") for name in ("estimates", "events")]
    check_tables(*tables)
    assert not [p for p in check_campaign(tmp_path / "out") if "speed" in p.where]


def test_one_mdf4_file_has_all_of_it(recording: Path, tmp_path: Path) -> None:
    export(recording, tmp_path / "a.mf4")
    with MDF(tmp_path / "a.mf4") as mdf:
        strain, speed = mdf.get("wheel_2_strain_3"), mdf.get("wheel_2_speed")
        load, note = mdf.get("wheel_2_Fz_N"), mdf.get("wheel_2_flags")
        event, text = mdf.get("event"), mdf.get("text")
        assert mdf.header.description == f"written by tirelib {__version__}"
    assert (strain.unit, speed.unit, load.unit) == ("ustrain", "km/h", "N")
    np.testing.assert_allclose(strain.samples, physical(100)[:, 2])
    np.testing.assert_allclose(speed.samples, [math.nan, 36.0, 72.0])
    np.testing.assert_allclose(speed.timestamps - strain.timestamps[0], [0.0, 0.01, 0.061])
    np.testing.assert_allclose(load.samples, [turn.outputs["Fz"] for turn in TURNS])
    assert b"restarted" in note.samples[1]
    assert (event.samples[0], text.samples[0]) == (b"marker", b"wet, 50 %")
    assert text.timestamps[0] == pytest.approx(1.0)


def segment(number: int, t_us: int, value: float) -> Segment:
    rows = np.full((3, 5), value)
    none = np.zeros(3, np.bool_)
    block = Samples(number, "", 0, t_us, 0.001, rows, none, np.zeros((3, 5), np.bool_))
    return Segment(2, number, 0, t_us, 0.001, [block])


def test_segments_of_a_wheel_are_one_group_with_a_gap(recording: Path, tmp_path: Path) -> None:
    found = [segment(1, 0, 1e-6), segment(2, 10_000, 2e-6), segment(3, 0, 3e-6)]
    assert write_mdf(recording, found, Conditions.constant(18.0), tmp_path / "b.mf4") == 9
    with closing(Recording(recording)) as opened:
        header = opened.header
    with MDF(tmp_path / "b.mf4") as mdf:
        strain, number = mdf.get("wheel_2_strain_1"), mdf.get("wheel_2_strain_segment")
        again = mdf.get("wheel_2_restart_1_strain_1")
        begun = mdf.start_time.timestamp()
        assert "wheel_2_strain_5" in mdf.to_dataframe(time_from_zero=False)
    np.testing.assert_allclose(strain.samples, [1, 1, 1, np.nan, 2, 2, 2])
    np.testing.assert_allclose(strain.timestamps, [0, 0.001, 0.002, 0.003, 0.01, 0.011, 0.012])
    assert number.samples.tolist() == [1, 1, 1, 1, 2, 2, 2]
    np.testing.assert_allclose(again.samples, 3.0)
    assert begun == pytest.approx(1e-9 * header.wall_ns, abs=1e-3)
