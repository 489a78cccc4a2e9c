"""The process that reads a port: bytes to the recorder first, then samples to the estimators."""

import pickle
import time
from collections.abc import Mapping
from dataclasses import dataclass

from bench.deadline import Deadline
from bench.device import Device
from bench.errors import BenchError, UnpluggedError
from bench.links import BACK, LOST, RESUMED, Link, Read
from bench.links.opening import PortPlan
from bench.links.reconnecting import ReconnectingLink
from bench.live.exchange import STOP, Address, Exchange
from bench.live.kept import orphaned, settled
from bench.protocols.plan import ProtocolPlan
from bench.wheels import Wheels

WAIT = 0.1
"""The longest wait for bytes before it is looked whether the run goes on, [s]."""
RAW_LOST = "raw bytes lost: "
"""Begins the event of a recording that tells of bytes that the recorder had no room for."""


@dataclass(frozen=True, slots=True)
class ReaderPlan:
    """What is read, and what it means.

    Attributes
    ----------
    port : PortPlan
    patience : float, [s]
        How long the port may be away.
    protocol : ProtocolPlan
    devices : mapping of wheel to Device
    wheels : tuple of int
        See `bench.wheels.Wheels`.
    recorded : bool
        Whether there is a recorder.
    """

    port: PortPlan
    patience: float
    protocol: ProtocolPlan
    devices: Mapping[int | None, Device]
    wheels: tuple[int, ...] = ()
    recorded: bool = True


@dataclass(slots=True)
class LineState:
    """How the line is; a reader that is started again goes on from it.

    Attributes
    ----------
    wheels : Wheels
    name : str
        Of the port, once it is open.
    heard, lost : float or None, [s]
        When bytes came last and when the port went away, on `time.time`; None if not.
    last_byte : float or None, [s]
        When bytes came last, monotonic.
    ended, message : str
        Why the line ended, empty while it goes on; what is to be said of it.
    cpu : float, [s]
        Time that the reader has used.
    error : tuple of str
        Name of the class and text of an error that ends the run; empty without one.
    """

    wheels: Wheels
    name: str = ""
    heard: float | None = None
    lost: float | None = None
    last_byte: float | None = None
    ended: str = ""
    message: str = ""
    cpu: float = 0.0
    error: tuple[str, str] | tuple[()] = ()


def read_port(plan: ReaderPlan, address: Address) -> None:
    """Read until the run ends; the target of the process."""
    exchange = Exchange(address)
    saved = exchange.line.get()
    state = LineState(Wheels(plan.protocol.decoder(), plan.devices, plan.wheels))
    if saved is not None:
        state = pickle.loads(saved)
    reader = _Reader(plan, exchange, state)
    try:
        link = ReconnectingLink(plan.port.open, plan.patience, state.name)
        if saved is not None:
            reader.take(Read(time.monotonic_ns(), b"", RESUMED))
        state.name = link.name
        reader.publish()
        settled()
        reader.run(link)
        link.close()
    except BenchError as error:
        state.error = type(error).__name__, str(error)
    reader.publish()
    address.news.release()
    exchange.close()


class _Reader:
    def __init__(self, plan: ReaderPlan, exchange: Exchange, state: LineState) -> None:
        self._plan = plan
        self._exchange = exchange
        self._state = state
        self._fresh = exchange.address.fresh
        self._raw_lost = 0  # bytes since the recorder was told of it
        self._overruns: int | None = None
        self._next_look = 0.0

    def run(self, link: Link) -> None:
        """Go on until the end of the link or of the run."""
        state, exchange = self._state, self._exchange
        while not exchange.is_set(STOP) and not orphaned():
            try:
                read = link.receive(Deadline.after(WAIT))
            except UnpluggedError as error:
                state.ended, state.message = "unplugged", str(error)
                state.lost = state.lost or time.time()
                return
            if read is None:
                state.ended = "end"
                return
            if read.data or read.event:
                self._look(link)
                self.take(read)

    def take(self, read: Read) -> None:
        """Hand a read to the recorder, decode it, and hand its samples to the estimators."""
        state, exchange = self._state, self._exchange
        if self._plan.recorded:
            self._record(read)
        if read.event in (BACK, RESUMED):
            state.wheels.interrupt()
        if read.event == LOST:
            state.lost = time.time()
        elif read.event == BACK or read.data:
            state.lost = None
        blocks = state.wheels.push(read.data, read.arrival) if read.data else []
        if read.data:
            state.heard, state.last_byte = time.time(), time.monotonic()
        self.publish()  # before the samples: what is missing then shows as a hole, never twice
        slots = {wheel: slot for slot, wheel in enumerate(state.wheels.heard)}
        for block in blocks:
            exchange.samples[slots[block.wheel]].put(pickle.dumps(block, 5))
        for wheel in {block.wheel for block in blocks}:
            self._fresh[slots[wheel]].release()
        if read.event:
            exchange.address.news.release()

    def publish(self) -> None:
        """Let the run, and a reader after this one, see how the line is."""
        self._state.cpu = time.process_time()
        self._exchange.line.put(pickle.dumps(self._state, 5))

    def _record(self, read: Read) -> None:
        raw = self._exchange.raw
        if self._raw_lost:
            told = Read(read.arrival, b"", f"{RAW_LOST}{self._raw_lost}")
            if not raw.put(pickle.dumps(told, 5)):
                self._raw_lost += len(read.data)
                return
            self._raw_lost = 0
        if not raw.put(pickle.dumps(read, 5)):
            self._raw_lost += len(read.data)

    def _look(self, link: Link) -> None:
        """Count the overruns of the port since it was last asked, once a second."""
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + 1.0
        seen, self._overruns = self._overruns, link.overruns()
        self._state.wheels.line.counts.overruns += 0 if seen is None else self._overruns - seen
