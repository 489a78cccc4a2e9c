"""Ctrl-C, SIGTERM and a terminal that closes (SIGHUP) as a request to end in good order.

Also for a program in the background.
"""

import os
import signal
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STOPS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Windows has no SIGHUP."""


def silence() -> None:
    """Let output to a terminal that is gone go nowhere; files and pipes are kept."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if not stat.S_ISCHR(os.fstat(stream.fileno()).st_mode):
                continue  # once it is gone, a terminal does not tell that it was one
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
        except (OSError, ValueError):
            continue


@contextmanager
def on_stop(action: Callable[[], None]) -> Iterator[None]:
    """Call `action` at the first Ctrl-C, SIGTERM or SIGHUP; a second Ctrl-C interrupts as usual.

    After SIGHUP nobody reads what is said: it goes nowhere, instead of ending the program.
    """

    def handle(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if number == getattr(signal, "SIGHUP", None):
            silence()
        action()

    before = {number: signal.signal(number, handle) for number in STOPS}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
