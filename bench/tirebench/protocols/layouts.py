"""Data bytes of the CAN frames of a wheel transmitter, in numpy batches. Pure.

========  ==============  =====  ==============================================================
frame     identifier      bytes  data
========  ==============  =====  ==============================================================
RAW16     0x120 + wheel   64 FD  6 x 5 x i16, seq u8, t_us u24
RAW12     0x128 + wheel   64 FD  8 x 5 x 12 bits signed, packed LSB first, seq u8, t_us u24
RAW12C    0x120 + wheel   8      counter 4 bits, 5 x 12 bits signed, big-endian
SYNC      0x130 + wheel   8      sample index u32, t_us u32: number and time of the next sample
HEALTH    0x138 + wheel   8      radio lost u16, rssi i8, temp i8, battery u8, pressure u8, flags
========  ==============  =====  ==============================================================

All little-endian but RAW12C. Samples stand oldest first, gages in the order of the calibration.
`t_us` is the device time of the first sample [us]. Twelve bits are the upper twelve of sixteen:
one device file fits both, a count of RAW12 is 16 of RAW16, and an end of the range stays
the end of the range.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from tirebench.wire.can_batch import ByteArray
from tirebench.wire.frames import GAGES, HIGHEST, Int16Array, IntArray

WHEELS = 8
"""Number of wheels that have identifiers of their own."""
STEP12 = 16
"""Counts of RAW16 in one of RAW12."""
RAW16, RAW12, RAW12C, SYNC, HEALTH = "RAW16", "RAW12", "RAW12C", "SYNC", "HEALTH"
SEQ_RANGE, TIME_RANGE = 2**8, 2**24
COUNTER_RANGE = 16


@dataclass(frozen=True, slots=True)
class Layout:
    """One kind of frame.

    Attributes
    ----------
    base : int
        Identifier of wheel 0.
    length : int
        Data bytes.
    fd : bool
    samples : int
        Samples of each gage in a frame; 0 for a frame without strain.
    """

    base: int
    length: int
    fd: bool
    samples: int


LAYOUTS: Mapping[str, Layout] = MappingProxyType(
    {
        RAW16: Layout(0x120, 64, True, 6),
        RAW12: Layout(0x128, 64, True, 8),
        RAW12C: Layout(0x120, 8, False, 1),
        SYNC: Layout(0x130, 8, False, 0),
        HEALTH: Layout(0x138, 8, False, 0),
    }
)
_TAIL = [("seq", "u1"), ("t", "u1", (3,))]
_RAW16 = np.dtype([("counts", "<i2", (6, GAGES)), *_TAIL])
_RAW12 = np.dtype([("packed", "u1", (20, 3)), *_TAIL])
_SYNC = np.dtype([("index", "<u4"), ("t_us", "<u4")])
_HEALTH = np.dtype(
    [
        ("lost", "<u2"),
        ("rssi", "i1"),
        ("temperature", "i1"),
        ("battery", "u1"),
        ("pressure", "u1"),
        ("flags", "<u2"),
    ]
)
_PLACES = np.arange(48, -1, -12).astype(np.uint64)


@dataclass(frozen=True, slots=True, eq=False)
class Raw:
    """Strain frames of one wheel: number and time as sent, counts of shape (m, n, 5)."""

    seq: IntArray
    t_us: IntArray
    counts: Int16Array


@dataclass(frozen=True, slots=True)
class Health:
    """State that a wheel sends about itself, SI unless stated otherwise.

    Attributes
    ----------
    radio_lost : int
        Frames that the radio lost, wraps at 65536.
    rssi : int, [dBm]
    temperature : int, [degC]
    battery : float, [V]
    pressure : float, [Pa]
        Gauge; 0.02 bar a step.
    flags : int
        Flags of the frame as in SERIAL v1, bits of `tirebench.wire.frames.FrameFlag`.
    """

    radio_lost: int = 0
    rssi: int = -50
    temperature: int = 30
    battery: float = 3.6
    pressure: float = 0.0
    flags: int = 0


BATTERY_STEP = 0.02
"""[V]"""
PRESSURE_STEP = 2000.0
"""[Pa]"""


def encode_raw16(raw: Raw) -> ByteArray:
    """Return data bytes, shape (m, 64)."""
    records = np.zeros(len(raw.seq), _RAW16)
    records["counts"] = raw.counts
    _write_tail(records, raw)
    return _bytes(records, 64)


def decode_raw16(data: ByteArray) -> Raw:
    """Return what data bytes of shape (m, 64) hold."""
    records = _records(data, _RAW16)
    return Raw(*_tail(records), records["counts"].astype(np.int16))


def encode_raw12(raw: Raw) -> ByteArray:
    """Return data bytes, shape (m, 64); counts are rounded to the step of twelve bits."""
    records = np.zeros(len(raw.seq), _RAW12)
    pairs = to_twelve(raw.counts).reshape(-1, 20, 2) & 0xFFF
    first, second = pairs[..., 0], pairs[..., 1]
    records["packed"][..., 0] = first & 0xFF
    records["packed"][..., 1] = first >> 8 | (second & 0xF) << 4
    records["packed"][..., 2] = second >> 4
    _write_tail(records, raw)
    return _bytes(records, 64)


def decode_raw12(data: ByteArray) -> Raw:
    """Return what data bytes of shape (m, 64) hold, in counts of sixteen bits."""
    records = _records(data, _RAW12)
    low, middle, high = (records["packed"][..., i].astype(np.uint16) for i in range(3))
    pairs = np.stack((low | (middle & 0xF) << 8, middle >> 4 | high << 4), axis=-1)
    return Raw(*_tail(records), _from_twelve(pairs.reshape(-1, 8, GAGES)))


def encode_raw12c(counter: IntArray, counts: Int16Array) -> ByteArray:
    """Return data bytes, shape (m, 8), of single samples; counts of shape (m, 5)."""
    word = (np.asarray(counter).astype(np.uint64) % COUNTER_RANGE) << np.uint64(60)
    twelve = (to_twelve(counts) & 0xFFF).astype(np.uint64)
    word |= np.bitwise_or.reduce(twelve << _PLACES, axis=1)
    return np.frombuffer(word.astype(">u8").tobytes(), np.uint8).reshape(-1, 8)


def decode_raw12c(data: ByteArray) -> tuple[IntArray, Int16Array]:
    """Return counter and counts (of sixteen bits) of data bytes of shape (m, 8)."""
    word = np.frombuffer(np.ascontiguousarray(data[:, :8]).tobytes(), ">u8").astype(np.uint64)
    counts = word[:, None] >> _PLACES & np.uint64(0xFFF)
    return (word >> np.uint64(60)).astype(np.int64), _from_twelve(counts.astype(np.uint16))


def encode_sync(index: npt.ArrayLike, t_us: npt.ArrayLike) -> ByteArray:
    """Return data bytes, shape (m, 8): number and device time of the sample that comes next."""
    records = np.zeros(np.shape(index), _SYNC)
    records["index"] = np.asarray(index, np.int64) % 2**32
    records["t_us"] = np.asarray(t_us, np.int64) % 2**32
    return _bytes(records, 8)


def decode_sync(data: ByteArray) -> tuple[IntArray, IntArray]:
    """Return index and t_us."""
    records = _records(data, _SYNC)
    return records["index"].astype(np.int64), records["t_us"].astype(np.int64)


def encode_health(health: Health) -> ByteArray:
    """Return data bytes, shape (1, 8).

    Raises
    ------
    OverflowError
        If a value does not fit its field.
    """
    record = np.zeros(1, _HEALTH)
    record["lost"] = health.radio_lost % 2**16
    record["rssi"], record["temperature"] = health.rssi, health.temperature
    record["battery"] = round(health.battery / BATTERY_STEP)
    record["pressure"] = round(health.pressure / PRESSURE_STEP)
    record["flags"] = health.flags
    return _bytes(record, 8)


def decode_health(data: ByteArray) -> Health:
    """Return what one frame of shape (8,) or longer says."""
    record = _records(data[None, :], _HEALTH)[0]
    return Health(
        int(record["lost"]),
        int(record["rssi"]),
        int(record["temperature"]),
        int(record["battery"]) * BATTERY_STEP,
        int(record["pressure"]) * PRESSURE_STEP,
        int(record["flags"]),
    )


def to_twelve(counts: Int16Array) -> Int16Array:
    """Return counts in twelve bits, rounded; only an end of the range becomes one.

    Examples
    --------
    >>> to_twelve(np.array([0, 8, -9, 32766, 32767, -32767, -32768], np.int16)).tolist()
    [0, 0, -1, 2046, 2047, -2047, -2048]
    """
    rounded = np.rint(counts / STEP12)
    inside = np.clip(rounded, -2047, 2046)  # a sound count stays apart from the mark
    ends = np.where(counts == HIGHEST, 2047, np.where(counts == -32768, -2048, inside))
    return ends.astype(np.int16)


def _from_twelve(twelve: npt.NDArray[np.uint16]) -> Int16Array:
    """Return twelve bits as counts of sixteen, the upper end as the upper end."""
    counts = (twelve << 4).astype(np.int16)
    counts[twelve == 0x7FF] = HIGHEST
    return counts


def _write_tail(records: npt.NDArray[np.void], raw: Raw) -> None:
    records["seq"] = raw.seq % SEQ_RANGE
    t = raw.t_us % TIME_RANGE
    records["t"] = np.stack((t, t >> 8, t >> 16), axis=-1) & 0xFF


def _tail(records: npt.NDArray[np.void]) -> tuple[IntArray, IntArray]:
    t = records["t"].astype(np.int64)
    return records["seq"].astype(np.int64), t[:, 0] | t[:, 1] << 8 | t[:, 2] << 16


def _records(data: ByteArray, layout: np.dtype[np.void]) -> npt.NDArray[np.void]:
    return np.ascontiguousarray(data[:, : layout.itemsize]).view(layout)[:, 0]


def _bytes(records: npt.NDArray[np.void], size: int) -> ByteArray:
    return np.frombuffer(records.tobytes(), np.uint8).reshape(-1, size)
