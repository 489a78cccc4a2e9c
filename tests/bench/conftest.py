"""Shared by the tests of the bench: a tiny campaign, toy FMUs, programs in their own process."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pythonfmu import FmuBuilder

from tests.bench.campaigns import write_tiny_campaign
from tests.synthetic import cornering_runs, write
from tirelib.campaign import read_campaign
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.train import train
from tirelib.observations import observe

TOY = Path(__file__).with_name("toy_slave.py")
Spawn = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture(scope="session")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiny_campaign(tmp_path_factory.mktemp("campaign") / "tiny")


@pytest.fixture(scope="session")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Calibration:
    folder = write(tmp_path_factory.mktemp("calibration") / "set1", cornering_runs())
    return train(observe([read_campaign(folder)])).calibration


def build_toy(folder: Path, samples: int) -> Path:
    """Build the toy with k samples a step; the module name must differ within one process."""
    script = folder / f"toy_slave_{samples}.py"
    text = TOY.read_text().replace("SAMPLES = 16", f"SAMPLES = {samples}")
    script.write_text(text.replace("ToyTire", f"ToyTire{samples}"))
    FmuBuilder.build_FMU(script, dest=folder)
    return folder / f"ToyTire{samples}.fmu"


@pytest.fixture(scope="session")
def toy_fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("toys")
    return {samples: build_toy(folder, samples) for samples in (1, 10, 16)}


@pytest.fixture
def spawn() -> Iterator[Spawn]:
    """Start ``tirebench`` in a process of its own; whatever is left is ended."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: object) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "bench", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
