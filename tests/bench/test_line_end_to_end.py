"""Programs as a user starts them: slcan behind a port, several wheels, a cable in and out."""

import json
import signal
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from tests.bench.conftest import Spawn
from tests.bench.programs import PATIENCE, Line, wait_until
from tirebench.cli import program
from tirebench.links import BACK
from tirebench.recording.recording import Recording


def result(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text()))


def test_two_wheels_over_slcan_are_estimated_recorded_replayed_and_exported(
    spawn: Spawn, campaign: Path, toy_fmus: dict[int, Path], tmp_path: Path
) -> None:
    sender = Line(
        spawn,
        tmp_path,
        "--campaign",
        campaign,
        "--run",
        2,
        "--format",
        "RAW16",
        "--wheel",
        0,
        "--wheel",
        2,
        "--conditions",
        tmp_path / "c.json",
        "--json",
        tmp_path / "e.json",
    )
    live = spawn(
        "run",
        "--port",
        f"slcan:{sender.port}",
        "--data-bitrate",
        5_000_000,
        "--fmu",
        toy_fmus[16],
        "--conditions",
        tmp_path / "c.json",
        "--record",
        tmp_path / "a.mcap",
        "--json",
        tmp_path / "live.json",
        "--every-turn",
        "--no-page",
    )
    code, out, _ = sender.heard_by(live)
    assert code == 0, out
    seen = result(tmp_path / "live.json")
    assert {turn["wheel"] for turn in seen["turns"]} == {0, 2}
    one, two = ([t["Fz"] for t in seen["turns"] if t["wheel"] == n] for n in (0, 2))
    assert one == two
    assert len(one) >= 5
    line = seen["line"]
    assert line["frames"] == result(tmp_path / "e.json")["frames"]
    assert line["lost_samples"] == line["framing_bad"] == line["unknown_type"] == 0
    words = (
        "replay",
        tmp_path / "a.mcap",
        "--fmu",
        toy_fmus[16],
        "--pace",
        20,
        "--json",
        tmp_path / "again.json",
    )
    outcome = CliRunner().invoke(program, [str(word) for word in words])
    assert outcome.exit_code == 0, outcome.output
    again = result(tmp_path / "again.json")
    assert (again["turns"], again["wheels"]) == (seen["turns"], seen["wheels"])


def events(path: Path) -> list[str]:
    recording = Recording(path)
    found = [read.event for read in recording.reads() if read.event]
    recording.close()
    return found


def test_a_cable_in_and_out_loses_what_was_sent_meanwhile_and_no_more(
    spawn: Spawn, campaign: Path, tmp_path: Path
) -> None:
    emulator = spawn(
        "emulate",
        "--campaign",
        campaign,
        "--all",
        "--loop",
        "--link",
        tmp_path / "port",
        "--unplug",
        0.7,
        "--replug",
        0.3,
        "--json",
        tmp_path / "e.json",
    )
    wait_until((tmp_path / "port").is_symlink)
    live = spawn(
        "record",
        "--port",
        tmp_path / "port",
        "--out",
        tmp_path / "a.mcap",
        "--reconnect",
        PATIENCE,
        "--json",
        tmp_path / "r.json",
    )
    live.says("->")
    wait_until(lambda: events(tmp_path / "a.mcap").count(BACK) >= 2)
    live.send_signal(signal.SIGINT)
    code, out, _ = live.finish()
    assert code == 0, out
    emulator.terminate()
    emulator.finish()
    seen = result(tmp_path / "r.json")
    assert seen["line"]["reconnects"] >= 2
    assert seen["line"]["gaps"] + seen["line"]["resets"] >= seen["line"]["reconnects"]
    assert seen["line"]["crc_bad"] + seen["line"]["framing_bad"] <= 2 * seen["line"]["reconnects"]
    assert seen["line"]["frames"] > 100
