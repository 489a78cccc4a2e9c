"""Frames of a CAN bus in a numpy batch, and their bytes as a recording holds them.

A packed batch is one byte with the size of a record (16 or 72) and the records: the layouts
``can_frame`` and ``canfd_frame`` of Linux, little-endian: identifier u32 (bit 31: extended), length
u8, flags u8 (bit 2: CAN FD, bit 0: bit-rate switch), 2 bytes of nothing, data.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirebench.wire.frames import IntArray
from tirelib.core.arrays import BoolArray

ByteArray = npt.NDArray[np.uint8]

EXTENDED = 0x80000000
REMOTE_OR_ERROR = 0x60000000
FD, BIT_RATE_SWITCH = 4, 1
CLASSIC_SIZE, FD_SIZE = 16, 72
FD_LENGTHS = np.array([*range(9), 12, 16, 20, 24, 32, 48, 64])
"""Data bytes for each length code."""


@dataclass(frozen=True, slots=True, eq=False)
class CanBatch:
    """Data frames in the order of the bus; arrays of shape (m,).

    Attributes
    ----------
    identifier, length : int arrays
    extended, fd : bool arrays
        29 bits of identifier; CAN FD.
    data : uint8 array, shape (m, 8) or (m, 64)
        Zero beyond a frame's length.
    """

    identifier: IntArray
    extended: BoolArray
    fd: BoolArray
    length: IntArray
    data: ByteArray

    def __len__(self) -> int:
        return int(self.identifier.shape[0])

    def take(self, rows: npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> "CanBatch":
        """Return some of the frames."""
        return CanBatch(*(getattr(self, name)[rows] for name in CanBatch.__slots__))


def same_kind(identifier: npt.ArrayLike, data: ByteArray, *, fd: bool) -> CanBatch:
    """Return a batch of frames with 11-bit identifiers that all fill their data bytes.

    Parameters
    ----------
    identifier : int array, shape (m,), or one for all
    data : uint8 array, shape (m, n)
    """
    m, n = data.shape
    width = 8 if n <= 8 else 64
    padded = np.zeros((m, width), np.uint8)
    padded[:, :n] = data
    return CanBatch(
        identifier=np.broadcast_to(np.asarray(identifier, np.int64), (m,)),
        extended=np.zeros(m, np.bool_),
        fd=np.full(m, fd),
        length=np.full(m, n, np.int64),
        data=padded,
    )


def joined(batches: list[CanBatch]) -> CanBatch:
    """Return several batches as one, in their order."""
    if len(batches) == 1:
        return batches[0]
    if not batches:
        empty = np.zeros(0, np.int64)
        return CanBatch(empty, empty > 0, empty > 0, empty, np.zeros((0, 8), np.uint8))
    width = max(batch.data.shape[1] for batch in batches)
    return CanBatch(
        identifier=np.concatenate([batch.identifier for batch in batches]),
        extended=np.concatenate([batch.extended for batch in batches]),
        fd=np.concatenate([batch.fd for batch in batches]),
        length=np.concatenate([batch.length for batch in batches]),
        data=np.concatenate(
            [np.pad(b.data, ((0, 0), (0, width - b.data.shape[1]))) for b in batches]
        ),
    )


def _record(width: int) -> np.dtype[np.void]:
    return np.dtype(
        [
            ("identifier", "<u4"),
            ("length", "u1"),
            ("flags", "u1"),
            ("pad", "<u2"),
            ("data", "u1", (width,)),
        ]
    )


_RECORDS = {CLASSIC_SIZE: _record(8), FD_SIZE: _record(64)}


def pack(batch: CanBatch) -> bytes:
    """Return the bytes of a batch, see the head of this module."""
    width = batch.data.shape[1]
    records = np.zeros(len(batch), _record(width))
    records["identifier"] = batch.identifier | np.where(batch.extended, EXTENDED, 0)
    records["length"] = batch.length
    records["flags"] = np.where(batch.fd, FD | BIT_RATE_SWITCH, 0)
    records["data"] = batch.data
    return bytes([width + 8]) + records.tobytes()


def unpack(packed: bytes) -> CanBatch | None:
    """Return the batch that `pack` packed; None if these bytes are none."""
    if not packed or packed[0] not in _RECORDS or (len(packed) - 1) % packed[0]:
        return None
    records = np.frombuffer(packed, _RECORDS[packed[0]], offset=1)
    if (records["length"] > packed[0] - 8).any():
        return None
    records = records[(records["identifier"] & REMOTE_OR_ERROR) == 0]
    return CanBatch(
        identifier=(records["identifier"] & 0x1FFFFFFF).astype(np.int64),
        extended=(records["identifier"] & EXTENDED) != 0,
        fd=(records["flags"] & FD) != 0,
        length=records["length"].astype(np.int64),
        data=records["data"],
    )
