"""SERIAL v1: the frames of a wheel transmitter on a serial line. Pure, no input or output.

A frame on the wire is COBS and one byte 0x00. Inside, little-endian:

===========  =====  ==========================================================================
field        type   meaning
===========  =====  ==========================================================================
type         u8     1: strain
wheel        u8     number of the wheel
seq          u16    counts frames, wraps
t_us         u32    device time of the first sample [us], wraps after 71.6 min
period       u16    sample period [0.1 us]
n            u8     samples in the frame
flags        u8     bit 0 .. 4 gage saturated, 5 low battery, 6 time reset, 7 radio loss
rssi         i8     [dBm]
temperature  i8     [degC]
counts       i16    n x 5, oldest sample first; +32767 and -32768 mean saturated
crc          u32    CRC-32 (zlib) of all before it
===========  =====  ==========================================================================
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag

import numpy as np
import numpy.typing as npt
from cobs import cobs

GAGES, MOST_GAGES = 5, 16
"""Number of gages of the published transmitter, and the largest number of another make's."""
SAMPLES = 16
"""Samples in a full frame."""
STRAIN = 1
"""Type of a frame that holds strain."""
HIGHEST, LOWEST = 32767, -32768
"""Counts that mean: the gage is at an end of its range."""
HEADER = np.dtype(
    [
        ("type", "u1"),
        ("wheel", "u1"),
        ("seq", "<u2"),
        ("t_us", "<u4"),
        ("period", "<u2"),
        ("n", "u1"),
        ("flags", "u1"),
        ("rssi", "i1"),
        ("temperature", "i1"),
    ]
)
TICK = 1e-7
"""Unit of a frame's sample period, [s]."""
LONGEST_FRAME = HEADER.itemsize + 255 * GAGES * 2 + 4
"""Bytes of the longest frame before COBS."""
LONGEST_ON_WIRE = LONGEST_FRAME + LONGEST_FRAME // 254 + 1

Int16Array = npt.NDArray[np.int16]
IntArray = npt.NDArray[np.int64]
CountArray = npt.NDArray[np.int16] | npt.NDArray[np.int32] | npt.NDArray[np.float64]
"""Counts: sixteen bits of our transmitter, up to 32 or real numbers of another make."""


class FrameFlag(IntFlag):
    """Bits of a frame's flags; bit i of the first five is gage i + 1."""

    SATURATED = 0b11111
    LOW_BATTERY = 32
    TIME_RESET = 64
    RADIO_LOSS = 128


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Frames of one length, in the order of the wire; arrays of shape (m,).

    Attributes
    ----------
    wheel, seq, t_us, period, flags, rssi, temperature : int arrays
        As the header has them, `period` in ticks of 0.1 us; an `rssi` of 0 is not known, nor is
        the temperature then.
    counts : int16 or int32 array, shape (m, n, 5)
    """

    wheel: IntArray
    seq: IntArray
    t_us: IntArray
    period: IntArray
    flags: IntArray
    rssi: IntArray
    temperature: IntArray
    counts: CountArray

    def __len__(self) -> int:
        return int(self.seq.shape[0])

    @property
    def samples(self) -> int:
        """Samples in each frame."""
        return int(self.counts.shape[1])


def layout(samples: int) -> np.dtype[np.void]:
    """Return the layout of a frame with this many samples, CRC included."""
    fields = [("header", HEADER), ("counts", "<i2", (samples, GAGES)), ("crc", "<u4")]
    return np.dtype(fields)


def frame_size(samples: int) -> int:
    """Return the bytes of a frame before COBS."""
    return HEADER.itemsize + 2 * GAGES * samples + 4


def encode(frames: Frames) -> list[bytes]:
    r"""Return each frame as its bytes on the wire, delimiter included.

    Examples
    --------
    >>> frames = strain_frames(np.zeros((16, 5), np.int16), period=1000)
    >>> [len(wire) for wire in encode(frames)], len(encode(frames)[0].rstrip(b"\0"))
    ([180], 179)
    """
    records = np.zeros(len(frames), layout(frames.samples))
    header = records["header"]
    header["type"], header["n"] = STRAIN, frames.samples
    for name in ("wheel", "seq", "t_us", "period", "flags", "rssi", "temperature"):
        header[name] = getattr(frames, name)
    records["counts"] = frames.counts
    size = records.dtype.itemsize
    raw = records.tobytes()
    wire = []
    for start in range(0, len(raw), size):
        body = raw[start : start + size - 4]
        wire.append(cobs.encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0")
    return wire


def strain_frames(
    counts: Int16Array,
    *,
    period: int,
    wheel: int = 0,
    seq: int = 0,
    t_us: int = 0,
    flags: int | Sequence[int] = 0,
) -> Frames:
    """Cut counts of shape (m * n, 5) into full frames that follow each other without a gap.

    The samples must fill whole frames of `SAMPLES`, or one shorter frame. `period` is in ticks of
    0.1 us; `t_us` and `seq` are those of the first frame.
    """
    samples = min(SAMPLES, counts.shape[0])
    m = counts.shape[0] // max(samples, 1)
    number = np.arange(m)
    return Frames(
        wheel=np.full(m, wheel),
        seq=(seq + number) % 2**16,
        t_us=(t_us + np.rint(number * samples * period / 10.0).astype(np.int64)) % 2**32,
        period=np.full(m, period),
        flags=np.broadcast_to(np.asarray(flags, np.int64), (m,)),
        rssi=np.full(m, -50),
        temperature=np.full(m, 30),
        counts=np.asarray(counts, np.int16).reshape(m, samples, GAGES),
    )


def select(frames: Frames, rows: slice | npt.NDArray[np.bool_]) -> Frames:
    """Return some of the frames."""
    return Frames(*(getattr(frames, name)[rows] for name in Frames.__slots__))
