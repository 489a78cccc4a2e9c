"""The process that records: reads from the queue to the file, in files that the run names.

What is on disk and what of the queue is on it are written down together, so that a recorder that is
started again cuts off what its predecessor left half done and goes on with the read that follows.
"""

import pickle
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from bench.conditions import Conditions
from bench.errors import RecordingError
from bench.live.exchange import Address, Exchange
from bench.live.kept import orphaned, settled
from bench.recording import Recorder, RecordingHeader

LOOK = 0.05
"""Time between two looks into the queue, [s]; until then the bytes are safe in shared memory."""
LEFT = 0.5
"""When the run is gone, how long the last bytes are waited for, [s]."""


class Order(NamedTuple):
    """What the run wants.

    Attributes
    ----------
    kind : str
        ``start`` a recording, ``stop`` it, write an ``event``, or ``close`` after the last read.
    what : str or dict
        Name of the file; why it ends; the event.
    moment : int, [ns]
        Monotonic, of the event.
    """

    kind: str
    what: Any
    moment: int


@dataclass(slots=True)
class RecorderState:
    """How far the recorder is.

    Attributes
    ----------
    path : Path or None
        Of the recording that goes on.
    length : int
        Bytes of that file that are whole.
    bytes : int
        Raw bytes in it.
    began : tuple of int, [ns]
        The start of that file on the wall clock and on the monotonic one.
    raw, orders : int
        Cursors of the queues: what is before them was done.
    done : int
        Orders so far.
    cpu : float, [s]
        Time that the recorder has used.
    answer : str
        Why the last recording could not be started; empty if it was.
    error : str
        Why nothing more can be written; empty if it can.
    """

    path: Path | None = None
    length: int = 0
    bytes: int = 0
    began: tuple[int, int] = (0, 0)
    raw: int = 0
    orders: int = 0
    done: int = 0
    cpu: float = 0.0
    answer: str = ""
    error: str = ""


def record(header: RecordingHeader, conditions: Conditions, address: Address) -> None:
    """Record until the run ends; the target of the process."""
    exchange = Exchange(address)
    saved = exchange.recorded.get()
    state = RecorderState() if saved is None else pickle.loads(saved)
    _Recorder(header, conditions, exchange, state).run()
    exchange.close()


class _Recorder:
    def __init__(
        self, header: RecordingHeader, conditions: Conditions, exchange: Exchange,
        state: RecorderState,
    ) -> None:  # fmt: skip
        self._header = header
        self._conditions = conditions
        self._exchange = exchange
        self._state = state
        self._recorder: Recorder | None = None
        self._before = state.bytes
        self._last = ""  # why the run ends, once it does
        exchange.raw.go_to(state.raw)
        exchange.orders.go_to(state.orders)
        if state.path is not None:
            state.error = self._open(state.path, state.length)
        self._publish()

    def run(self) -> None:
        """Go on until the order to close, or until the run is gone."""
        settled()
        gone: float | None = None
        while not self._last:
            self._obey()
            busy = self._write()
            self._publish()
            if gone is None and orphaned():
                gone = time.monotonic()
            if gone is not None and time.monotonic() - gone > LEFT:
                self._last = "the run was killed"
            elif not busy and not self._last:
                time.sleep(LOOK)
        while self._write():
            self._publish()
        self._end(self._last)
        self._publish()

    def _obey(self) -> None:
        queue = self._exchange.orders
        while (message := queue.read()) is not None:
            order: Order = pickle.loads(message)
            if order.kind == "start":
                self._before = self._state.bytes = 0
                self._state.answer = self._open(Path(order.what), None)
            elif order.kind == "stop":
                self._write()
                self._end(order.what)
            elif order.kind == "event" and self._recorder is not None:
                self._recorder.event(order.what, order.moment)
            elif order.kind == "close":
                self._last = order.what
            self._state.done += 1

    def _write(self) -> bool:
        """Write what has come; tell whether there was anything."""
        queue, busy = self._exchange.raw, False
        while (message := queue.read()) is not None:
            busy = True
            if self._recorder is not None:
                try:
                    self._recorder.read(pickle.loads(message))
                except RecordingError as error:
                    self._fail(error)
        return busy

    def _open(self, path: Path, length: int | None) -> str:
        """Begin a file, or go on in it; return why that is not possible, or nothing."""
        if length is None:
            self._state.began = time.time_ns(), time.monotonic_ns()
        wall, monotonic = self._state.began
        header = replace(self._header, wall_ns=wall, monotonic_ns=monotonic)
        try:
            self._recorder = Recorder(path, header, self._conditions, length)
        except RecordingError as error:
            self._recorder = self._state.path = None
            return str(error)
        self._state.path = path
        return ""

    def _end(self, reason: str) -> None:
        recorder, self._recorder, self._state.path = self._recorder, None, None
        if recorder is not None:
            try:
                recorder.close(reason)
            except RecordingError as error:
                self._fail(error)

    def _fail(self, error: RecordingError) -> None:
        self._state.error = str(error)
        self._recorder = self._state.path = None

    def _publish(self) -> None:
        """Note what is safe on disk, and give back its room."""
        state, exchange = self._state, self._exchange
        if self._recorder is not None:
            try:
                self._recorder.flush()
                state.length = self._recorder.length
                state.bytes = self._before + self._recorder.bytes
            except RecordingError as error:
                self._fail(error)
        state.raw, state.orders = exchange.raw.cursor, exchange.orders.cursor
        state.cpu = time.process_time()
        exchange.recorded.put(pickle.dumps(state, 5))
        exchange.raw.take()
        exchange.orders.take()
