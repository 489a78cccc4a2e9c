"""Decoders from the bytes of a link to `tirebench.wire.frames.Frames`.

======================  =====================================================================
encoding                bytes of a read
======================  =====================================================================
``serial-v1``           a serial line with SERIAL v1 frames
``slcan``               text lines of a CAN adapter on a serial line
``can``                 packed CAN frames, see `tirebench.wire.can_batch`
``line-map``            a serial line of another make, as a map says
======================  =====================================================================

What comes out depends on the bytes and their arrival alone, never on how they are cut into reads.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from tirebench.wire.conditions import Measured
from tirebench.wire.frames import Frames
from tirebench.wire.line_counts import LineCounts

if TYPE_CHECKING:
    from tirebench.protocols.layouts import Health

SERIAL, SLCAN, CAN, LINE_MAP = "serial-v1", "slcan", "can", "line-map"
ENCODINGS = (SERIAL, SLCAN, CAN, LINE_MAP)


class Decoder(Protocol):
    """Bytes to frames.

    Attributes
    ----------
    counts : LineCounts
        What was seen and lost on the line.
    """

    counts: LineCounts

    @property
    def health(self) -> "Mapping[int, Health]":
        """Content of the last HEALTH frame of each wheel."""

    def push(self, data: bytes, arrival: int = 0) -> "Sequence[Frames | Measured]":
        """Return the frames that `data` completes, in order, and the conditions sent between them.

        Parameters
        ----------
        arrival : int, [ns]
            Monotonic; resolves counters and clocks that wrap soon.
        """

    def interrupt(self) -> None:
        """Drop a half frame, because the line was interrupted here."""


__all__ = ["CAN", "ENCODINGS", "LINE_MAP", "SERIAL", "SLCAN", "Decoder"]
