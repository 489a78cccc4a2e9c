"""The process that reads: bytes to the recorder first, then samples to the estimators.

It reads a port itself; of several ports it gathers what their processes bring
(`tirebench.live.ports`).
"""

import pickle
import time
from dataclasses import dataclass, field

from tirebench.deadline import Deadline
from tirebench.errors import BenchError, UnpluggedError
from tirebench.estimator.wheels import MOST_WHEELS, Wheels
from tirebench.links import BACK, DECODED, LOST, PASSED, RESUMED, Link, Read
from tirebench.links.reconnecting import ReconnectingLink
from tirebench.live.exchange import RAW, STOP, Address, Exchange
from tirebench.live.ports import GatheredLink
from tirebench.live.priority import own_share
from tirebench.live.rings import ByteQueue
from tirebench.live.supervised import orphaned, settled
from tirebench.setup.source_plan import SourcePlan, wheels_of

LONGEST_READ_WAIT = 0.1
"""Longest wait for bytes before the process checks whether the run continues, [s]."""
FULL_QUEUE_WAIT = 0.01
"""Wait while a queue behind the reader is full, [s]."""
TRIES = 2
TOO_LATE, CAUGHT_UP = 2.0, 0.2
"""Reads that have waited for the reader for longer are recorded and not decoded, until they wait
no longer than the second, [s]. A queue of reads holds 4 s of four wheels on CAN FD."""
RAW_LOST = "raw bytes lost: "
"""First words of the event that records bytes for which the recorder had no room."""


@dataclass(frozen=True, slots=True)
class ReaderPlan:
    """The ports that are read, and the meaning of their bytes.

    Attributes
    ----------
    sources : tuple of SourcePlan
        A port each.
    patience : float, [s]
        How long a port may be away.
    wheels : tuple of int
        See `tirebench.estimator.wheels.Wheels`.
    recorded : bool
        Whether there is a recorder.
    every_turn : bool
        Whether no turn is skipped: the port waits where estimators or recorder are behind.
    strain : bool
        Whether it records decoded samples too.
    wait : float, [s]
        How long a port that is not there is waited for at the start.
    apart : bool
        Whether a process of its own reads the only port too: where the processor is short it goes
        on while another one decodes.
    estimated : bool
        Whether there are estimators: a wheel whose clock contradicts its rate gets none.
    """

    sources: tuple[SourcePlan, ...]
    patience: float
    wheels: tuple[int, ...] = ()
    recorded: bool = True
    every_turn: bool = False
    strain: bool = True
    wait: float = 0.0
    apart: bool = False
    estimated: bool = True

    @property
    def ports(self) -> int:
        """Processes that read a port each; 0 where the reader reads the only one."""
        return len(self.sources) if len(self.sources) > 1 or self.apart else 0

    @property
    def expected(self) -> int:
        """Wheels that are known before anything is heard, one at least; as many as are read."""
        known = sum(len(source.known_wheels) for source in self.sources)
        return max(1, len(self.wheels) or min(known, MOST_WHEELS))

    def fresh(self) -> Wheels:
        """Return the wheels before anything was heard."""
        return wheels_of(self.sources, self.wheels)


@dataclass(slots=True)
class LineState:
    """State of the line, from which a restarted reader continues.

    Attributes
    ----------
    wheels : Wheels
    name : str
        Name of the port, once it is open.
    heard, lost : float or None, [s]
        When bytes came last and when a port went away, on `time.time`; None if not.
    last_byte : float or None, [s]
        When bytes came last, monotonic.
    ended, message : str
        Why the line ended, empty while it goes on; what is to be said of it.
    raw : int
        Cursor of the queue of reads: those before it are done.
    samples : tuple of int
        Cursors of the queues of samples, that of the recorder last: what is before them comes of
        those reads.
    tries : int
        How often a reader began with what comes next of them and ended.
    cpu : float, [s]
        Time that the reader has used.
    away : dict of source to float, [s]
        Ports that went away, and when, on `time.time`.
    newest : dict of source to int, [ns]
        Arrival of the newest read that was taken.
    passing : bool
        Whether bytes are only recorded at the moment, because the reader is too late.
    passed : int
        Bytes that were not decoded.
    error : tuple of str
        Name of the class and text of an error that ends the run; empty without one.
    """

    wheels: Wheels
    name: str = ""
    heard: float | None = None
    last_byte: float | None = None
    ended: str = ""
    message: str = ""
    raw: int = 0
    samples: tuple[int, ...] = ()
    tries: int = 0
    cpu: float = 0.0
    away: dict[int, float] = field(default_factory=dict)
    newest: dict[int, int] = field(default_factory=dict)
    passing: bool = False
    passed: int = 0
    error: tuple[str, str] | tuple[()] = ()

    @property
    def lost(self) -> float | None:
        """When the first of the ports that are away went, on `time.time`; None if none is."""
        return min(self.away.values(), default=None)


def load(plan: ReaderPlan, _: Address) -> None:
    """Import beforehand what `read_port` needs; whoever takes over has no time for it."""
    if not plan.ports:
        plan.sources[0].port.load()
    settled()


def read_port(plan: ReaderPlan, address: Address) -> None:
    """Read until the run ends; the target of the process."""
    exchange = Exchange(address)
    reader = _Reader(plan, exchange)
    state = reader.state
    try:
        if reader.again:
            reader.catch_up()
        link: Link
        if plan.ports:
            link = GatheredLink(exchange, state.newest)
        else:
            port = plan.sources[0].port
            wait = 0.0 if reader.again else plan.wait
            away = state.name or (port.port if wait else "")
            link = ReconnectingLink(port.open, plan.patience, away, wait=wait)
            if reader.again:
                reader.take(Read(time.monotonic_ns(), b"", RESUMED))
        state.name = link.name
        reader.publish()
        settled()
        if plan.ports:
            own_share()
        reader.run(link)
        link.close()
    except BenchError as error:
        state.error = type(error).__name__, str(error)
    reader.publish()
    address.news.release()
    exchange.close()


class _Reader:
    """Goes on where a reader before this one ended, if there was one."""

    def __init__(self, plan: ReaderPlan, exchange: Exchange) -> None:
        self._plan = plan
        self._exchange = exchange
        self._fresh = exchange.address.fresh
        self._queues = (*exchange.samples, exchange.strain)
        self._raw_lost = 0  # bytes since the recorder was last informed
        self._overruns: list[int] = []
        self._next_look = 0.0
        saved = exchange.line.get()
        self.again = saved is not None
        self.state: LineState = LineState(plan.fresh()) if saved is None else pickle.loads(saved)

    def run(self, link: Link) -> None:
        """Go on until the end of the link or of the run."""
        state, exchange = self.state, self._exchange
        while not exchange.is_set(STOP) and not orphaned():
            if self._plan.every_turn and self._behind():
                time.sleep(FULL_QUEUE_WAIT)
                continue
            try:
                read = link.receive(Deadline.after(LONGEST_READ_WAIT))
            except UnpluggedError as error:
                state.ended, state.message = "unplugged", str(error)
                state.away.setdefault(0, time.time())
                return
            if read is None:
                state.ended = "end"
                return
            if read.data or read.event:
                self._look(link)
                self._pass_or_decode(read)
                self.take(read)

    def _pass_or_decode(self, read: Read) -> None:
        """Leave the decoding out when reads have waited too long, and go on when they have not."""
        if self._plan.every_turn or not self._plan.apart:
            return
        late = 1e-9 * (time.monotonic_ns() - read.arrival)
        if late > (CAUGHT_UP if self.state.passing else TOO_LATE):
            if not self.state.passing:
                self.take(Read(read.arrival, b"", PASSED, read.source))
        elif self.state.passing:
            self.take(Read(read.arrival, b"", DECODED, read.source))

    def take(self, read: Read) -> None:
        """Hand a read to the recorder, decode it, and hand its samples to the estimators.

        The state is published last: whatever happens before, a reader after this one finds the read
        in the queue and does the rest of it (`catch_up`).
        """
        found = self._record(read)
        messages = self._decoded(read)
        if not found:
            self.publish()  # before the samples: what is missing then shows as a hole, never twice
        for slot, message in messages:
            self._exchange.samples[slot].put(message)
            if self._plan.strain:
                self._exchange.strain.put(message)
        for slot in {slot for slot, _ in messages}:
            self._fresh[slot].release()
        self.publish()
        if read.event:
            self._exchange.address.news.release()

    def publish(self) -> None:
        """Let the run, and a reader after this one, see how the line is."""
        state, exchange = self.state, self._exchange
        state.raw = exchange.raw.written
        state.samples = tuple(queue.written for queue in self._queues)
        state.cpu, state.tries = time.process_time(), 0
        exchange.line.put(pickle.dumps(state, 5))
        if not self._plan.recorded:
            exchange.raw.go_to(state.raw)  # nobody else takes them up

    def catch_up(self) -> None:
        """Do what a reader before this one has recorded and not done, or not to the end.

        What has ended `TRIES` readers is left alone.
        """
        exchange, state = self._exchange, self.state
        state.tries += 1
        exchange.line.put(pickle.dumps(state, 5))
        exchange.raw.cursor = state.raw if state.tries <= TRIES else exchange.raw.written
        for queue, cursor in zip(self._queues, state.samples, strict=True):
            queue.cursor = cursor
        while (recorded := exchange.raw.read()) is not None:
            read: Read = pickle.loads(recorded)
            for slot, message in self._decoded(read):
                _hand_over(exchange.samples[slot], message)
                if self._plan.strain:
                    _hand_over(exchange.strain, message)
        for fresh in self._fresh:
            fresh.release()
        self.publish()

    def _decoded(self, read: Read) -> list[tuple[int, bytes]]:
        """Return what a read brings, for the slot of each wheel."""
        state = self.state
        state.newest[read.source] = read.arrival
        if read.event in (BACK, RESUMED):
            state.wheels.interrupt(read.source)
        if read.event in (PASSED, DECODED):
            state.passing = read.event == PASSED
            state.wheels.forget()
        if read.event == LOST:
            state.away[read.source] = time.time()
        elif read.event == BACK or read.data:
            state.away.pop(read.source, None)
        if not read.data:
            return []
        state.heard, state.last_byte = time.time(), time.monotonic()
        if state.passing:
            state.passed += len(read.data)
            return []
        blocks = state.wheels.push(read.data, read.arrival, read.source)
        if self._plan.estimated:
            blocks = state.wheels.agreeing(blocks)
        slots = {wheel: slot for slot, wheel in enumerate(state.wheels.heard)}
        return [(slots[block.wheel], block.pack()) for block in blocks]

    def _record(self, read: Read) -> bool:
        """Put a read into the queue of the recorder; False if there is no room for it."""
        raw = self._exchange.raw
        if self._raw_lost:
            loss = Read(read.arrival, b"", f"{RAW_LOST}{self._raw_lost}", read.source)
            if not raw.put(pickle.dumps(loss, 5)):
                self._raw_lost += len(read.data)
                return False
            self._raw_lost = 0
        if not raw.put(pickle.dumps(read, 5)):
            self._raw_lost += len(read.data)
            return False
        return True

    def _behind(self) -> bool:
        """Tell whether a queue is half full: what a read brings has room in the other half.

        A recorder that cannot write is not waited for.
        """
        exchange = self._exchange
        if max(queue.waiting for queue in exchange.samples) > exchange.address.samples // 2:
            return True
        if exchange.raw.waiting <= RAW // 2:
            return False
        recorded = exchange.recorded.get()
        return recorded is None or not pickle.loads(recorded).error

    def _look(self, link: Link) -> None:
        """Count the overruns of the ports since they were last asked, once a second."""
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + 1.0
        now_seen = link.port_overruns() if isinstance(link, GatheredLink) else [link.overruns()]
        seen, self._overruns = self._overruns or now_seen, now_seen
        for line, before, after in zip(self.state.wheels.lines, seen, now_seen, strict=True):
            line.decoder.counts.overruns += after - before


def _hand_over(queue: ByteQueue, message: bytes) -> None:
    """Put a message into a queue unless a reader before this one did."""
    before = queue.cursor
    handed_over = queue.read()
    if handed_over is None:
        queue.put(message)
        queue.cursor = queue.written
    elif handed_over != message:  # there was no room for it, and it stays out
        queue.cursor = before
