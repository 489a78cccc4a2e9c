"""Shared by the tests of the bench: a tiny campaign, toy FMUs, programs in their own process."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from pythonfmu import FmuBuilder

from tests.bench.browser import chromium
from tests.bench.campaigns import write_tiny_campaign
from tests.bench.programs import Program
from tests.trained import observed_and_trained
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.trust import remember
from tirelib.estimators.calibration import Calibration

TOY = Path(__file__).with_name("toy_slave.py")
BUILD = Path(__file__).parents[2] / "build"
Spawn = Callable[..., Program]


@pytest.fixture(scope="session", autouse=True)
def terminal_that_hangs_up() -> Iterator[None]:
    """Let SIGHUP end what tests start, also when they run under nohup, which ignores it."""
    hang_up = getattr(signal, "SIGHUP", None)
    before = signal.signal(hang_up, signal.SIG_DFL) if hang_up is not None else None
    yield
    if hang_up is not None:
        signal.signal(hang_up, before)


@pytest.fixture(autouse=True)
def ordinary_priority() -> Iterator[None]:
    """Give back the real-time priority that a run of the bench takes for the process of the tests.

    All later tests of this process would go before the programs that they start and wait for.
    """
    yield
    if hasattr(os, "sched_setscheduler"):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@pytest.fixture(scope="module")
def build_programs() -> Iterator[None]:
    """Let a module's tests import the programs of `build/`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BUILD))
        yield


@pytest.fixture(scope="session")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiny_campaign(tmp_path_factory.mktemp("campaign") / "tiny")


@pytest.fixture(scope="session")
def calibration() -> Calibration:
    return observed_and_trained()[1].calibration


def build_toy(folder: Path, samples: int, source: Path = TOY) -> Path:
    """Build the toy with k samples a step; the module name must differ within one process."""
    script = folder / f"toy_slave_{samples}.py"
    text = source.read_text().replace("SAMPLES = 16", f"SAMPLES = {samples}")
    script.write_text(text.replace("ToyTire", f"ToyTire{samples}"))
    FmuBuilder.build_FMU(script, dest=folder)
    return folder / f"ToyTire{samples}.fmu"


@pytest.fixture(scope="session", autouse=True)
def own_trust_list(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep away from the user's list of trusted FMUs, here and in processes that are started."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))
        yield


@pytest.fixture(scope="session")
def toy_fmus(tmp_path_factory: pytest.TempPathFactory, own_trust_list: None) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("toys")
    toys = {samples: build_toy(folder, samples) for samples in (1, 10, 16)}
    for toy in toys.values():
        remember(read_fmu(toy))
    return toys


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


@pytest.fixture
def spawn(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Spawn]:
    """Start ``tirebench`` in a process of its own; whatever is left is ended."""
    with spawning(tmp_path_factory) as start:
        yield start


def with_own_name(arguments: tuple[object, ...]) -> tuple[object, ...]:
    """Return a program's arguments with a link on the port of an emulator.

    The system gives a number in /dev/pts anew as soon as it is free. A reader of another test that
    waits for its lost port to come back would take that of the next emulator; a link is not reused.
    """
    if arguments[0] != "emulate" or "--port-file" not in arguments:
        return arguments
    if "--link" in arguments or "--bus" in arguments:
        return arguments
    file = arguments[arguments.index("--port-file") + 1]
    return (*arguments, "--link", f"{file}.tty")


@contextmanager
def spawning(folders: pytest.TempPathFactory) -> Iterator[Spawn]:
    """Give what starts programs, and end those that are left."""
    started: list[Program] = []

    def start(*arguments: object) -> Program:
        started.append(Program(folders.mktemp("program"), *with_own_name(arguments)))
        return started[-1]

    try:
        yield start
    finally:
        for process in started:
            if process.poll() is None:
                process.kill()
            process.wait()
