"""Shared by the tests of the bench: a tiny campaign, toy FMUs, and a pass through a real port."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pythonfmu import FmuBuilder

from tests.bench.campaigns import write_tiny_campaign

TOY = Path(__file__).with_name("toy_slave.py")


@pytest.fixture(scope="session")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "tiny"
    write_tiny_campaign(folder)
    return folder


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
def spawn() -> Iterator[object]:
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
