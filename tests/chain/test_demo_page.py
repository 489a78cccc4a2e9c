"""The demonstration from ready campaigns: every step runs, and the page holds what they give."""

import importlib.util
import io
import json
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from tests.chain.test_command_line import run
from tests.synthetic import cornering_runs, synthetic_run, write

ROOT = Path(__file__).parents[2]
LOADS = (1500.0, 4500.0, 7500.0)


def demo(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, ROOT / "build/demo.py", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaigns")
    for name, seed in (("set1", 0), ("set1-unseen", 3)):
        runs = [run for run in cornering_runs(seed=seed) if run.plan.load in LOADS]
        write(folder / name, runs, name=name)
    slips = (-0.3, -0.05, 0.0, 0.05, 0.3)
    kinds = ("brake", "brake", "free", "drive", "drive")
    braking = [
        synthetic_run(i, load=4500.0, slip_ratio=k, kind=kind)
        for i, (k, kind) in enumerate(zip(slips, kinds, strict=True))
    ]
    write(folder / "brake_drive", braking, name="brake_drive")
    return folder


@pytest.fixture(scope="module")
def made(
    campaigns: Path, tmp_path_factory: pytest.TempPathFactory, rough_figures: None
) -> tuple[Path, str]:
    out, module, said = tmp_path_factory.mktemp("demo"), demo_module(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(said):
        patch.setattr(sys, "argv", ["demo.py", "--data", str(campaigns), "--out", str(out)])
        patch.setattr(module.Steps, "together", one_by_one)
        patch.setattr(subprocess, "run", in_this_process)
        try:
            module.main()
        except SystemExit as end:
            raise AssertionError(said.getvalue()) from end
    return out, said.getvalue()


def one_by_one(steps: Any, jobs: Sequence[Any]) -> None:
    """Run commands that do not need each other as those that do."""
    for job in jobs:
        steps.run(job.what, *job.words, program=job.program)


IN_ITS_OWN = subprocess.run


def in_this_process(
    command: Sequence[str], *, cwd: Path, env: Mapping[str, str], check: bool
) -> "subprocess.CompletedProcess[Any]":
    """Run `tirelib` without a process of its own, whose imports take seconds.

    The figures of its reports, which tests/unit/report looks at, are not drawn again.
    """
    if Path(command[0]).name != "tirelib":
        return IN_ITS_OWN(command, cwd=cwd, env=env, check=check)
    with pytest.MonkeyPatch.context() as patch:
        for page in ("calibration", "estimate"):
            patch.setattr(f"tirelib.report.{page}.draw_all", lambda folder, drawings: [])
        done = run(*command[1:])
    sys.stdout.write(done.stdout + done.stderr)
    return done


def test_the_demonstration_ends_by_naming_files_that_exist(made: tuple[Path, str]) -> None:
    out, text = made
    files = re.findall(r"^open\s+(\S+)", text, flags=re.MULTILINE)
    assert len(files) == 3
    assert all((ROOT / file).is_file() for file in files)
    assert Path(files[0]) == out / "index.html"


def test_the_page_tells_the_accuracy_that_estimate_tells(made: tuple[Path, str]) -> None:
    out, _ = made
    summary = json.loads((out / "set1-unseen.json").read_text())["summary"]
    page = (out / "index.html").read_text()
    found = re.search(r"vertical load Fz</td><td class=\"word\">N</td><td>([\d.]+)</td>", page)
    assert found
    assert float(found[1]) == pytest.approx(summary["Fz"]["rmse"], rel=1e-3)  # four digits


def test_the_page_shows_the_commands_and_every_image(made: tuple[Path, str]) -> None:
    out, _ = made
    page = (out / "index.html").read_text()
    for verb in ("campaign check", "features", "calibrate", "estimate", "fmu build", "fmu run"):
        assert f"tirelib {verb} " in page
    for verb in ("emulate --campaign", "run --port", "run --replay"):
        assert f"tirebench {verb} " in page
    images = re.findall(r'<img src="([^"]+)"', page)
    assert len(images) >= 12
    assert all((out / image).is_file() for image in images)
    assert not re.search(r"https?://", page)


def cells(page: str, first: str) -> list[str]:
    """Return the cells of the row of the table of agreement that begins with `first`."""
    table = page[page.index("<caption>Library = FMU = bench</caption>") :]
    row = re.search(rf"<tr><td[^>]*>{first}</td>(.*?)</tr>", table)
    assert row
    return re.findall(r"<td[^>]*>([^<]*)</td>", row[1])


def turns_of(file: Path) -> dict[int, list[dict[str, object]]]:
    runs: dict[int, list[dict[str, object]]] = {}
    for turn in json.loads(file.read_text())["turns"]:
        runs.setdefault(turn["run"], []).append(turn)
    return runs


@pytest.mark.parametrize(("title", "key"), [("vertical load Fz", "Fz"), ("lateral force Fy", "Fy")])
def test_the_live_table_tells_the_differences_of_the_files(
    made: tuple[Path, str], title: str, key: str
) -> None:
    out, _ = made
    library, fmu = turns_of(out / "set1-unseen.json"), turns_of(out / "fmu.json")
    live, replay = turns_of(out / "live/live.json"), turns_of(out / "live/replay.json")
    assert live == replay
    assert len(live) == 6
    _, count, largest, _, live_count, replayed, count_2, beside, _ = cells(
        (out / "index.html").read_text(), title
    )
    for one, other, turns, text in (
        (library, fmu, count, largest),
        (live, replay, live_count, replayed),
        (live, library, count_2, beside),
    ):
        apart = [
            abs(float(str(a[key])) - float(str(b[key])))
            for run in one
            for a, b in zip(one[run], other[run], strict=True)
            if a[key] is not None and b[key] is not None
        ]
        assert int(turns) == len(apart) > 15
        assert float(text) == pytest.approx(max(apart), rel=0.06)  # two digits
    assert float(beside) > 1e-3  # strain of the made-up tire does not lie on the rig's steps
    assert "rounds strain to whole counts of 2.44 microstrain" in (out / "index.html").read_text()


def demo_module() -> ModuleType:
    spec = importlib.util.spec_from_file_location("demo", ROOT / "build/demo.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_difference_makes_the_demonstration_fail(
    made: tuple[Path, str], campaigns: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pages.live import LiveFiles

    out, _ = made
    live = out / "live"
    files = LiveFiles(
        out / "set1-unseen.json",
        out / "fmu.json",
        live / "live.json",
        live / "replay.json",
        live / "conditions.json",
        live / "device.toml",
    )
    judge, data = demo_module().judge, campaigns / "set1-unseen"
    judge(Console(), files, data)
    for name in ("fmu", "replay"):
        document = json.loads(getattr(files, name).read_text())
        turn = next(turn for turn in document["turns"] if turn["Fz_valid"])
        turn["Fz"] *= 1.0 + 1e-8
        changed = tmp_path / f"{name}.json"
        changed.write_text(json.dumps(document))
        with pytest.raises(SystemExit) as end:
            judge(Console(), replace(files, **{name: changed}), data)
        assert end.value.code == 1
        assert "NOT EQUAL" in capsys.readouterr().out


def test_commands_run_side_by_side_on_one_core_each_and_say_what_they_said() -> None:
    module, said = demo_module(), io.StringIO()
    module.PROGRAMS = Path("/bin")
    steps = module.Steps(Console(file=said, width=200))
    steps.together([module.Job("Say", ("a word",), "echo"), module.Job("Show", (), "env")])
    assert "a word" in said.getvalue().splitlines()
    assert "OMP_NUM_THREADS=1" in said.getvalue().splitlines()
    assert sorted(steps.commands) == [("Say", "echo 'a word'"), ("Show", "env")]
    with pytest.raises(SystemExit) as end:
        steps.together([module.Job("Fail", (), "false")])
    assert end.value.code == 1
    assert "false ended with exit code 1" in said.getvalue()


def test_nothing_is_left_running_when_a_step_fails(tmp_path: Path) -> None:
    module = demo_module()
    module.PROGRAMS = Path("/bin")
    steps = module.Steps(Console(quiet=True))
    with (
        pytest.raises(RuntimeError, match="in the middle"),
        steps.beside("wait", "60", program="sleep", log=tmp_path / "log") as process,
    ):
        raise RuntimeError("in the middle")
    assert process.poll() is not None


def test_a_platform_without_pseudo_terminals_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    module = demo_module()
    monkeypatch.delattr(module.os, "openpty")
    with pytest.raises(SystemExit, match=r"no pseudo-terminal.*--no-live"):
        module.require_terminal()


def test_an_emulator_that_ends_early_is_told(tmp_path: Path) -> None:
    module = demo_module()
    log = tmp_path / "log"
    log.write_text("it broke")
    gone = subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"])
    gone.wait()
    with pytest.raises(SystemExit, match=r"(?s)ended with 3.*it broke"):
        module.wait_for_port(tmp_path / "port", gone, log)


def test_figures_that_the_campaigns_cannot_inform_are_left_out(made: tuple[Path, str]) -> None:
    page = (made[0] / "index.html").read_text()
    assert "figure_4_17" in page
    assert "figure_4_16" not in page  # no camber campaign
    assert "Why the low-pass" not in page  # no speeds


def test_a_missing_campaign_is_named(campaigns: Path, tmp_path: Path) -> None:
    (tmp_path / "set1").symlink_to(campaigns / "set1")
    done = demo("--data", tmp_path, "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "set1-unseen" in done.stderr


def test_the_library_refuses_another_tire(made: tuple[Path, str], tmp_path: Path) -> None:
    from pages.demo import write_demo_page

    from tirelib.core.errors import CalibrationError
    from tirelib.estimators.calibration_file import read_calibration

    runs = [run for run in cornering_runs() if np.isclose(run.plan.load, 4500.0)]
    calibration = read_calibration(made[0] / "calibration.toml")
    other = write(tmp_path / "set1", runs, name="set1", tire="another tire")
    with pytest.raises(CalibrationError, match="another tire"):
        write_demo_page(tmp_path, {"set1": other, "set1-unseen": other}, calibration)
    with pytest.raises(CalibrationError, match="set1-unseen"):
        write_demo_page(tmp_path, {"set1": other}, calibration)
