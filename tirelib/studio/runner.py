"""The process of one job: it waits, with the library loaded, for one command line, and runs it.

    python -m tirelib.studio.runner

It reads one line of JSON from its standard input: `argv` of the program `tirelib`, and the files
for what it says. Its input stays open while the server lives; when it ends, so does the job.
"""

import json
import os
import runpy
import signal
import sys
import threading
from contextlib import suppress
from importlib import import_module

LOADED = (
    "tirelib.campaign",
    "tirelib.compare.plot_data",
    "tirelib.extend.document",
    "tirelib.effects.load",
    "tirelib.diagnose.document",
    "tirelib.waveforms",
)
"""Modules that are loaded while the process waits: they take most of a command's start."""


def main() -> None:
    """Wait for a command line, run it, and end with its exit code."""
    for name in LOADED:
        import_module(name)
    line = b""
    while not line.endswith(b"\n"):
        if not (part := os.read(0, 1 << 16)):
            return  # the server has ended before there was a job
        line += part
    order = json.loads(line)
    threading.Thread(target=_end_with_server, daemon=True).start()
    for stream, name in ((sys.stdout, "stdout"), (sys.stderr, "stderr")):
        target = os.open(order[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(target, stream.fileno())
    sys.argv = ["tirelib", *order["argv"]]
    runpy.run_module("tirelib", run_name="__main__", alter_sys=True)


def _end_with_server() -> None:
    """End this process and its children when the server is gone, however it went."""
    while os.read(0, 1 << 10):  # not by sys.stdin, whose lock would be held as the process ends
        pass
    if os.name == "posix" and os.getpgid(0) == os.getpid():
        with suppress(OSError):
            os.killpg(0, signal.SIGKILL)
    os._exit(1)


if __name__ == "__main__":
    main()
