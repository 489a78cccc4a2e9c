"""What is stopped by a signal ends in order, also while it starts."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import click
import pytest

from tests.bench.conftest import TOY, Spawn, build_toy
from tests.bench.programs import wait_until
from tirebench.cli.stop import STOPS, on_stop, start_in_order
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.trust import remember
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.live_plan import LivePlan
from tirebench.live.reader import ReaderPlan
from tirebench.recording.header import RecordingHeader
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import Conditions

BEGIN = "        super().__init__(**kwargs)\n"
WAITS = "        while os.environ.get('TOY_WAITS'):\n            time.sleep(0.01)\n"


@pytest.fixture
def endless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an FMU that is never loaded by programs that start from here."""
    script = tmp_path / "toy_slave.py"
    text = TOY.read_text().replace(BEGIN, BEGIN + WAITS)
    script.write_text(text.replace("from pythonfmu", "import os\nimport time\n\nfrom pythonfmu", 1))
    fmu = build_toy(tmp_path, 16, script)
    remember(read_fmu(fmu))
    monkeypatch.setenv("TOY_WAITS", "1")
    return fmu


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no SIGHUP")
def test_a_run_that_is_stopped_while_it_starts_leaves_nothing(
    endless: Path, spawn: Spawn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its estimator loads and loads, its recorder has begun."""
    temporary, file = tmp_path / "temporary", tmp_path / "a.mcap"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    run = spawn(
        "run",
        "--port",
        tmp_path / "none",
        "--wait",
        "--fmu",
        endless,
        "--record",
        file,
        "--json",
        tmp_path / "a.json",
        "--no-page",
    )
    wait_until(lambda: file.exists() or run.poll() is not None)
    assert list(temporary.glob(f"tirebench-*-{run.pid}-*"))  # the FMU
    run.send_signal(signal.SIGHUP)
    code, _, said = run.finish()
    assert (code, "stopped during the start" in said) == (1, True)
    assert not file.exists()
    assert not list(Path("/dev/shm").glob(f"*tirebench-*-{run.pid}-*"))
    assert not list(temporary.glob("tirebench-*"))
    assert not (tmp_path / "a.json").exists()


def test_a_recording_to_which_nothing_came_when_a_run_is_interrupted_is_removed(
    tmp_path: Path,
) -> None:
    reader = ReaderPlan((SourcePlan(PortPlan(str(tmp_path / "none"))),), 60.0, wait=60.0)
    file = tmp_path / "a.mcap"
    plan = LivePlan(reader, None, Conditions.constant(), RecordingHeader({}), file)
    chain = LiveChain(plan).__enter__()
    assert file.exists()
    chain.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert not file.exists()


@pytest.mark.parametrize("number", STOPS)
def test_each_signal_interrupts_a_program_that_starts_and_it_says_so(
    number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(click.exceptions.Exit), start_in_order():
        os.kill(os.getpid(), number)
    assert "stopped during the start" in capsys.readouterr().err


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no SIGHUP")
def test_a_closed_terminal_ends_nothing_that_was_started_with_nohup() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with start_in_order():
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_only_the_first_signal_counts_and_it_does_what_is_wanted_by_then() -> None:
    stopped: list[str] = []
    with on_stop(lambda: stopped.append("while it starts")) as stop:
        stop.action = lambda: stopped.append("begun")
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert stopped == ["begun"]


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no SIGHUP")
def test_a_terminal_that_closes_ends_a_run_in_order() -> None:
    stopped = []
    with on_stop(lambda: stopped.append(1)):
        os.kill(os.getpid(), signal.SIGHUP)
    assert stopped == [1]


ON_A_TERMINAL = """
import fcntl, sys, termios, time
from pathlib import Path
from tirebench.cli.stop import on_stop
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
stopped = []
with on_stop(lambda: stopped.append(1)):
    print("ready", flush=True)
    while not stopped:
        time.sleep(0.01)
print("ended", flush=True)
Path(sys.argv[1]).write_text("in order")
"""


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo-terminals")
def test_what_is_said_to_a_terminal_that_closed_ends_nothing(tmp_path: Path) -> None:
    master, slave = os.openpty()
    command = [sys.executable, "-c", ON_A_TERMINAL, str(tmp_path / "done")]
    process = subprocess.Popen(
        command, stdin=slave, stdout=slave, stderr=slave, start_new_session=True
    )
    os.close(slave)
    said = b""
    while b"ready" not in said:
        said += os.read(master, 100)
    os.close(master)
    assert process.wait() == 0
    assert (tmp_path / "done").read_text() == "in order"
