"""CAN frames of wheel transmitters to `Frames`: sorted by wheel and kind, numbers made wide."""

import numpy as np
import numpy.typing as npt

from tirebench.errors import DeviceError
from tirebench.protocols import layouts
from tirebench.protocols.layouts import HEALTH, LAYOUTS, RAW12, RAW12C, RAW16, SYNC, WHEELS, Health
from tirebench.protocols.single_samples import SingleSamples
from tirebench.protocols.widening import Widener
from tirebench.wire.can_batch import CanBatch
from tirebench.wire.frames import TICK, FrameFlag, Frames, IntArray
from tirebench.wire.line_counts import LineCounts
from tirelib.core.arrays import BoolArray

_DECODE = {RAW16: layouts.decode_raw16, RAW12: layouts.decode_raw12}
_CODES = {kind: code for code, kind in enumerate(LAYOUTS)}


def _table() -> npt.NDArray[np.int8]:
    """Return the kind of frame of each block of identifiers and length; -1: none of ours."""
    table = np.full((4, 65), -1, np.int8)
    for kind, layout in LAYOUTS.items():
        table[(layout.base - LAYOUTS[RAW16].base) // WHEELS, layout.length] = _CODES[kind]
    return table


_KINDS = _table()
PASSED = int(FrameFlag.LOW_BATTERY | FrameFlag.TIME_RESET | FrameFlag.RADIO_LOSS)
"""Flags of HEALTH that hold for the strain frames after it; saturation is marked in band."""
UNHEARD = Health(rssi=0, temperature=0)
"""Stands for a wheel that has said nothing of itself yet."""
SLOWEST, FASTEST = 153.0, 200_000.0
"""Sample rates that a period in ticks can say, [Hz]."""


def period_of(rate: float) -> int:
    """Return the sample period in ticks of 0.1 us.

    Raises
    ------
    DeviceError
        If ticks cannot say it.
    """
    if not SLOWEST <= rate <= FASTEST:
        raise DeviceError(
            f"rate {rate:g} Hz; {SLOWEST:.0f} .. {FASTEST:.0f} Hz is allowed; give the sample rate "
            "of the gages"
        )
    return round(1.0 / (rate * TICK))


class WheelCan:
    """The published CAN frames; see `tirebench.protocols.layouts`.

    Parameters
    ----------
    rate : float, [Hz]
        Sample rate: RAW16, RAW12 and RAW12C do not say it.
    counts : LineCounts
        Counters of the line; `ok`, `unknown` and `unplaced` are kept here.

    Attributes
    ----------
    health : dict of wheel to Health
        What each wheel said last.
    """

    def __init__(self, rate: float, counts: LineCounts) -> None:
        self.health: dict[int, Health] = {}
        self._period = period_of(rate)
        self._counts = counts
        self._kind: dict[int, str] = {}
        self._wide: dict[int, Widener] = {}
        self._single: dict[int, SingleSamples] = {}

    def push(self, batch: CanBatch, arrival: int) -> list[Frames]:
        """Return the strain frames of a batch, those of each wheel in order."""
        place = batch.identifier - LAYOUTS[RAW16].base
        ours = ~batch.extended & (place >= 0) & (place < 4 * WHEELS)
        wheels = np.where(ours, place % WHEELS, -1)
        before = self._counts.ok
        frames: list[Frames] = []
        for wheel in sorted(set(wheels.tolist()) - {-1}):
            mine = batch.take(np.flatnonzero(wheels == wheel))
            frames += self._wheel(wheel, mine, arrival)
        self._counts.unknown += len(batch) - (self._counts.ok - before)
        return frames

    def interrupt(self) -> None:
        """Forget samples that wait for their SYNC: the line was broken here."""
        for single in self._single.values():
            single.interrupt()

    def _wheel(self, wheel: int, batch: CanBatch, arrival: int) -> list[Frames]:
        """Take the frames of one wheel."""
        kinds = _KINDS[(batch.identifier - LAYOUTS[RAW16].base) // WHEELS, batch.length]
        there = set(kinds.tolist())
        rows = {
            kind: kinds == code if code in there else _none(kinds)
            for code, kind in enumerate(LAYOUTS)
        }
        strain = [kind for kind in (RAW16, RAW12, RAW12C) if _CODES[kind] in there]
        if strain:
            self._kind.setdefault(wheel, strain[0])  # one kind a wheel, the first that is heard
        kind = self._kind.get(wheel)
        used = rows[HEALTH] | rows[SYNC]
        if kind is not None:
            used = used | rows[kind]
        self._counts.ok += int(used.sum())
        state = self._state(wheel, batch, rows[HEALTH])
        if kind is None or kind == RAW12C:
            return self._singles(wheel, batch, rows, state)
        return self._frames(wheel, kind, batch, rows[kind], state, arrival)

    def _state(self, wheel: int, batch: CanBatch, rows: BoolArray) -> IntArray:
        """Return flags, rssi and temperature that hold at each frame, shape (m, 3)."""
        said = [self.health.get(wheel) or UNHEARD]
        if not rows.any():
            h = said[0]
            return np.array([[h.flags & PASSED, h.rssi, h.temperature]]).repeat(len(rows), axis=0)
        said += [layouts.decode_health(batch.data[row]) for row in np.flatnonzero(rows).tolist()]
        self.health[wheel] = said[-1]
        table = np.array([(h.flags & PASSED, h.rssi, h.temperature) for h in said], np.int64)
        return np.asarray(table[np.cumsum(rows)])

    def _singles(
        self, wheel: int, batch: CanBatch, rows: dict[str, BoolArray], state: IntArray
    ) -> list[Frames]:
        if wheel not in self._single:
            self._single[wheel] = SingleSamples(wheel, self._period, self._counts)
        taken = np.flatnonzero(rows[RAW12C] | rows[SYNC])
        return self._single[wheel].push(rows[SYNC][taken], batch.data[taken, :8], state[taken])

    def _frames(
        self,
        wheel: int,
        kind: str,
        batch: CanBatch,
        rows: BoolArray,
        state: IntArray,
        arrival: int,
    ) -> list[Frames]:
        if not rows.any():
            return []
        samples = LAYOUTS[kind].samples
        raw = _DECODE[kind](batch.data[rows])
        if wheel not in self._wide:
            self._wide[wheel] = Widener(samples * self._period / 10.0)
        seq, t_us = self._wide[wheel].widen(raw.seq, raw.t_us, arrival)
        m = len(seq)
        held = state[rows]
        return [
            Frames(
                wheel=np.full(m, wheel),
                seq=seq,
                t_us=t_us,
                period=np.full(m, self._period),
                flags=held[:, 0],
                rssi=held[:, 1],
                temperature=held[:, 2],
                counts=raw.counts,
            )
        ]


def _none(rows: npt.NDArray[np.int8]) -> BoolArray:
    return np.zeros(len(rows), np.bool_)
