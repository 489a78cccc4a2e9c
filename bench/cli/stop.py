"""Ctrl-C and SIGTERM as a request to end in good order, also for a program in the background."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def on_stop(action: Callable[[], None]) -> Iterator[None]:
    """Call `action` at the first Ctrl-C or SIGTERM; a second Ctrl-C interrupts as usual."""

    def handle(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        action()

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
