"""Damage done on purpose to a line, and what a decoder makes of it: the proof behind the counters.

One damage strikes every `SPACING` frames or so. What comes out must be among what went in.

SERIAL v1 has a checksum, and so has a line of another make whose map names CRC-32, so that nothing
damaged may pass. The text of slcan has none: a digit that became another digit passes, whoever
reads it, while a line that lost or gained characters does not. On a bus the adapter checks each
frame: there frames are lost, doubled, foreign or of another length, never changed.
"""

import resource
import zlib
from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from tirebench.protocols.decoder import SerialDecoder
from tirebench.protocols.frame_decoder import PackedDecoder
from tirebench.protocols.layouts import (
    LAYOUTS,
    RAW12C,
    RAW16,
    Health,
    Raw,
    encode_raw12c,
    encode_raw16,
)
from tirebench.protocols.map_messages import BinaryCut, Message
from tirebench.protocols.slcan import SlcanDecoder
from tirebench.protocols.slcan import encode as slcan_lines
from tirebench.protocols.user_line import Binary
from tirebench.protocols.wheel_can import WheelCan
from tirebench.wire.can_batch import CanBatch, pack, same_kind
from tirebench.wire.frames import Frames, encode
from tirebench.wire.line_counts import LineCounts

KINDS = ("flip", "cut", "insertion", "splice", "random bytes")
CHANGED = ("flip", "splice", "random bytes")
"""Kinds that leave the length: a text without checksum may take their outcome for good."""
BUS_KINDS = ("lost", "doubled", "foreign", "other length")
SPACING = 25
"""Frames for each damage, on average; fewer would let damages overlap."""
POOL = 4096
"""Different frames; their numbers and samples tell them apart."""
BLOCK = 2048
"""Frames that go over the line at once."""
RATE = 10_000.0
"""Samples a second on a bus."""
_MAPPED = BinaryCut(b"\xaa\x55", 46, "crc32", covers_sync=True, big=False)
"""Number, time and four samples of five gages."""


@dataclass(slots=True)
class Outcome:
    """What damage did.

    Attributes
    ----------
    sent, damaged : int
        Frames sent, and damages done.
    kinds : Counter
        Damages by kind.
    good_lost : int
        Frames that did not arrive.
    wrong : int
        Frames that arrived and were never sent so, or not in this block.
    counts : LineCounts
        What the decoder has counted.
    growth : int, [bytes]
        Growth of the process's largest memory, from the first tenth to the end.
    """

    sent: int = 0
    damaged: int = 0
    kinds: Counter[str] = field(default_factory=Counter)
    good_lost: int = 0
    wrong: int = 0
    counts: LineCounts = field(default_factory=LineCounts)
    growth: int = 0

    @property
    def lost_per_damage(self) -> float:
        """Good frames lost for each damage."""
        return self.good_lost / max(self.damaged, 1)


class Line(Protocol):
    """A line under test: `POOL` frames that differ, and a decoder.

    Attributes
    ----------
    keys : list
        What each frame says.
    counts : LineCounts
        What the decoder has counted.
    """

    keys: list[Hashable]
    counts: LineCounts

    def struck(self, rows: list[int], count: int, kinds: "Counter[str]") -> list[Hashable]:
        """Send frames with so many damages; return what each that arrived says."""


def strike(line: Line, damages: int) -> Outcome:
    """Send frames, damage some, and compare what arrives with what was sent."""
    outcome = Outcome()
    numbers = {key: row for row, key in enumerate(line.keys)}
    first, reached, early = 0, 0, 0
    while outcome.damaged < damages:
        rows = (first + np.arange(BLOCK)) % POOL
        wanted = min(BLOCK // SPACING, damages - outcome.damaged)
        arrived = line.struck(rows.tolist(), wanted, outcome.kinds)
        outcome.sent += BLOCK
        outcome.damaged += wanted
        # the last frame of a block may be ended by the first delimiter of the next
        due = set(rows.tolist()) | {(first - 1) % POOL}
        known = [numbers.get(key, -1) for key in arrived]
        outcome.wrong += sum(row not in due for row in known)
        reached += len(due.intersection(known))
        first = (first + BLOCK) % POOL
        if not early and outcome.damaged > damages // 10:
            early = _largest_memory()
    outcome.good_lost = outcome.sent - reached
    outcome.counts = line.counts
    outcome.growth = _largest_memory() - early
    return outcome


def strike_serial(damages: int, seed: int = 0) -> Outcome:
    """Strike SERIAL v1."""
    return strike(SerialLine(seed), damages)


def strike_map(damages: int, seed: int = 0) -> Outcome:
    """Strike a serial line that a map describes."""
    return strike(MapLine(seed), damages)


def strike_slcan(
    damages: int, seed: int = 0, kind: str = RAW16, allowed: Sequence[str] = KINDS
) -> Outcome:
    """Strike slcan with RAW16 or RAW12C by some kinds of damage."""
    return strike(SlcanLine(seed, kind, allowed), damages)


def strike_bus(damages: int, seed: int = 0) -> Outcome:
    """Strike a bus with RAW16, in batches as a recording holds them."""
    return strike(BusLine(seed), damages)


class SerialLine:
    """SERIAL v1, see `Line`."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        frames = _pool(self._rng)
        self.keys: list[Hashable] = [_key(frames, row) for row in range(POOL)]
        self._wire = encode(frames)
        self._decoder = SerialDecoder()
        self._decoder.push(b"\0")
        self.counts = self._decoder.counts

    def struck(self, rows: list[int], count: int, kinds: "Counter[str]") -> list[Hashable]:
        """Send frames with so many damages."""
        stream = b"".join(self._wire[row] for row in rows)
        broken = damaged(stream, count, self._rng, kinds)
        return [
            _key(batch, row) for batch in self._decoder.push(broken) for row in range(len(batch))
        ]


class MapLine:
    """A serial line of another make with a sync word and CRC-32, as a map says; see `Line`."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        pool = self._rng.integers(0, 256, (POOL, _MAPPED.size)).astype(np.uint8)
        bodies = [row.tobytes() for row in pool]
        self.keys: list[Hashable] = list(bodies)
        self._wire = [
            _MAPPED.sync + body + zlib.crc32(_MAPPED.sync + body).to_bytes(4, "little")
            for body in bodies
        ]
        self.counts = LineCounts()
        self._cutter = Binary([Message("wheel", 0, False, _MAPPED.size, {}, _MAPPED)], self.counts)

    def struck(self, rows: list[int], count: int, kinds: "Counter[str]") -> list[Hashable]:
        """Send frames with so many damages."""
        stream = b"".join(self._wire[row] for row in rows)
        found = self._cutter.push(damaged(stream, count, self._rng, kinds))
        self.counts.ok += len(found)
        return [body for _, body in found]


class SlcanLine:
    """Lines of slcan, see `Line`; what is taken for a strain frame counts as arrived."""

    def __init__(self, seed: int, kind: str, allowed: Sequence[str]) -> None:
        self._rng = np.random.default_rng(seed)
        self._kind, self._allowed = kind, allowed
        batch = _bus_pool(self._rng, kind)
        self.keys: list[Hashable] = _bus_keys(batch, kind)
        self._wire = slcan_lines(batch)
        self.counts = LineCounts()
        self._tap = _Tap(kind, WheelCan(RATE, self.counts))
        self._decoder = SlcanDecoder(self._tap, self.counts)
        self._decoder.push(b"\r")

    def struck(self, rows: list[int], count: int, kinds: "Counter[str]") -> list[Hashable]:
        """Send frames with so many damages."""
        stream = b"".join(self._wire[row] for row in rows)
        self._decoder.push(damaged(stream, count, self._rng, kinds, self._allowed))
        return self._tap.taken()


class BusLine:
    """Packed frames of a bus, see `Line`."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._pool = _bus_pool(self._rng, RAW16)
        self.keys: list[Hashable] = _bus_keys(self._pool, RAW16)
        self.counts = LineCounts()
        self._tap = _Tap(RAW16, WheelCan(RATE, self.counts))
        self._decoder = PackedDecoder(self._tap, self.counts)

    def struck(self, rows: list[int], count: int, kinds: "Counter[str]") -> list[Hashable]:
        """Send frames of which some are lost, come twice, are foreign, or of another length."""
        batch = self._pool.take(np.array(rows))
        places = self._rng.choice(len(rows), count, replace=False)
        chosen = self._rng.integers(len(BUS_KINDS), size=count)
        kinds.update(BUS_KINDS[kind] for kind in chosen.tolist())
        hit = [places[chosen == number] for number in range(len(BUS_KINDS))]
        identifier, length = batch.identifier.copy(), batch.length.copy()
        identifier[hit[2]] = self._rng.choice([0x01, 0x11F, 0x140, 0x7FF], len(hit[2]))
        length[hit[3]] = self._rng.choice([0, 1, 8, 12, 32, 48], len(hit[3]))
        times = np.ones(len(rows), np.int64)
        times[hit[0]], times[hit[1]] = 0, 2
        sent = CanBatch(identifier, batch.extended, batch.fd, length, batch.data)
        self._decoder.push(pack(sent.take(np.repeat(np.arange(len(rows)), times))))
        return self._tap.taken()


class _Tap:
    """Pass frames on and remember what those that are taken for strain say."""

    def __init__(self, kind: str, frames: WheelCan) -> None:
        self._kind, self._frames = kind, frames
        self._keys: list[Hashable] = []

    def push(self, batch: CanBatch, arrival: int) -> list[Frames]:
        layout = LAYOUTS[self._kind]
        ours = ~batch.extended & (batch.length == layout.length)
        ours &= (batch.identifier >= layout.base) & (batch.identifier < layout.base + 8)
        self._keys += _bus_keys(batch.take(ours), self._kind)
        return self._frames.push(batch, arrival)

    @property
    def health(self) -> Mapping[int, Health]:
        return self._frames.health

    def interrupt(self) -> None:
        """Forget what waits."""
        self._frames.interrupt()

    def taken(self) -> list[Hashable]:
        """Return what has come since the last call."""
        keys, self._keys = self._keys, []
        return keys


def damaged(
    stream: bytes,
    count: int,
    rng: np.random.Generator,
    kinds: "Counter[str]",
    allowed: Sequence[str] = KINDS,
) -> bytes:
    """Return a stream after so many damages at places spread over it."""
    places = np.sort(rng.choice(len(stream) - 64, count, replace=False))
    parts, last = [], 0
    for place in places.tolist():
        if place < last:  # the damage before reached this far
            place = last
        kind = allowed[int(rng.integers(len(allowed)))]
        kinds[kind] += 1
        parts.append(stream[last:place])
        put, last = _DAMAGE[kind](stream, place, rng)
        parts.append(put)
    parts.append(stream[last:])
    return b"".join(parts)


def _flip(stream: bytes, place: int, rng: np.random.Generator) -> tuple[bytes, int]:
    return bytes([stream[place] ^ 1 << int(rng.integers(8))]), place + 1


def _cut(stream: bytes, place: int, rng: np.random.Generator) -> tuple[bytes, int]:
    return b"", place + int(rng.integers(1, 9))


def _insert(stream: bytes, place: int, rng: np.random.Generator) -> tuple[bytes, int]:
    return rng.bytes(int(rng.integers(1, 40))), place


def _splice(stream: bytes, place: int, rng: np.random.Generator) -> tuple[bytes, int]:
    """Put bytes of elsewhere in the place of as many."""
    length, other = int(rng.integers(1, 21)), int(rng.integers(len(stream) - 20))
    return stream[other : other + length], place + length


def _randomise(stream: bytes, place: int, rng: np.random.Generator) -> tuple[bytes, int]:
    length = int(rng.integers(1, 21))
    return rng.bytes(length), place + length


_DAMAGE: dict[str, Callable[[bytes, int, np.random.Generator], tuple[bytes, int]]] = {
    "flip": _flip,
    "cut": _cut,
    "insertion": _insert,
    "splice": _splice,
    "random bytes": _randomise,
}


def _largest_memory() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _pool(rng: np.random.Generator) -> Frames:
    """Return frames of a wheel with samples at random."""
    number = np.arange(POOL)
    return Frames(
        wheel=np.zeros(POOL, np.int64),
        seq=number,
        t_us=1600 * number,
        period=np.full(POOL, 1000),
        flags=np.zeros(POOL, np.int64),
        rssi=np.full(POOL, -50),
        temperature=np.full(POOL, 30),
        counts=rng.integers(-(2**15), 2**15, (POOL, 16, 5)).astype(np.int16),
    )


def _bus_pool(rng: np.random.Generator, kind: str) -> CanBatch:
    """Return CAN frames of a wheel with samples at random."""
    layout, number = LAYOUTS[kind], np.arange(POOL)
    counts = rng.integers(-(2**15), 2**15, (POOL, layout.samples, 5)).astype(np.int16)
    if kind == RAW12C:
        return same_kind(layout.base, encode_raw12c(number, counts[:, 0]), fd=False)
    raw = Raw(number, round(1e6 * layout.samples / RATE) * number, counts)
    return same_kind(layout.base, encode_raw16(raw), fd=True)


def _bus_keys(batch: CanBatch, kind: str) -> list[Hashable]:
    """Everything that frames of a kind say."""
    size = LAYOUTS[kind].length
    return [
        (identifier, data[:size].tobytes())
        for identifier, data in zip(batch.identifier.tolist(), batch.data, strict=True)
    ]


def _key(frames: Frames, row: int) -> tuple[int, int, int, int, int, bytes]:
    """Everything that a frame says."""
    return (
        int(frames.seq[row]),
        int(frames.t_us[row]),
        int(frames.wheel[row]),
        int(frames.period[row]),
        int(frames.flags[row]),
        frames.counts[row].tobytes(),
    )
