"""Ctrl-C, SIGTERM and a terminal that closes (SIGHUP) as a request to end in good order.

Also for a program in the background.
"""

import os
import signal
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import click

STOPS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Windows has no SIGHUP."""


def silence() -> None:
    """Discard output to a terminal that is gone; files and pipes are kept."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if not stat.S_ISCHR(os.fstat(stream.fileno()).st_mode):
                continue  # a terminal that is gone no longer reports that it was one
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
        except (OSError, ValueError):
            continue


def interrupt() -> None:
    """Interrupt the running work, so that it removes its unfinished files."""
    raise KeyboardInterrupt


@dataclass(slots=True)
class Stop:
    """What the first Ctrl-C, SIGTERM or SIGHUP does.

    Attributes
    ----------
    action : callable
        It may be replaced while the program goes on.
    """

    action: Callable[[], None]


@contextmanager
def on_stop(action: Callable[[], None] = interrupt) -> Iterator[Stop]:
    """Call the action at the first Ctrl-C, SIGTERM or SIGHUP; a second Ctrl-C interrupts as usual.

    Whatever else comes after the first one is ignored, because the end is on its way. After SIGHUP
    nobody reads what is said: it goes nowhere, instead of ending the program. SIGHUP and SIGTERM
    that are ignored when this begins, as SIGHUP is under ``nohup``, stay so.
    """
    stop, stopped = Stop(action), False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal stopped
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if number == getattr(signal, "SIGHUP", None):
            silence()
        if not stopped:
            stopped = True
            stop.action()

    ignored = [number for number in STOPS if signal.getsignal(number) is signal.SIG_IGN]
    obeyed = [number for number in STOPS if number == signal.SIGINT or number not in ignored]
    before = {number: signal.signal(number, handle) for number in obeyed}
    try:
        yield stop
    finally:
        for number, old in before.items():
            signal.signal(number, old)


@contextmanager
def start_in_order() -> Iterator[Stop]:
    """Let a program that is stopped during its start remove its unfinished files, with a message.

    Once it has begun, its `action` says what stops it.

    Raises
    ------
    click.exceptions.Exit
        With code 1, if it was stopped while it started.
    """
    with on_stop() as stop:
        try:
            yield stop
        except KeyboardInterrupt:
            if stop.action is not interrupt:
                raise
            click.echo("stopped during the start; nothing was read", err=True)
            raise click.exceptions.Exit(1) from None
