"""Counters of what was received on a line and lost."""

from dataclasses import dataclass

NOTHING = "no byte was received: check that the transmitter is on and that this is its port"
NO_FRAME = (
    "bytes were received, but no valid frame: check the rate (--baud, or --bitrate and "
    "--data-bitrate), the kind of port (PORT or slcan:PORT), and whether another make's "
    "transmitter needs --map, or its map another sync, struct, checksum or checksum_from"
)


@dataclass(slots=True)
class LineCounts:
    """Counters of a line so far, in frames unless stated otherwise.

    Attributes
    ----------
    bytes : int
        Bytes taken.
    ok : int
        Good frames of a transmitter.
    crc : int
        Frames whose CRC is wrong.
    framing : int
        Pieces that are not a frame: broken code, too short, too long, or of another length than
        stated.
    unknown : int
        Good frames of an unknown type, or of another node on the bus.
    unplaced : int
        Samples of RAW12C without a SYNC frame that gives their time; they are dropped.
    overruns : int
        Times that a buffer on the way was full, as far as the receiver reports it.
    reconnects : int
        Times that the port went away and came back.
    """

    bytes: int = 0
    ok: int = 0
    crc: int = 0
    framing: int = 0
    unknown: int = 0
    unplaced: int = 0
    overruns: int = 0
    reconnects: int = 0

    @property
    def bad(self) -> int:
        """Frames that were damaged."""
        return self.crc + self.framing

    @property
    def hint(self) -> str:
        """Advice where no good frame came; empty where one did."""
        if self.ok:
            return ""
        return NO_FRAME if self.bytes else NOTHING
