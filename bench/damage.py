"""Damage done on purpose to a line, and what a decoder makes of it: the proof behind the counters.

One damage strikes every `SPACING` frames or so. What comes out must be among what went in.
"""

import resource
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bench.decoder import SerialDecoder
from bench.frames import Frames, encode
from bench.line_counts import LineCounts

KINDS = ("flip", "cut", "insertion", "splice", "random bytes")
SPACING = 25
"""Frames for each damage, on average; fewer would let damages overlap."""
POOL = 4096
"""Different frames; their numbers and samples tell them apart."""
BLOCK = 2048
"""Frames that go over the line at once."""


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
        Of the decoder.
    growth : int, [bytes]
        Of the process's largest memory, from the first tenth to the end.
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


def strike_serial(damages: int, seed: int = 0) -> Outcome:
    """Send SERIAL v1 frames, damage some, and compare what arrives with what was sent."""
    rng = np.random.default_rng(seed)
    frames = _pool(rng)
    wire = encode(frames)
    numbers = {_key(frames, row): row for row in range(POOL)}
    decoder, outcome = SerialDecoder(), Outcome()
    decoder.push(b"\0")
    first, reached = 0, 0
    early = 0
    while outcome.damaged < damages:
        rows = (first + np.arange(BLOCK)) % POOL
        stream = b"".join(wire[row] for row in rows.tolist())
        wanted = min(BLOCK // SPACING, damages - outcome.damaged)
        broken = damaged(stream, wanted, rng, outcome.kinds)
        arrived = [
            (_key(batch, row)) for batch in decoder.push(broken) for row in range(len(batch))
        ]
        outcome.sent += BLOCK
        outcome.damaged += wanted
        # the last frame of a block may be ended by the first delimiter of the next
        due = set(rows.tolist()) | {(first - 1) % POOL}
        known = [numbers.get(key, -1) for key in arrived]
        outcome.wrong += sum(row not in due for row in known)
        reached += len(due.intersection(known))
        first = (first + BLOCK) % POOL
        if not early and outcome.damaged > damages // 10:
            early = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    outcome.good_lost = outcome.sent - reached
    outcome.counts = decoder.counts
    outcome.growth = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - early)
    return outcome


def damaged(stream: bytes, count: int, rng: np.random.Generator, kinds: Counter[str]) -> bytes:
    """Return a stream after so many damages at places spread over it."""
    places = np.sort(rng.choice(len(stream) - 64, count, replace=False))
    parts, last = [], 0
    for place in places.tolist():
        if place < last:  # the damage before reached this far
            place = last
        kind = KINDS[int(rng.integers(len(KINDS)))]
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
    "flip": _flip, "cut": _cut, "insertion": _insert, "splice": _splice,
    "random bytes": _randomise,
}  # fmt: skip


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


def _key(frames: Frames, row: int) -> tuple[int, int, int, int, int, bytes]:
    """Everything that a frame says."""
    return (
        int(frames.seq[row]), int(frames.t_us[row]), int(frames.wheel[row]),
        int(frames.period[row]), int(frames.flags[row]), frames.counts[row].tobytes(),
    )  # fmt: skip
