"""Load of a bus or a serial line for a plan, bit by bit: checksum and stuffing are computed.

Classic CAN (ISO 11898-1): SOF, 11 bits of identifier, RTR, IDE, r0, DLC, data, CRC-15 are stuffed
after five equal bits; then delimiter, ACK, ACK delimiter, EOF 7, intermission 3. CAN FD: SOF to BRS
at the slow rate (17 bits), ESI, DLC and data at the fast one, stuffed likewise; the stuff count
and CRC-21 (CRC-17 to 16 bytes) have fixed stuff bits; from the CRC delimiter on, 13 slow bits.

The mean is that of frames with gage waves and the highest possible number of stuff bits the worst.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tirebench.errors import DeviceError
from tirebench.protocols.layouts import LAYOUTS, RAW12, RAW12C, RAW16
from tirebench.protocols.transmitter import SERIAL, CanTransmitter, Record
from tirebench.wire.can_batch import FD_LENGTHS, CanBatch
from tirebench.wire.frames import GAGES, SAMPLES, frame_size
from tirelib.core.arrays import BoolArray, FloatArray, IntArray

HIGHEST_MEAN = 0.8
"""A bus above this mean load delays its frames."""
CRC15 = 0x4599
HEALTH_RATE, SYNC_RATE = 10.0, 100.0
"""Frames a second and wheel beside the strain."""
SLOW_BITS = 30
"""Bits of a CAN FD frame at the slow rate, without stuffing."""
UART_BITS = 10
"""8N1."""
BUSES = (
    (1_000_000, None),
    (500_000, 2_000_000),
    (500_000, 5_000_000),
    (1_000_000, 5_000_000),
    (1_000_000, 8_000_000),
)
"""Bit rates that are suggested where a plan does not fit."""


@dataclass(frozen=True, slots=True)
class LoadPlan:
    """The traffic that is planned for a line.

    Attributes
    ----------
    kind : str
        ``serial``, RAW16, RAW12 or RAW12C.
    bitrate : int, [bit/s]
        Bit rate of the bus, or baud of the serial line.
    data_bitrate : int or None, [bit/s]
        Bit rate of the data phase of CAN FD; None for classic CAN and serial lines.
    wheels : int
        On this one line.
    rate : float, [Hz]
        Sample rate of the gages.
    """

    kind: str
    bitrate: int
    data_bitrate: int | None
    wheels: int
    rate: float

    @property
    def text(self) -> str:
        """The plan in a line."""
        bus = f"serial {self.bitrate / 1e6:g} Mbaud"
        if self.kind != SERIAL:
            fast = "" if self.data_bitrate is None else f" / {self.data_bitrate / 1e6:g} Mbit/s"
            bus = f"CAN{' FD' if fast else ''} {self.bitrate / 1e3:g} kbit/s{fast}"
        return f"{bus}, {self.kind}, {self.wheels} x {self.rate / 1e3:g} kHz"


@dataclass(frozen=True, slots=True)
class Load:
    """Load of a plan, relative to the capacity of the line.

    Attributes
    ----------
    mean, worst : float
        Load of the strain frames.
    service : float
        Load of HEALTH and SYNC, worst case.
    frames : float, [1/s]
    bits, worst_bits : tuple of float
        Bits of one strain frame at the slow and the fast rate.
    usb : float, [byte/s]
        What an slcan adapter sends to the host; 0 for a serial line.
    """

    mean: float
    worst: float
    service: float
    frames: float
    bits: tuple[float, float]
    worst_bits: tuple[float, float]
    usb: float

    @property
    def fits(self) -> bool:
        """Whether the line carries the plan with some room."""
        return self.mean + self.service <= HIGHEST_MEAN and self.worst + self.service <= 1.0


def load_of(plan: LoadPlan) -> Load:
    """Return the load of a plan.

    Raises
    ------
    DeviceError
        If format and bus do not go together.
    """
    _check(plan)
    if plan.kind == SERIAL:
        frames = plan.wheels * plan.rate / SAMPLES
        bits = float(UART_BITS * (frame_size(SAMPLES) + 2))
        load = frames * bits / plan.bitrate
        return Load(load, load, 0.0, frames, (bits, 0.0), (bits, 0.0), 0.0)
    layout = LAYOUTS[plan.kind]
    frames = plan.wheels * plan.rate / layout.samples
    sample = _frames_of(plan.kind)
    slow, fast = frame_bits(sample)
    mean = float(slow.mean()), float(fast.mean())
    most = worst_bits(layout.length, layout.fd)
    service = HEALTH_RATE + (SYNC_RATE if plan.kind == RAW12C else 0.0)
    return Load(
        mean=frames * _seconds(mean, plan),
        worst=frames * _seconds(most, plan),
        service=plan.wheels * service * worst_bits(8, False)[0] / plan.bitrate,
        frames=frames,
        bits=mean,
        worst_bits=most,
        usb=frames * (6 + 2 * layout.length),
    )


def highest_rate(plan: LoadPlan) -> float:
    """Return the highest sample rate of the gages that fits, [Hz], rounded down to 100 Hz."""
    load = load_of(plan)
    share = min((HIGHEST_MEAN - load.service) / load.mean, (1.0 - load.service) / load.worst)
    return max(0.0, float(np.floor(share * plan.rate / 100.0)) * 100.0)


def suggestions(plan: LoadPlan) -> list[str]:
    """Return plans that would fit instead of a plan, the nearest first."""
    found = []
    rate = highest_rate(plan)
    if rate > 0.0:
        found.append(f"{rate / 1e3:g} kHz sample rate on the same line")
    for wheels in range(plan.wheels - 1, 0, -1):
        fewer = replace(plan, wheels=wheels)
        if load_of(fewer).fits:
            lines = -(-plan.wheels // wheels)
            found.append(f"{lines} lines with {wheels} wheels each")
            break
    if plan.kind == SERIAL:
        needed = load_of(plan).mean * plan.bitrate / HIGHEST_MEAN
        return [*found, f"{needed / 1e6:.2f} Mbaud"]
    for bitrate, data_bitrate in BUSES:
        for kind in (RAW12C,) if data_bitrate is None else (RAW16, RAW12):
            other = LoadPlan(kind, bitrate, data_bitrate, plan.wheels, plan.rate)
            if other != plan and (load := load_of(other)).fits:
                found.append(f"{other.text}: {load.mean:.0%} (worst {load.worst:.0%})")
    return found


def frame_bits(batch: CanBatch) -> tuple[IntArray, IntArray]:
    """Return the bits of each frame at the slow and at the fast rate, intermission included.

    The frames must be of one length and kind; for classic CAN all bits are slow.
    """
    fd = bool(batch.fd[0])
    header = _header(batch)
    data = np.unpackbits(batch.data[:, : int(batch.length[0])], axis=1)
    head = np.concatenate((header, data), axis=1)
    if not fd:
        crc = _crc15(head)
        stuffed = _stuff_bits(np.concatenate((head, crc), axis=1))
        slow = head.shape[1] + 15 + stuffed.sum(axis=1) + 13
        return slow, np.zeros_like(slow)
    stuffed = _stuff_bits(head)
    # a stuff bit after BRS is fast already
    slow = SLOW_BITS + stuffed[:, :16].sum(axis=1)
    fast = head.shape[1] - 17 + stuffed[:, 16:].sum(axis=1) + _fd_crc(int(batch.length[0]))
    return slow, fast


def worst_bits(length: int, fd: bool) -> tuple[float, float]:
    """Return the most bits that a frame can have: a stuff bit after five, then after every four.

    Examples
    --------
    >>> worst_bits(8, False), worst_bits(64, True)
    ((135.0, 0.0), (34.0, 678.0))
    """
    if not fd:
        body = 34 + 8 * length
        return float(body + (body - 1) // 4 + 13), 0.0
    head = 22 + 8 * length
    first = (17 - 1) // 4
    fast = head - 17 + (head - 1) // 4 - first + _fd_crc(length)
    return float(SLOW_BITS + first), float(fast)


def _fd_crc(length: int) -> int:
    """Bits of stuff count and CRC with their fixed stuff bits."""
    return 4 + 17 + 6 if length <= 16 else 4 + 21 + 7


def _header(batch: CanBatch) -> npt.NDArray[np.uint8]:
    """Return SOF to DLC, shape (m, 19) or (m, 22) with CAN FD."""
    m = len(batch)
    names = (batch.identifier[:, None] >> np.arange(10, -1, -1)) & 1
    code = (np.searchsorted(FD_LENGTHS, batch.length)[:, None] >> np.arange(3, -1, -1)) & 1
    zero = np.zeros((m, 1), np.int64)
    middle = [zero] * 3  # RTR, IDE, r0
    if batch.fd[0]:
        middle = [zero, zero, zero + 1, zero, zero + 1, zero]  # RRS, IDE, FDF, res, BRS, ESI
    return np.concatenate([zero, names, *middle, code], axis=1).astype(np.uint8)


def _crc15(bits: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """CRC-15 of each row, as 15 bits."""
    crc = np.zeros(len(bits), np.int64)
    for column in bits.T:
        out = (crc >> 14 & 1) ^ column
        crc = (crc << 1 & 0x7FFF) ^ np.where(out, CRC15, 0)
    return ((crc[:, None] >> np.arange(14, -1, -1)) & 1).astype(np.uint8)


def _stuff_bits(bits: npt.NDArray[np.uint8]) -> BoolArray:
    """Return after which bit of each row a stuff bit follows."""
    stuffed = np.zeros(bits.shape, np.bool_)
    last = 1 - bits[:, 0]
    run = np.zeros(len(bits), np.int64)
    for place, column in enumerate(bits.T):
        run = np.where(column == last, run + 1, 1)
        last = column
        full = run == 5
        stuffed[:, place] = full
        last = np.where(full, 1 - column, last)  # the stuff bit begins a run of its own
        run = np.where(full, 1, run)
    return stuffed


def _seconds(bits: tuple[float, float], plan: LoadPlan) -> float:
    fast = bits[1] / plan.data_bitrate if plan.data_bitrate else 0.0
    return bits[0] / plan.bitrate + fast


def _frames_of(kind: str) -> CanBatch:
    """Return strain frames with gage waves in them: a second of a wheel at 65 km/h."""
    counts = np.rint(gage_wave() / (0.02 / 32768)).astype(np.int16)
    record = Record(0, 0, 1000, counts, np.zeros(len(counts), np.int16))
    sent = CanTransmitter(kind).send(record, 0, len(counts)).frames
    if not isinstance(sent, CanBatch):
        raise DeviceError(
            f"format {kind}: not a CAN frame format; RAW16, RAW12 and RAW12C are; "
            "choose one of them"
        )
    return sent.take(np.flatnonzero(sent.identifier == LAYOUTS[kind].base))


def gage_wave() -> FloatArray:
    """Return strain as an innerliner gage shows it, shape (9984, 5): a contact every 0.108 s.

    Inflation and rotation stretch it by some 0.26 %; at the edges of the contact it dips, inside it
    rises to 1.1 %.
    """
    time = np.arange(9984) / 1e4
    phi = (58.0 * time + np.pi) % (2.0 * np.pi) - np.pi
    edges = np.array([0.16, 0.2, 0.21, 0.2, 0.16])
    inside = 0.5 * (np.tanh((phi[:, None] + edges) / 0.05) - np.tanh((phi[:, None] - edges) / 0.05))
    dips = sum(np.exp(-(((phi[:, None] - s * (edges + 0.14)) / 0.1) ** 2)) for s in (-1, 1))
    sway = 3e-4 * np.cos(phi)[:, None]
    noise = 4e-6 * np.random.default_rng(1).standard_normal((len(time), GAGES))
    level = 2.6e-3 + 1e-4 * np.arange(GAGES)
    return np.asarray(level + sway + 8e-3 * inside - 2.4e-3 * dips + noise)


def _check(plan: LoadPlan) -> None:
    if plan.kind == SERIAL:
        return
    if plan.kind not in (RAW16, RAW12, RAW12C):
        raise DeviceError(
            f"format {plan.kind!r}; known formats are {SERIAL}, {RAW16}, {RAW12} and {RAW12C}; "
            "choose one"
        )
    fd = LAYOUTS[plan.kind].fd
    if fd != (plan.data_bitrate is not None):
        needs = "CAN FD, with a data bit rate" if fd else "classic CAN, without a data bit rate"
        raise DeviceError(
            f"format {plan.kind}: the bus cannot carry this format; it needs {needs}; change the "
            "bus or the format"
        )
