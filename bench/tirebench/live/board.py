"""What the run shows, in shared memory: rings of messages that one process writes, others read.

A writer never waits and never asks who reads. The newest message wins: a reader that is slow misses
the oldest ones and learns how many. A message has a number and a CRC, so that one that is being
overwritten while it is read counts as missed and never passes for good.
"""

import struct
import time
import zlib
from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory

from tirebench.live.rings import memory

_HEAD = struct.Struct("<Q")
_SLOT = struct.Struct("<QII")
_BEAT = struct.Struct("<dd")
_START = 64
"""Bytes before the first ring: the reader's heartbeat."""


@dataclass(frozen=True, slots=True)
class RingSize:
    """Place of a ring in the board.

    Attributes
    ----------
    slots, room : int
        Messages that are kept, and the bytes of the longest.
    """

    slots: int
    room: int

    @property
    def stride(self) -> int:
        """Bytes of a slot, a multiple of 8."""
        return (_SLOT.size + self.room + 7) // 8 * 8

    @property
    def bytes(self) -> int:
        """Bytes of the ring."""
        return 8 + self.slots * self.stride


RINGS = {
    "turns": RingSize(6144, 3072),  # 110 s of four wheels at 14 turns a second
    "laps": RingSize(320, 32_768),  # 80 turns of each of four wheels
    "state": RingSize(8, 32_768),
}
"""Estimates and samples of each turn, and the state of the line."""
SIZE = _START + sum(ring.bytes for ring in RINGS.values())
"""Size of a board, [bytes]."""


class Board:
    """The shared memory; a context manager that gives it back.

    Parameters
    ----------
    name : str, optional
        Name of an existing board; without it a new one is made.

    Attributes
    ----------
    name : str
    turns, laps, state : Ring
    """

    def __init__(self, name: str | None = None) -> None:
        self._owner = name is None
        self._memory = memory(SIZE) if name is None else SharedMemory(name)
        self.name = self._memory.name
        place, rings = _START, {}
        for ring, size in RINGS.items():
            rings[ring] = Ring(self._memory, place, size)
            place += size.bytes
        self.turns, self.laps, self.state = rings["turns"], rings["laps"], rings["state"]
        if self._owner:
            self.beat()

    def beat(self, grace: float = 0.0) -> None:
        """Note that the reader is alive, or will be after a time of grace [s]."""
        used = 0.0 if self._owner else time.process_time()
        _BEAT.pack_into(_view(self._memory), 0, time.monotonic() + grace, used)

    @property
    def cpu_time(self) -> float:
        """Time that the process that showed the last sign of life had used, [s]."""
        return float(_BEAT.unpack_from(_view(self._memory), 0)[1])

    @property
    def silence(self) -> float:
        """Time since the reader's last sign of life, [s]."""
        return time.monotonic() - float(_BEAT.unpack_from(_view(self._memory), 0)[0])

    def close(self) -> None:
        """Give the memory back; its maker removes it. Calling twice does no harm."""
        self._memory.close()
        if self._owner:
            self._owner = False
            self._memory.unlink()

    def __enter__(self) -> "Board":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Ring:
    """A ring of messages in shared memory, with one writer.

    Attributes
    ----------
    refused : int
        Messages that were too long for a slot.
    """

    def __init__(self, memory: SharedMemory, place: int, size: RingSize) -> None:
        self.refused = 0
        self.size = size
        self._memory = memory
        self._place = place

    @property
    def written(self) -> int:
        """Messages so far."""
        return int(_HEAD.unpack_from(_view(self._memory), self._place)[0])

    def put(self, message: bytes) -> bool:
        """Write a message over the oldest one; False if it is too long."""
        if len(message) > self.size.room:
            self.refused += 1
            return False
        number = self.written
        slot = self._slot(number)
        buffer = _view(self._memory)
        _SLOT.pack_into(buffer, slot, number + 1, len(message), zlib.crc32(message))
        buffer[slot + _SLOT.size : slot + _SLOT.size + len(message)] = message
        _HEAD.pack_into(buffer, self._place, number + 1)
        return True

    def get(self, number: int) -> bytes | None:
        """Return message `number`, counted from 0; None if it is overwritten."""
        slot = self._slot(number)
        buffer = _view(self._memory)
        mark, length, crc = _SLOT.unpack_from(buffer, slot)
        if mark != number + 1 or length > self.size.room:
            return None
        message = bytes(buffer[slot + _SLOT.size : slot + _SLOT.size + length])
        return message if zlib.crc32(message) == crc else None

    def _slot(self, number: int) -> int:
        return self._place + 8 + number % self.size.slots * self.size.stride


class RingReader:
    """Read a ring from its oldest message on.

    Attributes
    ----------
    missed : int
        Messages that were overwritten before they were read.
    """

    def __init__(self, ring: Ring, newest: int | None = None) -> None:
        self.missed = 0
        self._ring = ring
        kept = ring.size.slots if newest is None else newest
        self._next = max(0, ring.written - kept)

    def take(self) -> list[bytes]:
        """Return what is new, in order."""
        written = self._ring.written
        first = max(self._next, written - self._ring.size.slots)
        messages = [self._ring.get(number) for number in range(first, written)]
        good = [message for message in messages if message is not None]
        self.missed += written - self._next - len(good)
        self._next = written
        return good


def _view(memory: SharedMemory) -> memoryview:
    buffer = memory.buf
    if buffer is None:
        raise ValueError("the board is closed")
    return buffer
