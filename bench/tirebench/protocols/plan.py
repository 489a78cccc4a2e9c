"""Which decoder a line needs, and how a recording remembers it."""

import hashlib
from dataclasses import dataclass
from typing import Any

from tirebench.errors import RecordingError
from tirebench.protocols import ENCODINGS, LINE_MAP, SERIAL, SLCAN, Decoder
from tirebench.protocols.dbc import FILES, database
from tirebench.protocols.decoder import SerialDecoder
from tirebench.protocols.frame_decoder import FrameDecoder, PackedDecoder
from tirebench.protocols.map_parts import UserMap
from tirebench.protocols.slcan import SlcanDecoder
from tirebench.protocols.user_can import UserCan
from tirebench.protocols.user_line import UserLine
from tirebench.protocols.user_map import parse_map
from tirebench.protocols.wheel_can import WheelCan
from tirebench.wire.device import Device
from tirebench.wire.line_counts import LineCounts
from tirebench.wire.rate_check import PERIOD

RATE = 10_000.0
"""Default sample rate, [Hz]; frames of SERIAL v1 say their own."""


@dataclass(frozen=True, slots=True)
class ProtocolPlan:
    """What is on a line.

    Attributes
    ----------
    encoding : str
        Name of the byte layout (`tirebench.protocols`).
    rate : float, [Hz]
        Sample rate of the gages, where the frames do not say it.
    user_map : UserMap or None
        Map of another make's transmitter.
    """

    encoding: str = SERIAL
    rate: float = RATE
    user_map: UserMap | None = None

    def decoder(self) -> Decoder:
        """Return a fresh decoder."""
        if self.encoding == SERIAL:
            return SerialDecoder()
        counts = LineCounts()
        if self.encoding == LINE_MAP and self.user_map is not None:
            return UserLine(self.user_map, counts)
        frames: FrameDecoder
        if self.user_map is None:
            frames = WheelCan(self.rate, counts)
        else:
            frames = UserCan(self.user_map, counts)
        if self.encoding == SLCAN:
            return SlcanDecoder(frames, counts)
        return PackedDecoder(frames, counts)

    @property
    def device(self) -> Device:
        """What a count means where no device file says it."""
        return Device() if self.user_map is None else self.user_map.device

    @property
    def rate_said_by(self) -> str:
        """Where the sample rate is said, for messages."""
        if self.user_map is not None:
            return "rate_hz of the map"
        return PERIOD if self.encoding == SERIAL else "--rate"

    def as_header(self) -> dict[str, Any]:
        """Return the plan as the header of a recording holds it."""
        user = "" if self.user_map is None else self.user_map.text
        return {
            "encoding": self.encoding,
            "rate_hz": self.rate,
            "map": user,
            "dbc_sha256": dbc_hash(user.partition("\0")[2]),
        }

    @classmethod
    def of_header(cls, header: dict[str, Any], where: str) -> "ProtocolPlan":
        """Return the plan that a header holds; SERIAL v1 where it holds none.

        Raises
        ------
        RecordingError
            If it names an encoding that is not known here, or an impossible rate.
        """
        encoding = header.get("encoding", SERIAL)
        if encoding not in ENCODINGS:
            raise RecordingError(
                f"{where}: the encoding of its bytes is {encoding!r}; this program reads "
                f"{', '.join(ENCODINGS)}; use a newer version of tirelib"
            )
        rate = header.get("rate_hz", RATE)
        if isinstance(rate, bool) or not isinstance(rate, int | float) or not 153 <= rate <= 2e5:
            raise RecordingError(
                f"{where}: rate_hz = {str(rate)[:40]}; 153 .. 200000 Hz is allowed; the header is "
                "damaged; use another recording"
            )
        text, _, dbc = str(header.get("map", "")).partition("\0")
        user = parse_map(text, dbc, where) if text else None
        if (encoding == LINE_MAP) != (user is not None and user.of_line):
            raise RecordingError(
                f"{where}: the encoding of its bytes is {encoding!r}, but its map describes "
                "another kind of line; the two must agree; the header is damaged; use another "
                "recording"
            )
        return cls(encoding, float(rate), user)


def dbc_hash(user: str = "") -> str:
    """Return the SHA-256 of the DBC that the frames follow: a user's, or the published ones."""
    text = user or "".join(database(kinds) for kinds in FILES.values())
    return hashlib.sha256(text.encode()).hexdigest()
