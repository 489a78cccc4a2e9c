"""The process that starts the jobs: it has the library loaded, and each job is a copy of it.

    python -m tirelib.studio.runner

It reads orders, a line of JSON each, from its standard input: `start`, a number, with `argv` of the
program `tirelib`, by how much it gives way (`nice`), and the files for what it says; or `end`, the
number of a job that has to end. On its standard output it says `job` with the `pid` of each that
has begun, and with the `code` of each that has ended. Its input stays open while the server lives;
when it ends, so do the jobs.
"""

import json
import os
import runpy
import select
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, NoReturn

LOADED = (
    "asammdf",
    "tirelib.campaign.overview",
    "tirelib.cli.add",
    "tirelib.cli.campaign",
    "tirelib.cli.compare",
    "tirelib.cli.diagnose",
    "tirelib.cli.identify",
    "tirelib.inference.compare.document",
    "tirelib.inference.compare.plot_data",
    "tirelib.inference.diagnose.document",
    "tirelib.effects.load",
    "tirelib.inference.extend.document",
    "tirelib.inference.identify.document",
    "tirelib.inference.identify.whole",
    "tirelib.model.registration",
    "tirelib.measured.waveforms",
)
"""Modules that are loaded before the first job: they take most of a command's start."""
COPIES = sys.platform == "linux"
"""Whether jobs are copies of this process (fork); elsewhere each is a new process, which loads the
library itself, because libraries of these systems do not bear to be copied."""
Run = Callable[[Sequence[str]], None]


def tirelib(words: Sequence[str]) -> None:
    """Run the program, and end with its exit code."""
    sys.argv = ["tirelib", *words]
    runpy.run_module("tirelib", run_name="__main__", alter_sys=True)


def main(run: Run = tirelib, loaded: Sequence[str] = LOADED) -> None:
    """Start what is ordered until the server ends; then end the jobs.

    Parameters
    ----------
    run : callable
        Does the work of a job in its process.
    loaded : sequence of str
        Modules that are loaded before.
    """
    starter = _Starter(run)
    if COPIES:
        for name in loaded:
            import_module(name)
    for line in starter.orders() if COPIES else sys.stdin.buffer:
        order = json.loads(line)
        if "start" in order:
            starter.start(order)
        else:
            starter.end(order["end"])
    starter.close()


class _Starter:
    def __init__(self, run: Run) -> None:
        self._run = run
        self._jobs: dict[int, int] = {}  # number by process
        self._life = os.pipe()  # its other end closes when this process is gone
        self._saying = threading.Lock()

    def orders(self) -> Iterator[bytes]:
        """Yield the lines of the standard input; between them, see which jobs have ended."""
        ended, wake = os.pipe()
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        # a signal with a handler of Python is written to the pipe; the default one is not
        signal.signal(signal.SIGCHLD, lambda *_: None)
        rest = b""
        while True:
            ready, _, _ = select.select([0, ended], [], [])
            if ended in ready:
                os.read(ended, 1 << 12)
                self._look()
            if 0 in ready:
                if not (part := os.read(0, 1 << 16)):
                    return
                *lines, rest = (rest + part).split(b"\n")
                yield from lines

    def start(self, order: dict[str, Any]) -> None:
        files = [
            os.open(order[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            for name in ("stdout", "stderr")
        ]
        if COPIES:
            self._copy(order, files)
        else:
            self._spawn(order, files)
        for file in files:
            os.close(file)

    def _copy(self, order: dict[str, Any], files: Sequence[int]) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # this process has one thread
            pid = os.fork()
        if not pid:
            os.nice(order.get("nice", 0))
            self._work(order["argv"], files)
        self._jobs[pid] = order["start"]
        self._say(job=order["start"], pid=pid)

    def _work(self, words: Sequence[str], files: Sequence[int]) -> NoReturn:
        os.setpgrp()  # Linux would weigh a session of its own against others, whatever `nice` says
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for source, target in zip((nothing, *files), (0, 1, 2), strict=True):
            os.dup2(source, target)
        os.close(self._life[1])
        threading.Thread(target=_end_with, args=self._life[:1], daemon=True).start()
        code = 1
        try:
            self._run(words)
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            with suppress(OSError, ValueError):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)

    def _spawn(self, order: dict[str, Any], files: Sequence[int]) -> None:
        out, err = files
        words = [sys.executable, "-m", "tirelib", *order["argv"]]
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        self._jobs[process.pid] = order["start"]
        self._say(job=order["start"], pid=process.pid)

        def wait() -> None:
            code = process.wait()
            self._jobs.pop(process.pid, None)
            self._say(job=order["start"], code=code)

        threading.Thread(target=wait, daemon=True).start()

    def _look(self) -> None:
        """Say which jobs have ended."""
        for pid in list(self._jobs):
            done, status = os.waitpid(pid, os.WNOHANG)
            if done:
                self._say(job=self._jobs.pop(pid), code=os.waitstatus_to_exitcode(status))

    def end(self, number: int) -> None:
        """End a job and its children at once."""
        for pid in [pid for pid, job in list(self._jobs.items()) if job == number]:
            with suppress(OSError):
                os.kill(pid, signal.SIGKILL if COPIES else signal.SIGTERM)
            with suppress(OSError):
                if COPIES:
                    os.killpg(pid, signal.SIGKILL)

    def close(self) -> None:
        for number in list(self._jobs.values()):
            self.end(number)

    def _say(self, **words: Any) -> None:
        with self._saying, suppress(OSError):  # the server may be gone
            os.write(1, json.dumps(words).encode() + b"\n")


def _end_with(life: int) -> None:
    """End this job and its children when the process that has started it is gone."""
    os.read(life, 1)
    with suppress(OSError):
        os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    main()
