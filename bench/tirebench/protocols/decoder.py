"""Bytes of a serial line to frames of SERIAL v1: cut, undo COBS, check CRC-32, in bulk.

A damaged frame is counted and dropped, and the next delimiter starts afresh, so one fault costs one
frame (two if it destroys a delimiter). What comes out depends on the bytes alone, never on how they
are cut into reads: a replay decodes to the same frames and the same counts.
"""

import zlib
from collections.abc import Mapping
from itertools import groupby
from types import MappingProxyType

import numpy as np
from cobs import cobs

from tirebench.protocols.layouts import Health
from tirebench.wire.frames import (
    GAGES,
    HEADER,
    LONGEST_ON_WIRE,
    STRAIN,
    Frames,
    frame_size,
    layout,
)
from tirebench.wire.line_counts import LineCounts

_COUNT_AT = 10  # offset of `n` in the header
_PERIOD_AT = 8  # offset of `period` in the header
SHORTEST_PERIOD = 50
"""Sample period, in ticks of 0.1 us, below which a header is taken as damaged (200 kHz)."""


class SerialDecoder:
    """Take bytes as they come and give frames; memory is bounded.

    The line may be joined in the middle of a frame: a first piece that is no frame is not counted
    as damage.
    """

    health: Mapping[int, Health] = MappingProxyType({})

    def __init__(self) -> None:
        self.counts = LineCounts()
        self._tail = b""
        self._too_long = False
        self._joined = False

    def push(self, data: bytes, arrival: int = 0) -> list[Frames]:
        """Return the frames that `data` completes, in batches of equal length, in order."""
        self.counts.bytes += len(data)
        *pieces, self._tail = (self._tail + data).split(b"\0")
        bodies: list[bytes] = []
        for piece in pieces:
            if self._too_long:
                self._too_long = False
                self._reject("framing")
            elif piece:  # an empty piece is an idle line
                self._take(piece, bodies)
            self._joined = True
        if len(self._tail) > LONGEST_ON_WIRE:
            self._tail, self._too_long = b"", True
        return [_batch(list(group), size) for size, group in groupby(bodies, len)]

    def interrupt(self) -> None:
        """Drop a half frame: the line was interrupted, and is connected again."""
        self._tail, self._too_long, self._joined = b"", False, False

    def _take(self, piece: bytes, bodies: list[bytes]) -> None:
        """Check one piece between delimiters; a good one joins `bodies`."""
        if len(piece) > LONGEST_ON_WIRE:
            self._reject("framing")
            return
        try:
            body = cobs.decode(piece)
        except cobs.DecodeError:
            self._reject("framing")
            return
        if len(body) < HEADER.itemsize + 4:
            self._reject("framing")
        elif zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
            self._reject("crc")
        elif body[0] != STRAIN:
            self.counts.unknown += 1
        elif not _sound(body):
            self._reject("framing")
        else:
            self.counts.ok += 1
            bodies.append(body)

    def _reject(self, counter: str) -> None:
        if self._joined:
            setattr(self.counts, counter, getattr(self.counts, counter) + 1)


def _sound(body: bytes) -> bool:
    """Return whether period, number of samples and length of a strain frame are plausible."""
    period = int.from_bytes(body[_PERIOD_AT : _PERIOD_AT + 2], "little")
    count = body[_COUNT_AT]
    return period >= SHORTEST_PERIOD and count > 0 and len(body) == frame_size(count)


def _batch(bodies: list[bytes], size: int) -> Frames:
    samples = (size - HEADER.itemsize - 4) // (2 * GAGES)
    records = np.frombuffer(b"".join(bodies), layout(samples))
    header = records["header"]
    return Frames(
        **{
            name: header[name].astype(np.int64)
            for name in ("wheel", "seq", "t_us", "period", "flags", "rssi", "temperature")
        },
        counts=records["counts"],
    )
