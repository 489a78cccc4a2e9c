"""Shared memory between two processes: a queue of messages, and a cell that holds the newest one.

Both have one writer and one reader and never wait. What a reader has taken up is written down in
the memory itself, so that a process that is started again goes on where the last one was.
"""

import math
import os
import struct
import zlib
from multiprocessing.shared_memory import SharedMemory

from tirebench.errors import LinkError
from tirebench.owned import SHARED, shared_name

_CONTROL = 64
"""Bytes before the messages: numbers of 8 bytes each."""
_WRITTEN, _TAKEN, _HIGH, _REFUSED, _REFUSED_BYTES = range(5)
_RECORD = struct.Struct("<IIQ")
"""Before each message: length, CRC-32, number of the message's first byte."""
_SKIP = 0xFFFFFFFF
"""A length that means: the rest of the memory is left out, go on at its start."""


def free() -> float:
    """Return the free shared memory, [bytes]; infinite where the system does not report it."""
    if not SHARED.is_dir():
        return math.inf
    state = os.statvfs(SHARED)
    return float(state.f_bavail * state.f_frsize)


def memory(size: int) -> SharedMemory:
    """Return new shared memory.

    Raises
    ------
    LinkError
        If there is not enough of it; to run out later would kill the process that writes.
    """
    if free() < size:
        raise too_little(size)
    return SharedMemory(shared_name(), create=True, size=size)


def too_little(size: float) -> LinkError:
    """Return the error about missing shared memory."""
    return LinkError(
        f"{SHARED}: {free() / 2**20:.0f} MB of shared memory are free; {size / 2**20:.0f} MB are "
        "needed; give a container more (--shm-size), estimate fewer wheels with --wheel, or leave "
        "out the page (--no-page)"
    )


class ByteQueue:
    """A bounded queue of messages: what does not fit is refused and counted, none is overwritten.

    Attributes
    ----------
    cursor : int
        First byte that the reader has not read yet.
    """

    def __init__(self, view: memoryview) -> None:
        self._control = view[:_CONTROL].cast("Q")  # written whole, in one store
        self._data = view[_CONTROL:]
        self._size = len(self._data)
        self.cursor = self._control[_TAKEN]

    @property
    def refused(self) -> tuple[int, int]:
        """Messages that did not fit, and their bytes."""
        return self._control[_REFUSED], self._control[_REFUSED_BYTES]

    @property
    def high(self) -> int:
        """The most bytes that have waited."""
        return self._control[_HIGH]

    @property
    def written(self) -> int:
        """Where the next message will stand."""
        return self._control[_WRITTEN]

    @property
    def waiting(self) -> int:
        """Bytes that the reader has not taken up."""
        return self._control[_WRITTEN] - self._control[_TAKEN]

    def put(self, message: bytes) -> bool:
        """Add a message; False if there is no room for it."""
        written, need = self._control[_WRITTEN], _stride(len(message))
        left = self._size - written % self._size
        skipped = left if left < need else 0
        waiting = written + skipped + need - self._control[_TAKEN]
        if waiting > self._size:
            self._control[_REFUSED] += 1
            self._control[_REFUSED_BYTES] += len(message)
            return False
        if skipped >= _RECORD.size:
            _RECORD.pack_into(self._data, written % self._size, _SKIP, 0, written)
        place = (written + skipped) % self._size
        start = place + _RECORD.size
        self._data[start : start + len(message)] = message
        _RECORD.pack_into(self._data, place, len(message), zlib.crc32(message), written + skipped)
        self._control[_WRITTEN] = written + skipped + need
        self._control[_HIGH] = max(self._control[_HIGH], waiting)
        return True

    def read(self) -> bytes | None:
        """Return the next message; None if there is none. It waits until `take`."""
        while self.cursor != self._control[_WRITTEN]:
            place = self.cursor % self._size
            left = self._size - place
            if left < _RECORD.size:
                self.cursor += left
                continue
            length, crc, number = _RECORD.unpack_from(self._data, place)
            if number != self.cursor:
                return None  # not visible yet
            if length == _SKIP:
                self.cursor += left
                continue
            start = place + _RECORD.size
            message = bytes(self._data[start : start + length])
            if zlib.crc32(message) != crc:
                return None
            self.cursor += _stride(length)
            return message
        return None

    def take(self) -> None:
        """Give back the room of what was read: it will not be read again."""
        self._control[_TAKEN] = self.cursor

    def go_to(self, cursor: int) -> None:
        """Take up everything before a place, unless that was done already."""
        self.cursor = max(self._control[_TAKEN], min(cursor, self._control[_WRITTEN]))
        self.take()

    def close(self) -> None:
        """Let go of the memory."""
        self._control.release()
        self._data.release()


class Cell:
    """Holds the newest message; one that is being written is never seen.

    A message is written beside the last one, and then declared the newest.
    """

    def __init__(self, view: memoryview) -> None:
        self._control = view[:_CONTROL].cast("Q")
        self._data = view[_CONTROL:]
        self._room = len(self._data) // 2

    def put(self, message: bytes) -> bool:
        """Replace the message; False if it is too long."""
        if len(message) + _RECORD.size > self._room:
            return False
        version = self._control[0] + 1
        place = version % 2 * self._room
        start = place + _RECORD.size
        self._data[start : start + len(message)] = message
        _RECORD.pack_into(self._data, place, len(message), zlib.crc32(message), version)
        self._control[0] = version
        return True

    def get(self) -> bytes | None:
        """Return the newest message; None before the first."""
        while version := self._control[0]:
            place = version % 2 * self._room
            length, crc, number = _RECORD.unpack_from(self._data, place)
            start = place + _RECORD.size
            message = bytes(self._data[start : start + length])
            if number == version and zlib.crc32(message) == crc:
                return message
        return None

    def close(self) -> None:
        """Let go of the memory."""
        self._control.release()
        self._data.release()


def _stride(length: int) -> int:
    return (_RECORD.size + length + 7) // 8 * 8
