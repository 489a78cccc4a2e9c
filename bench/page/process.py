"""Start the page's process, start it again when it dies or hangs, and count that."""

import multiprocessing
import secrets
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing import connection
from multiprocessing.connection import Connection
from typing import Any

from bench.errors import LinkError
from bench.page.board import Board

HANGS = 10.0
"""A process without a sign of life for so long is ended and started again, [s]."""
STARTS = 60.0
"""A process that starts may be silent for so long more, [s]."""
FIRST_PAUSE, LONGEST_PAUSE = 0.2, 30.0
"""Before a new start: it doubles while starts fail, [s]."""
LIVED = 5.0
"""A process that lived longer starts over with the first pause, [s]."""

Target = Callable[..., None]


class Keeper:
    """Keep a process running beside the run; a context manager.

    A thread sleeps until the process ends, so that the run itself never looks after it.

    Parameters
    ----------
    board : Board
    target : callable
        Runs in the process; called with what `arguments` returns.
    arguments : callable
        Called before each start with the number of starts (from 1) and the writing end of the pipe
        for commands.
    listen : callable
        Gets the reading end.

    Attributes
    ----------
    starts : int
    """

    def __init__(
        self,
        board: Board,
        target: Target,
        arguments: Callable[[int, Connection], tuple[Any, ...]],
        listen: Callable[[Connection], None],
    ) -> None:
        self.starts = 0
        self._board = board
        self._target = target
        self._arguments = arguments
        self._listen = listen
        self._context = multiprocessing.get_context("spawn")
        self._process: Any = None
        self._woken, self._wake = self._context.Pipe(duplex=False)
        self._thread = threading.Thread(target=self._keep, name="page keeper", daemon=True)

    @property
    def process_id(self) -> int | None:
        """Of the process, while there is one."""
        process = self._process
        return None if process is None else process.pid

    def __enter__(self) -> "Keeper":
        self._start()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._wake.send_bytes(b"end")
        self._thread.join(5.0)
        process = self._process
        if process is not None:
            process.terminate()
            process.join(2.0)
            if process.is_alive():
                process.kill()
                process.join(2.0)
            process.close()
        self._woken.close()
        self._wake.close()

    def _start(self) -> None:
        reading, writing = self._context.Pipe(duplex=False)
        self._board.beat(STARTS)
        process = self._context.Process(
            target=self._target, args=self._arguments(self.starts + 1, writing), daemon=True
        )
        process.start()
        self._process = process
        self.starts += 1
        writing.close()  # so that a process that dies in the middle of a message ends the pipe
        self._listen(reading)

    def _keep(self) -> None:
        pause, started = FIRST_PAUSE, time.monotonic()
        while True:
            ready = connection.wait([self._process.sentinel, self._woken], 2.0)
            if self._woken in ready:
                return
            if not ready and self._board.silence > HANGS:
                self._process.kill()
                self._process.join(2.0)
            if self._process.is_alive():
                continue
            pause = FIRST_PAUSE if time.monotonic() - started > LIVED else pause
            if connection.wait([self._woken], pause):
                return
            pause = min(2.0 * pause, LONGEST_PAUSE)
            self._process.close()
            self._start()
            started = time.monotonic()


def listener(host: str, port: int) -> socket.socket:
    """Bind the page's socket; port 0 takes a free one.

    Raises
    ------
    LinkError
        If the address cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=64)
    except OSError as error:
        raise LinkError(
            f"--host {host} --page-port {port}: the page cannot be bound ({error.strerror}); an "
            "address and a free port of this machine are needed; choose others, 0 for any port, "
            "or --no-page"
        ) from None


def new_token() -> str:
    """Return a token that nobody can guess."""
    return secrets.token_urlsafe(24)
