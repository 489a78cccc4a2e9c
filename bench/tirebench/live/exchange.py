"""The shared memory of a run: one queue or cell for each way that something passes."""

from dataclasses import dataclass
from multiprocessing.context import SpawnContext
from multiprocessing.shared_memory import SharedMemory
from typing import Any

from tirebench.live.rings import ByteQueue, Cell, free, memory, too_little
from tirebench.owned import name_semaphores, sweep

RAW = 8 * 2**20
"""Reads that wait for the recorder, [bytes]: a minute of one wheel, 9 s of four on CAN FD."""
STRAIN, RESULTS = 4 * 2**20, 2**19
"""Decoded samples and turns that wait for the recorder, [bytes]: 2 s of four wheels at 10 kHz. What
does not fit is missing beside the raw bytes, which hold it."""
SAMPLE_BYTES, LEAST_SAMPLE_BYTES = 27 * 2**18, 2**21
"""Samples of a wheel that wait for its estimator, [bytes]: 13 s at 10 kHz; 4 s where memory is
short, which is more than the age at which samples are left out."""
PORT, PORT_STATE = 2**22, 2**13
"""Reads of one port of several that wait for the reader, [bytes], and how the port is."""
NEWS = 2**20
ORDERS = 2**18
LINE = 2**20
STATE = 2**16
_STOP = 64
STOP, FINISH = 0, 1
"""Flags: the reader is to end; estimators are to end when nothing is left."""


@dataclass(frozen=True, slots=True)
class Address:
    """What a process needs to take part.

    Attributes
    ----------
    name : str
        Name of the shared memory.
    slots : int
        Wheels that there is room for.
    fresh : tuple of semaphores
        Released for each slot when samples came.
    news : semaphore
        Released when an estimator has news, or the line an event.
    samples : int
        Bytes of each queue of samples.
    ports : int
        Processes that read a port each, where there are several.
    came : semaphore
        Released when one of them has something.
    """

    name: str
    slots: int
    fresh: tuple[Any, ...]
    news: Any
    samples: int
    ports: int = 0
    came: Any = None


class Exchange:
    """The memory, cut into its parts; a context manager that gives it back.

    Parameters
    ----------
    address : Address
        Address of existing memory; without it new memory is made.
    owner : bool
        Whether the memory ends with this object.

    Attributes
    ----------
    raw : ByteQueue
        Reads, from the reader to the recorder.
    strain, results : ByteQueue
        Blocks from the reader and turns from the run, to the recorder.
    orders : ByteQueue
        From the run to the recorder.
    samples, news : tuple of ByteQueue
        Queues for each slot: blocks to the estimator, reports to the run.
    line, recorded : Cell
        State of the reader and of the recorder.
    reads : tuple of ByteQueue
        Queues from each port to the reader, where there are several ports.
    ports : tuple of Cell
        How each of them is.
    """

    def __init__(self, address: Address, shared: SharedMemory | None = None) -> None:
        self.address = address
        self._owner = shared is not None
        self._shared = SharedMemory(address.name) if shared is None else shared
        buffer = self._shared.buf
        if buffer is None:
            raise ValueError("the memory is closed")
        self._views: list[memoryview] = []
        place = 0

        def part(size: int) -> memoryview:
            nonlocal place
            self._views.append(buffer[place : place + size])
            place += size
            return self._views[-1]

        self._flags = part(_STOP).cast("Q")
        self.raw, self.orders = ByteQueue(part(RAW)), ByteQueue(part(ORDERS))
        self.strain, self.results = ByteQueue(part(STRAIN)), ByteQueue(part(RESULTS))
        self.line, self.recorded = Cell(part(LINE)), Cell(part(STATE))
        slots = range(address.slots)
        self.samples = tuple(ByteQueue(part(address.samples)) for _ in slots)
        self.news = tuple(ByteQueue(part(NEWS)) for _ in slots)
        ports = range(address.ports)
        self.reads = tuple(ByteQueue(part(PORT)) for _ in ports)
        self.ports = tuple(Cell(part(PORT_STATE)) for _ in ports)

    @classmethod
    def create(
        cls, context: SpawnContext, slots: int, beside: int = 0, ports: int = 0
    ) -> "Exchange":
        """Make the memory; where it is short, the queues of samples are.

        Parameters
        ----------
        context : SpawnContext
        slots : int
        beside : int
            What others will need after this, [bytes].
        ports : int
            Number of ports that are read by separate processes; 0 where there is one port.

        Raises
        ------
        LinkError
            If there is not enough for the shortest queues.
        """
        sweep()
        name_semaphores()
        fixed = _STOP + RAW + ORDERS + STRAIN + RESULTS + LINE + STATE + slots * NEWS
        fixed += ports * (PORT + PORT_STATE)
        room = (free() - fixed - beside) / slots
        if room < LEAST_SAMPLE_BYTES:
            raise too_little(fixed + slots * LEAST_SAMPLE_BYTES + beside)
        samples = int(min(SAMPLE_BYTES, room)) // 64 * 64
        shared = memory(fixed + slots * samples)
        fresh = tuple(context.Semaphore(0) for _ in range(slots))
        address = Address(
            shared.name, slots, fresh, context.Semaphore(0), samples, ports, context.Semaphore(0)
        )
        return cls(address, shared)

    def is_set(self, flag: int) -> bool:
        """Whether the run has set a flag."""
        return bool(self._flags[flag])

    def set(self, flag: int) -> None:
        """Set a flag."""
        self._flags[flag] = 1

    def close(self) -> None:
        """Let go of the memory; its maker removes it. Calling twice does no harm."""
        for queue in (
            self.raw,
            self.orders,
            self.strain,
            self.results,
            *self.samples,
            *self.news,
            *self.reads,
        ):
            queue.close()
        for cell in (self.line, self.recorded, *self.ports):
            cell.close()
        self._flags.release()
        for view in self._views:
            view.release()
        self._views.clear()
        self._shared.close()
        if self._owner:
            self._owner = False
            self._shared.unlink()


def woken(signal: Any, timeout: float) -> None:
    """Wait until a semaphore is released, or the time has passed, and forget how often it was."""
    if signal.acquire(timeout=max(timeout, 0.0)):
        while signal.acquire(block=False):
            continue
