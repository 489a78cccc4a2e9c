"""The demonstration from ready campaigns: every step runs, and the page holds what they give."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import cornering_runs, synthetic_run, write

ROOT = Path(__file__).parents[2]
LOADS = (1500.0, 4500.0, 7500.0)


def demo(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, ROOT / "build/demo.py", *map(str, words)],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip


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
def made(campaigns: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    out = tmp_path_factory.mktemp("demo")
    done = demo("--data", campaigns, "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    return out, done.stdout


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
    for verb in ("campaign check", "features", "calibrate", "estimate"):
        assert f"tirelib {verb} " in page
    images = re.findall(r'<img src="([^"]+)"', page)
    assert len(images) >= 12
    assert all((out / image).is_file() for image in images)
    assert not re.search(r"https?://", page)


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


def test_the_library_refuses_another_tire(campaigns: Path, tmp_path: Path) -> None:
    from tirelib.campaign import read_campaign
    from tirelib.errors import CalibrationError
    from tirelib.estimators.train import train
    from tirelib.observations import observe
    from tirelib.report.demo import write_demo_page

    runs = [run for run in cornering_runs() if np.isclose(run.plan.load, 4500.0)]
    calibration = train(observe([read_campaign(campaigns / "set1")])).calibration
    other = write(tmp_path / "set1", runs, name="set1", tire="another tire")
    with pytest.raises(CalibrationError, match="another tire"):
        write_demo_page(tmp_path, {"set1": other, "set1-unseen": other}, calibration)
    with pytest.raises(CalibrationError, match="set1-unseen"):
        write_demo_page(tmp_path, {"set1": other}, calibration)
