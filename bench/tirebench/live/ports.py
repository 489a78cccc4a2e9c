"""Several ports: a process reads each, and a link that gathers what they bring.

Each read is stamped where it comes, on the one monotonic clock of the machine. The reader takes the
reads in the order of that clock, as far as they are there, and records them in the order in which
it took them: that order is what a replay repeats, so nothing waits for a port that is silent.
"""

import pickle
import time
from dataclasses import dataclass

from tirebench import errors
from tirebench.deadline import Deadline
from tirebench.errors import BenchError, UnpluggedError
from tirebench.links import RESUMED, Read
from tirebench.links.opening import PortPlan
from tirebench.links.reconnecting import ReconnectingLink
from tirebench.live.exchange import STOP, Address, Exchange, woken
from tirebench.live.priority import own_share
from tirebench.live.supervised import orphaned, settled

LONGEST_READ_WAIT = 0.1
"""Longest wait for bytes before the process checks whether the run continues, [s]."""
FULL_QUEUE_WAIT = 0.002
"""Wait while the reader's queue is full, [s]."""


@dataclass(slots=True)
class PortState:
    """State of a port.

    Attributes
    ----------
    name : str
        Once it is open, or waited for.
    ended : bool
        Nothing will come any more.
    overruns : int
    cpu : float, [s]
        Time that its process has used.
    gone : str
        Why it is given up, one of several that is still tried; empty if it is not.
    error : tuple of str
        Name of the class and text of an error that ends the run; empty without one.
    """

    name: str = ""
    ended: bool = False
    overruns: int = 0
    cpu: float = 0.0
    gone: str = ""
    error: tuple[str, str] | tuple[()] = ()


def read_source(
    number: int, port: PortPlan, patience: float, wait: float, address: Address
) -> None:
    """Read one port of several until the run ends; the target of the process."""
    exchange = Exchange(address)
    saved = exchange.ports[number].get()
    state: PortState = PortState() if saved is None else pickle.loads(saved)
    again = saved is not None
    state.ended = False
    sender = _Sender(number, exchange, state)
    try:
        link = ReconnectingLink(
            port.open,
            patience,
            state.name or (port.port if wait else ""),
            wait=0.0 if again else wait,
            forever=address.ports > 1,
        )
        state.name = link.name
        if again:
            sender.send(Read(time.monotonic_ns(), b"", RESUMED, number))
        sender.publish()
        settled()
        own_share()
        sender.run(link)
        link.close()
    except BenchError as error:
        state.error = type(error).__name__, str(error)
    state.ended = True
    sender.publish()
    exchange.close()


class _Sender:
    """Hands what a link brings to the reader."""

    def __init__(self, number: int, exchange: Exchange, state: PortState) -> None:
        self._number = number
        self._exchange = exchange
        self._state = state
        self._next_look = 0.0

    def run(self, link: ReconnectingLink) -> None:
        """Go on until the end of the link or of the run."""
        while not self._exchange.is_set(STOP) and not orphaned():
            read = link.receive(Deadline.after(LONGEST_READ_WAIT))
            if read is None:
                return
            if read.data or read.event:
                self.send(read._replace(source=self._number))
            if time.monotonic() > self._next_look or self._state.gone != link.gone:
                self._next_look, self._state.gone = time.monotonic() + 1.0, link.gone
                self._state.overruns = link.overruns()
                self.publish()

    def send(self, read: Read) -> None:
        """Hand a read over; the port waits while the reader has no room for it."""
        message = pickle.dumps(read, 5)
        while not self._exchange.reads[self._number].put(message):
            time.sleep(FULL_QUEUE_WAIT)
            if self._exchange.is_set(STOP) or orphaned():
                return
        self._exchange.address.came.release()

    def publish(self) -> None:
        """Let the reader and the run see how the port is."""
        self._state.cpu = time.process_time()
        self._exchange.ports[self._number].put(pickle.dumps(self._state, 5))
        self._exchange.address.came.release()


class GatheredLink:
    """What the processes of several ports bring; see `tirebench.links.Link`.

    Parameters
    ----------
    exchange : Exchange
    newest : mapping of source to int, [ns]
        Arrival of what a reader before this one took last.

    Raises
    ------
    BenchError
        If a port cannot be opened.
    """

    live, encoding = True, ""

    def __init__(self, exchange: Exchange, newest: dict[int, int]) -> None:
        self._exchange = exchange
        self._newest = newest
        self._taken: int | None = None
        self._next_look = 0.0
        self.name = ""
        while not exchange.is_set(STOP) and not orphaned():
            states = self._states()
            if all(state.name for state in states):
                self.name = " + ".join(state.name for state in states)
                break
            woken(exchange.address.came, LONGEST_READ_WAIT)

    def receive(self, deadline: Deadline) -> Read | None:
        """Return the earliest of the reads that are there, or what has come by the deadline."""
        if self._taken is not None:  # whatever it brought is done
            self._exchange.reads[self._taken].take()
            self._taken = None
        while True:
            if time.monotonic() > self._next_look:
                self._next_look = time.monotonic() + LONGEST_READ_WAIT
                self._states()
            read = self._earliest()
            if read is not None:
                return read
            if deadline.expired:
                return Read(time.monotonic_ns(), b"")
            woken(self._exchange.address.came, deadline.remaining)

    def overruns(self) -> int:
        """Return how often a buffer below was full, all ports together."""
        return sum(self.port_overruns())

    def port_overruns(self) -> list[int]:
        """Return the same of each port."""
        return [state.overruns for state in self._look()]

    def close(self) -> None:
        """Leave the ports to their processes."""

    def _earliest(self) -> Read | None:
        found: tuple[int, int, Read, int] | None = None
        for source, queue in enumerate(self._exchange.reads):
            start = queue.cursor
            while (message := queue.read()) is not None:
                read: Read = pickle.loads(message)
                end = queue.cursor
                if read.arrival > self._newest.get(source, -1):
                    if found is None or (read.arrival, source) < found[:2]:
                        found = read.arrival, source, read, end
                    queue.cursor = start
                    break
                queue.take()  # a reader before this one has done it
                start = end
        if found is None:
            return None
        _, source, read, end = found
        self._exchange.reads[source].cursor = end
        self._taken = source
        return read

    def _states(self) -> list[PortState]:
        """Return the states of the ports.

        Raises
        ------
        BenchError
            That ended one of them.
        UnpluggedError
            If all of them are given up.
        """
        states = self._look()
        for state, queue in zip(states, self._exchange.reads, strict=True):
            if state.error and not queue.waiting:
                kind, text = state.error
                raise getattr(errors, kind)(text)
        waiting = any(queue.waiting for queue in self._exchange.reads)
        if not waiting and all(state.gone for state in states):
            raise UnpluggedError("; ".join(state.gone for state in states))
        return states

    def _look(self) -> list[PortState]:
        found = [cell.get() for cell in self._exchange.ports]
        return [PortState() if one is None else pickle.loads(one) for one in found]
