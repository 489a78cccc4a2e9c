"""The bench's demonstration, short: what went over the line comes back as it was."""

import json
import re
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from pages.agreement import agreement, read_turns
from rich.console import Console

import tirebench.cli
import tirelib.cli
from tests.bench.programs import PATIENCE, wait_until
from tests.synthetic import cornering_runs, synthetic_run, write
from tirebench.deadline import Deadline
from tirebench.emulator.faults import Faults
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.trust import remember
from tirebench.estimator.wheels import Wheels
from tirebench.links import Read
from tirebench.protocols.plan import ProtocolPlan
from tirebench.wire.device import Device
from tirelib.campaign import Run, check_campaign, read_campaign
from tirelib.rig.measure import MeasuringChain


@pytest.fixture(scope="module")
def demo_module(build_programs: None) -> Any:
    import bench_demo

    return bench_demo


def as_the_rig_measures(run: Run) -> Run:
    """Round strain to the rig's step, which the line carries whole."""
    step = 2.0 * MeasuringChain().gage_range / 2 ** MeasuringChain().gage_bits
    return replace(run, strain=np.rint(np.asarray(run.strain) / step) * step)


def steps_here(demo: Any) -> Any:
    """Run what is no part of the live chain in this process, which saves its start."""

    class Here(demo.Steps):
        def run(self, what: str, *words: object, program: str = "tirelib") -> None:
            self.commands.append((what, program))
            text = [str(word) for word in words]
            if program == "python":
                demo.main(text[1:])
                return
            group = {"tirelib": tirelib.cli.program, "tirebench": tirebench.cli.program}[program]
            outcome = CliRunner().invoke(group, text)
            assert outcome.exit_code == 0, (what, outcome.output, outcome.exception)
            if "build" in text:
                remember(read_fmu(Path(text[text.index("--out") + 1])))

    return Here(Console(file=sys.stderr))


@pytest.fixture(scope="module")
def out(demo_module: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    data = tmp_path_factory.mktemp("days")
    write(data / "calibrated", map(as_the_rig_measures, cornering_runs()[::2]))
    loads = [3000.0, 4500.0, 6000.0, 3000.0, 4500.0, 6000.0]
    kinds = ["free"] * 6
    straight = [
        synthetic_run(n, load=load, turns=5.2, kind=kind, seed=5)
        for n, (load, kind) in enumerate(zip(loads, kinds, strict=True))
    ]
    side = synthetic_run(len(loads), load=4500.0, slip_angle=0.03, turns=5.2, seed=5)
    write(data / "played", map(as_the_rig_measures, [*straight, side]))
    out = tmp_path_factory.mktemp("demo")
    words = ["--data", str(data), "--out", str(out), "--model", "table-6-1", "--pace", "8"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bench_page.Look._look", late_and_long(out))
        demo_module.main(words, steps_here(demo_module))
    return out


def late_and_long(folder: Path) -> Any:
    """Return somebody who opens the page late, and looks when the day is long over."""
    import bench_page

    def look(self: Any, url: str, turns: float, say: Any, begin: Any) -> Any:
        sent = folder / "emulate.log"
        bench_page.fetch(url)
        assert "played" not in sent.read_text()
        assert "frames in" not in sent.read_text()
        begin()
        wait_until(lambda: "played" in sent.read_text())
        return bench_page.Seen("", bench_page.fetch(url))

    return look


def document(path: Path) -> Any:
    return json.loads(path.read_text())


def test_the_replay_is_the_live_run_to_the_last_bit(out: Path) -> None:
    live, replay = document(out / "live.json"), document(out / "replay.json")
    assert len(live["turns"]) >= 7 * 4
    assert replay["turns"] == live["turns"]
    assert replay["line"] == live["line"]
    assert [live["line"][name] for name in ("lost_frames", "crc_bad", "framing_bad")] == [0, 0, 0]


def test_the_library_finds_in_the_exported_campaign_what_the_bench_said_live(out: Path) -> None:
    found = agreement(
        "live - library", read_turns(out / "live.json"), read_turns(out / "library.json"), 1e-9
    )
    assert found.faults == []
    assert all(row.turns >= 7 * 3 for row in found.rows if row.title == "vertical load Fz")
    by_fmu = agreement(
        "library - FMU", read_turns(out / "library.json"), read_turns(out / "fmu.json"), 1e-9
    )
    assert by_fmu.faults == []


def test_the_campaign_is_sound_and_was_held_against_the_model(out: Path) -> None:
    assert [p for p in check_campaign(out / "exported") if p.severity == "error"] == []
    plans = read_campaign(out / "exported").plans
    assert [plan.kind for plan in plans] == ["free"] * 6 + ["corner"]
    compared = document(out / "compared/comparison.json")
    assert (compared["quantity"], compared["repeats"]) == ("strain", 3)
    assert {run["run"] for run in compared["runs"]} == {plan.run for plan in plans}
    assert (out / "compared/index.html").stat().st_size > 100_000


def test_everything_that_was_promised_is_there_and_on_the_page(out: Path) -> None:
    assert [file.name for file in out.glob("*.mcap")] == ["live.mcap"]
    page = (out / "index.html").read_text()
    assert "Library = FMU = bench" in page
    assert "NOT EQUAL" not in page
    assert "live page fetched: 200" in page  # by somebody who came late and stayed long
    for what in ("Replay the recording", "Export it as a campaign", "Where does the model fail?"):
        assert what in page
    for file in re.findall(r'href="(compared/[^"]+|figures/[^"]+)"', page):
        assert (out / file).exists(), file


def test_a_number_that_differs_ends_the_demonstration(
    demo_module: Any, out: Path, tmp_path: Path
) -> None:
    from pages.live import LiveFiles

    changed = document(out / "replay.json")
    next(turn for turn in changed["turns"] if turn["valid"])["Fz"] += 1e-9
    (tmp_path / "replay.json").write_text(json.dumps(changed))
    names = (
        "library.json",
        "fmu.json",
        "live.json",
        "replay.json",
        "conditions.json",
        "device.toml",
    )
    files = [tmp_path / n if n == "replay.json" else out / n for n in names]
    with pytest.raises(SystemExit):
        demo_module.judge(Console(file=sys.stderr), LiveFiles(*files), out / "exported")
    files[3] = out / "replay.json"
    demo_module.judge(Console(file=sys.stderr), LiveFiles(*files), out / "exported")


def test_a_repeated_turn_has_no_edge(demo_module: Any) -> None:
    """The soak rolls one turn on for a day: a step where it is joined would be in every turn."""
    import bench_soak

    run = as_the_rig_measures(synthetic_run(1, load=4800.0, turns=6.0))
    counts, speed = bench_soak.one_turn(run)
    steps = np.abs(np.diff(counts.astype(int), axis=0))
    joint = np.abs(counts[0].astype(int) - counts[-1])
    assert counts.shape == (16 * bench_soak.TURN_FRAMES, 5)
    assert (joint <= np.percentile(steps, 90, axis=0)).all()
    assert abs(np.argmax(counts[:, 2]) / len(counts) - 0.5) < 0.1  # the contact is in the middle
    # as many turns a second as before, but for the stretch
    stretch = len(counts) / (2.0 * np.pi / run.mean("omega") * run.rate)
    assert speed == pytest.approx(run.mean("speed") / stretch)


class Nowhere:
    """Takes no note of a read."""

    def write(self, read: Read, moment: float) -> None:
        pass


def test_what_a_soak_has_struck_is_never_ahead_of_what_it_has_sent(demo_module: Any) -> None:
    """At any read a doubled frame has been counted; in the end every other fault has."""
    import bench_soak

    faults = Faults(dict.fromkeys(bench_soak.RATES, 0.02), seed=1)
    counts = np.zeros((16 * bench_soak.TURN_FRAMES, 5), np.int16)
    wire = bench_soak.Wire(counts, faults, 0.002, Nowhere())
    wheels = Wheels.of_one(ProtocolPlan().decoder(), {None: Device()})
    struck = []
    while (read := wire.receive(Deadline.never())) is not None:
        wheels.push(read.data, read.arrival)
        assert wheels.counts[1].duplicates == faults.done["dup"]
        struck.append(sum(faults.done.values()))
    line, wheel = wheels.counts
    assert min(faults.done.values()) > 50
    assert line.bad >= faults.done["flips"]
    assert wheel.lost_frames >= faults.done["lost"] + faults.done["flips"]
    assert struck[-1] == struck[-20]  # the end is quiet, so that nothing is on its way


def sample(hours: float, **changes: Any) -> Any:
    import bench_soak

    line = {
        "crc_bad": 2,
        "framing_bad": 1,
        "lost_frames": 6,
        "duplicates": 4,
        "resets": 0,
        "out_of_order": 0,
        "unknown_type": 0,
    }
    known = {
        "hours": hours,
        "cpu_s": 1.0,
        "wall_s": 1.0,
        "rss_bytes": 2**28,
        "turns": 9,
        "clean_turns": 8,
        "drift_ppm": bench_soak.FAST + 0.1,
        "residual_us": 1.0,
        "Fz_N": 4800.0,
        "Fz_spread_N": 0.0,
        "line": line,
        "done": {"flips": 3, "lost": 3, "dup": 4},
    }
    line.update({key: value for key, value in changes.items() if key in line})
    known.update({key: value for key, value in changes.items() if key in known})
    return bench_soak.Sample(**known)


@pytest.mark.parametrize(
    ("what", "changes"),
    [
        ("memory", {"rss_bytes": 2**28 + 2**24}),
        ("damaged", {"crc_bad": 7}),
        ("lost", {"lost_frames": 5}),
        ("lost", {"lost_frames": 10}),
        ("doubled", {"duplicates": 5}),
        ("no restart", {"resets": 1}),
        ("clock", {"drift_ppm": 52.0}),
        ("estimates", {"Fz_N": 4800.001}),
    ],
)
def test_a_soak_tells_each_drift(demo_module: Any, what: str, changes: dict[str, Any]) -> None:
    import bench_soak

    steady = [sample(1.0), sample(2.0)]
    assert all(bench_soak.judge(steady).values())
    drifted = bench_soak.judge([*steady, sample(3.0, **changes)])
    assert [name for name, good in drifted.items() if not good] == [what]


@pytest.mark.skipif(
    not Path("/proc/self/stat").exists(),
    reason="the meter reads /proc, which only Linux has; nothing but `make endurance` needs it",
)
def test_a_meter_counts_the_processes_of_a_run_and_those_that_ended(demo_module: Any) -> None:
    import bench_processes

    work = "import time\nwhile time.process_time() < 0.2: pass\n"
    parent = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
    run = subprocess.Popen(
        [sys.executable, "-c", f"{parent}; input()", work], stdin=subprocess.PIPE
    )
    meter = bench_processes.Meter(run.pid)
    end = time.monotonic() + PATIENCE
    most = 0
    while time.monotonic() < end and (most < 2 or len(bench_processes.children(run.pid)) > 1):
        meter.look()
        most = max(most, len(bench_processes.children(run.pid)))
        time.sleep(0.01)
    assert most == 2
    assert meter.cpu > 0.15
    assert max(meter.memory) > 2**20
    with suppress(OSError):
        run.communicate(b"\n")
