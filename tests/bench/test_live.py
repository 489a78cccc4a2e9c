"""End to end without hardware: emulator, pseudo-terminal, FMU file, recording, replay."""

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from tests.bench.conftest import Spawn
from tests.bench.programs import A_TURN, Line, port_of, wait_until
from tirebench.cli import program
from tirebench.errors import BenchError
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.trust import remember
from tirebench.protocols.decoder import SerialDecoder
from tirebench.recording.recording import Recording
from tirelib.campaign import read_campaign
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import write_calibration
from tirelib.estimators.result import estimate_document
from tirelib.fmu.build import build_fmu
from tirelib.measured.observations import observe

SECOND = 112_500
"""Bytes of a second of one wheel."""


@pytest.fixture(scope="module")
def fmus(calibration: Calibration, tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    write_calibration(calibration, folder / "cal.toml")
    built = {
        k: build_fmu(folder / "cal.toml", folder / f"StrainTire{k}.fmu", samples_per_step=k)
        for k in (1, 10, 16)
    }
    for fmu in built.values():
        remember(read_fmu(fmu))
    return built


def result(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text()))


def recorded(path: Path) -> tuple[bytes, bool | None]:
    recording = Recording(path)
    data = b"".join(data for _, data in recording.raw())
    recording.close()
    return data, recording.complete


def frame_numbers(path: Path) -> np.ndarray:
    """Return the number of every good frame of a recording, unwrapped."""
    batches = SerialDecoder().push(recorded(path)[0])
    return np.unwrap(np.concatenate([batch.seq for batch in batches]).astype(float), period=2**16)


def replay(recording: Path, fmu: Path, out: Path) -> None:
    arguments = ("run", "--replay", recording, "--fmu", fmu, "--json", out, "--no-page")
    outcome = CliRunner().invoke(program, [str(argument) for argument in arguments])
    assert outcome.exception is None or isinstance(outcome.exception, SystemExit)


def compare(bench: dict[str, Any], library: dict[str, Any]) -> None:
    assert len(bench["turns"]) == len(library["turns"])
    for mine, theirs in zip(bench["turns"], library["turns"], strict=True):
        for key, value in theirs.items():
            if isinstance(value, float):
                assert mine[key] == pytest.approx(value, rel=1e-9, abs=1e-12), key
            else:
                assert mine[key] == value, key


def test_library_live_and_replay_give_the_same_estimates(
    spawn: Spawn, campaign: Path, calibration: Calibration, fmus: dict[int, Path], tmp_path: Path
) -> None:
    line = Line(
        spawn,
        tmp_path,
        "--campaign",
        campaign,
        "--all",
        "--speedup",
        2,
        "--conditions",
        tmp_path / "c.json",
        "--json",
        tmp_path / "e.json",
    )
    live = spawn(
        "run",
        "--port",
        line.port,
        "--fmu",
        fmus[16],
        "--conditions",
        tmp_path / "c.json",
        "--record",
        tmp_path / "a.mcap",
        "--json",
        tmp_path / "live.json",
        "--every-turn",
        "--no-page",
    )
    code, out, _ = line.heard_by(live)
    assert code == 0
    observations = observe([read_campaign(campaign)])
    library = estimate_document(
        observations, calibration.estimate(observations.features), calibration
    )
    bench = result(tmp_path / "live.json")
    assert sum(turn["valid"] for turn in bench["turns"]) >= 12
    compare(bench, library)
    for name, entry in library["summary"].items():
        for key, value in entry.items():
            expected = pytest.approx(value, rel=1e-6) if isinstance(value, float) else value
            assert bench["summary"][name][key] == expected, (name, key)
    assert bench["line"]["frames"] == result(tmp_path / "e.json")["frames"]
    assert bench["line"]["lost_samples"] == bench["line"]["crc_bad"] == 0
    assert bench["source"]["fmu_sha256"] in out
    assert "first_turn" in out
    for k, fmu in fmus.items():
        replay(tmp_path / "a.mcap", fmu, tmp_path / f"r{k}.json")
    again = result(tmp_path / "r16.json")
    assert (again["turns"], again["line"]) == (bench["turns"], bench["line"])
    compare(result(tmp_path / "r1.json"), library)
    compare(result(tmp_path / "r10.json"), library)


def test_every_fault_is_counted_and_none_passes_for_a_number(
    spawn: Spawn, campaign: Path, fmus: dict[int, Path], tmp_path: Path
) -> None:
    sender = Line(
        spawn,
        tmp_path,
        "--campaign",
        campaign,
        "--run",
        2,
        "--json",
        tmp_path / "e.json",
        "--seed",
        3,
        "--fault",
        "flips=0.03",
        "--fault",
        "lost=0.03",
        "--fault",
        "dup=0.05",
        "--fault",
        "saturate=5",
    )
    live = spawn(
        "run",
        "--port",
        sender.port,
        "--fmu",
        fmus[16],
        "--speed",
        64.8,
        "--pressure",
        2.3,
        "--camber",
        0,
        "--record",
        tmp_path / "a.mcap",
        "--json",
        tmp_path / "live.json",
        "--every-turn",
        "--no-page",
    )
    sender.heard_by(live)
    sent, seen = result(tmp_path / "e.json"), result(tmp_path / "live.json")
    done, line = sent["faults"], seen["line"]
    assert line["duplicates"] == done["dup"] > 5
    assert done["flips"] <= line["crc_bad"] + line["framing_bad"] <= 2 * done["flips"]
    unheard = sent["frames"] - line["frames"] + done["dup"]
    assert done["lost"] + done["flips"] <= unheard <= done["lost"] + 2 * done["flips"]
    numbers = frame_numbers(tmp_path / "a.mcap")
    # what follows the last frame that was read before the run was stopped is not missed
    assert line["lost_frames"] == np.ptp(numbers) + 1 - np.unique(numbers).size <= unheard
    assert line["saturated_samples"][4] > 0
    assert seen["summary"]["Fz"]["rmse"] is None
    assert {turn["run"] for turn in seen["turns"]} == {0}
    for turn in seen["turns"]:
        assert not turn["valid"] or "reduced_gages" in turn["flags"]
    replay(tmp_path / "a.mcap", fmus[16], tmp_path / "r.json")
    assert result(tmp_path / "r.json")["turns"] == seen["turns"]


def test_an_unplugged_cable_is_told_and_the_recording_kept(
    spawn: Spawn, campaign: Path, toy_fmus: dict[int, Path], tmp_path: Path
) -> None:
    emulator = spawn(
        "emulate", "--campaign", campaign, "--all", "--loop", "--port-file", tmp_path / "port"
    )
    port = port_of(tmp_path / "port", emulator)
    live = spawn(
        "run",
        "--port",
        port,
        "--fmu",
        toy_fmus[16],
        "--speed",
        65,
        "--record",
        tmp_path / "a.mcap",
        "--json",
        tmp_path / "live.json",
        "--reconnect",
        0,
        "--no-page",
    )
    live.says(A_TURN)
    emulator.terminate()  # it pulls the cable
    code, out, _ = live.finish()
    assert code == 1
    assert f"unplugged: {port}: the port was lost" in out
    assert emulator.finish()[0] == 0
    data, complete = recorded(tmp_path / "a.mcap")
    assert complete
    line = result(tmp_path / "live.json")["line"]
    assert len(data) == line["bytes"] > 1000


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_stopped_or_killed_run_leaves_a_recording_that_replays(
    spawn: Spawn, campaign: Path, toy_fmus: dict[int, Path], tmp_path: Path, number: signal.Signals
) -> None:
    spawn("emulate", "--campaign", campaign, "--all", "--loop", "--port-file", tmp_path / "port")
    port = port_of(tmp_path / "port")
    record = tmp_path / "a.mcap"
    live = spawn("run", "--port", port, "--fmu", toy_fmus[16], "--speed", 65, "--record", record)
    live.says(A_TURN)
    wait_until(lambda: record.stat().st_size > 2 * SECOND)
    live.send_signal(number)
    code, out, _ = live.finish()
    wait_until(lambda: recorded(record)[1])  # a recorder that is left alone comes to an end
    assert len(recorded(record)[0]) > 0.8 * SECOND
    assert code == (-signal.SIGKILL if number == signal.SIGKILL else 0)
    assert ("ended: stopped" in out) == (number == signal.SIGINT)
    if number == signal.SIGKILL:  # then, what was left is removed
        wait_until(lambda: "leaked" in live.err.read_text())
    else:
        assert "leaked" not in live.err.read_text()
    replay(record, toy_fmus[16], tmp_path / "r.json")
    assert result(tmp_path / "r.json")["turns"]


def test_bad_input_ends_with_code_2_and_a_message(
    spawn: Spawn, campaign: Path, toy_fmus: dict[int, Path], tmp_path: Path
) -> None:
    (tmp_path / "d.toml").write_text('format = "tirebench-device/1"\n')
    (tmp_path / "x.fmu").write_bytes(b"no zip")
    fmu = toy_fmus[16]
    cases = {
        "give exactly one of --port, --setup, --port-file and --replay": ("run", "--fmu", fmu),
        "the port cannot be opened": ("run", "--port", tmp_path / "none", "--fmu", fmu),
        "not an FMU": ("run", "--port", "p", "--fmu", tmp_path / "x.fmu"),
        "exactly one of [scale] and [bridge]": (
            "run",
            "--port",
            "p",
            "--fmu",
            fmu,
            "--device",
            tmp_path / "d.toml",
        ),
        "cannot be read": ("run", "--replay", tmp_path / "none.mcap", "--fmu", fmu),
        "run 9; its runs are 1, 2, 3": ("emulate", "--campaign", campaign, "--run", 9),
        "unknown fault 'rust'": ("emulate", "--campaign", campaign, "--fault", "rust"),
        "no such command 'rnu'; the commands are ports, load, emulate, run": ("rnu",),
        "did you mean 'replay'?": ("repaly",),
        "no program opened the port in time": ("emulate", "--campaign", campaign, "--wait", 0.1),
    }
    for message, arguments in cases.items():
        outcome = CliRunner().invoke(program, [str(argument) for argument in arguments])
        said = str(outcome.exception) + outcome.output
        assert message in said
        assert isinstance(outcome.exception, BenchError | SystemExit), message
    record = tmp_path / "free.mcap"
    words = ("run", "--port", "p", "--fmu", fmu, "--record", record, "--no-page")
    code, _, err = spawn(*words).finish()
    assert code == 2
    assert err.startswith("Error: p: the port cannot be opened")
    assert not record.exists()  # a run that did not begin leaves the name of its recording free
    record.touch()
    outcome = CliRunner().invoke(program, [str(word) for word in words])
    assert "is never overwritten" in str(outcome.exception)
    assert record.exists()


def test_ports_lists_what_there_is(spawn: Spawn, tmp_path: Path) -> None:
    code, out, _ = spawn("ports", "--json", tmp_path / "p.json").finish()
    found = result(tmp_path / "p.json")["ports"]
    assert code == (0 if found else 1)
    assert all(port["device"] in out for port in found)
