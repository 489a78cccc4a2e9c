"""Programs in processes of their own, whose words and end are waited for, however long."""

import fcntl
import os
import re
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path

PATIENCE = 600.0
"""No machine is so busy that something takes longer than this, [s]: what does, hangs."""
LOOK = 0.02
EMPTY = 25
"""Looks at a port in a row that find nothing before it is drained: half a second."""
A_TURN = r"\n +\d+ +\d+ +[\d.]+ "
"""A line that `tirebench run` prints of a turn: wheel, run, time."""


def wait_until(done: Callable[[], object], what: str = "") -> None:
    """Wait for a condition; it fails only where nothing goes on any more."""
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end, what
        time.sleep(LOOK)


class Program(subprocess.Popen[str]):
    """``tirebench`` with its words in files that nobody has to empty."""

    def __init__(self, folder: Path, *arguments: object) -> None:
        self.out, self.err = folder / "out.txt", folder / "err.txt"
        with self.out.open("w") as out, self.err.open("w") as err:
            command = [sys.executable, "-u", "-m", "tirebench", *map(str, arguments)]
            super().__init__(command, stdout=out, stderr=err, text=True)

    def says(self, pattern: str) -> "re.Match[str]":
        """Wait until it has said something; it must, before it ends."""
        while not (found := re.search(pattern, self.out.read_text())):
            ended = self.poll() is not None
            if ended and not re.search(pattern, self.out.read_text()):
                raise AssertionError(pattern + self.out.read_text() + self.err.read_text())
            time.sleep(LOOK)
        return found

    def finish(self) -> tuple[int, str, str]:
        """Wait for its end; return its exit code and what it said."""
        code = self.wait(PATIENCE)
        said = self.err.read_text()
        assert "Traceback" not in said
        return code, self.out.read_text(), said


class Line:
    """A wheel that sends when the run is ready, and a run that ends when it has heard all.

    Parameters
    ----------
    spawn : callable
        Starts programs.
    folder : Path
        Folder of the port's name and of the file that lets the wheel begin.
    arguments : object
        Arguments of ``tirebench emulate``.
    """

    def __init__(self, spawn: Callable[..., Program], folder: Path, *arguments: object) -> None:
        self._go = folder / "go"
        self.wheel = spawn(
            "emulate",
            *arguments,
            "--port-file",
            folder / "port",
            "--wait",
            PATIENCE,
            "--after",
            self._go,
        )
        self.port = port_of(folder / "port", self.wheel)

    def heard_by(self, run: Program) -> tuple[int, str, str]:
        """Let the wheel send all, and the run end after it."""
        run.says("samples a step")
        self._go.touch()
        self.wheel.says("played")
        wait_until(lambda: drained(self.port), f"the run to read all of {self.port}")
        run.says(A_TURN)  # from then on it ends in good order
        run.send_signal(signal.SIGINT)
        outcome = run.finish()
        assert self.wheel.finish()[0] == 0
        return outcome


def drained(port: str) -> bool:
    """Return whether nothing more comes out of a port.

    The system hands a reader what was written in parts of 4096 bytes, each by a task of its own: a
    port that is empty once may hold more.
    """
    return not any(unread(port) or time.sleep(LOOK) for _ in range(EMPTY))


def unread(port: str) -> int:
    """Return how many bytes nobody has read from a port; none where it cannot be asked."""
    try:
        asked = os.open(port, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return 0
    try:
        return int.from_bytes(fcntl.ioctl(asked, termios.FIONREAD, bytes(4)), sys.byteorder)
    finally:
        os.close(asked)


def port_of(file: Path, wheel: Program | None = None) -> str:
    """Wait for the emulator's port."""
    wait_until(lambda: file.exists() or (wheel is not None and wheel.poll() is not None), str(file))
    return file.read_text().strip()
