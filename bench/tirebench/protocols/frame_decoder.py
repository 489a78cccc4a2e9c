"""Decoding of CAN frames: one protocol class, an implementation for each transmitter."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from tirebench.protocols.layouts import Health
from tirebench.wire.can_batch import CanBatch, unpack
from tirebench.wire.conditions import Measured
from tirebench.wire.frames import Frames
from tirebench.wire.line_counts import LineCounts


class FrameDecoder(Protocol):
    """CAN frames to strain frames: `tirebench.protocols.wheel_can`, or a user's own transmitter."""

    @property
    def health(self) -> Mapping[int, Health]:
        """Content of the last HEALTH frame of each wheel; empty where there are none."""
        return {}

    def push(self, batch: CanBatch, arrival: int) -> Sequence[Frames | Measured]:
        """Return the strain frames of a batch, those of each wheel in order."""

    def interrupt(self) -> None:
        """Drop incomplete data, because the line was interrupted here."""


class PackedDecoder:
    """Packed CAN frames to strain frames; see `tirebench.protocols.Decoder`."""

    def __init__(self, frames: FrameDecoder, counts: LineCounts) -> None:
        self.counts = counts
        self._frames = frames

    @property
    def health(self) -> Mapping[int, Health]:
        """Content of the last HEALTH frame of each wheel."""
        return self._frames.health

    def push(self, data: bytes, arrival: int = 0) -> Sequence[Frames | Measured]:
        """Return the frames of one packed batch; a piece that is not a batch is counted."""
        if not data:
            return []
        self.counts.bytes += len(data)
        batch = unpack(data)
        if batch is None:
            self.counts.framing += 1
            return []
        return self._frames.push(batch, arrival) if len(batch) else []

    def interrupt(self) -> None:
        """Drop incomplete data."""
        self._frames.interrupt()
