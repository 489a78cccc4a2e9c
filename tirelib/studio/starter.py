"""The server's side of the process that starts the jobs (`tirelib.studio.runner`)."""

import json
import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

RUNNER = (sys.executable, "-m", "tirelib.studio.runner")
"""Command of the process that starts jobs."""
LONGEST_END = 5.0
"""Longest wait for the end of a job, [s]. A job is killed, which takes some milliseconds: half or
double of this limit changes nothing but the wait for a system that is stuck."""
LOST = -9
"""Exit code of a job that ended because its starter was killed: that of SIGKILL, as `subprocess`
counts it."""


class Starter:
    """Starts jobs, ends them, and knows which have ended.

    Parameters
    ----------
    command : sequence of str
        Command line of the process that starts the jobs.
    """

    def __init__(self, command: Sequence[str] = RUNNER) -> None:
        self._command = list(command)
        self._process: subprocess.Popen[bytes] | None = None
        self._said: queue.SimpleQueue[dict[str, int] | None] = queue.SimpleQueue()
        self._codes: dict[int, int] = {}
        self.running: dict[int, int] = {}
        """Process of each job that has begun and not ended; 0 until it is known."""

    def warm(self) -> None:
        """Have the process ready, so that the next job starts at once."""
        if self._process is not None and self._process.poll() is None:
            return
        self._leave()
        self._hear()
        environment = os.environ | {"TIRELIB_PROGRESS": "json", "PYTHONUNBUFFERED": "1"}
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
            start_new_session=True,  # Ctrl+C is the server's
        )
        threading.Thread(target=self._listen, args=[self._process], daemon=True).start()

    def start(self, number: int, words: dict[str, Any]) -> None:
        """Start a job.

        Parameters
        ----------
        number : int
        words : dict
            ``argv`` of `tirelib`, and the files ``stdout`` and ``stderr``.
        """
        self.warm()
        self.running[number] = 0
        self._order({"start": number, **words})

    def ended(self) -> dict[int, int]:
        """Return the exit codes of the jobs that have ended since the last call, by number."""
        self._hear()
        codes, self._codes = self._codes, {}
        return codes

    def end(self, number: int) -> None:
        """End a job and its children, and wait until they are gone; its exit code is not sent."""
        self._hear()
        begun, until = self.running.get(number), time.monotonic() + LONGEST_END
        self._order({"end": number})
        while begun and number in self.running and time.monotonic() < until:
            self._hear(0.1)
        self.running.pop(number, None)
        self._codes.pop(number, None)

    def close(self) -> None:
        """End the process and every job."""
        self._leave()
        if self._process is not None:
            try:
                self._process.wait(LONGEST_END)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def _leave(self) -> None:
        """Close the process's input, with which it ends."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()

    def _order(self, words: dict[str, Any]) -> None:
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError, ValueError):  # a process that has died is seen at the next look
                self._process.stdin.write(json.dumps(words).encode() + b"\n")
                self._process.stdin.flush()

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        with process.stdout as stream:
            for line in stream:
                self._said.put(json.loads(line))
        self._said.put(None)

    def _hear(self, wait: float = 0.0) -> None:
        """Take what the process has said."""
        while True:
            try:
                told = self._said.get(wait > 0.0, wait or None)
            except queue.Empty:
                return
            wait = 0.0
            if told is None:  # the process is gone
                self._codes |= dict.fromkeys(self.running, LOST)
                self.running.clear()
            elif "pid" in told and told["job"] in self.running:
                self.running[told["job"]] = told["pid"]
            elif "code" in told and self.running.pop(told["job"], None) is not None:
                self._codes[told["job"]] = told["code"]
