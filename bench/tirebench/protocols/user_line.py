"""A serial line of another make, by its map: bytes or text to frames; see `tirebench.protocols`.

A damaged frame is counted and dropped. Binary: the next sync word is looked for from the second
byte of the damaged frame on, so that no good frame is lost with it; a frame without a checksum
counts only where another one follows it at once. Text: each line stands by itself.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from tirebench.protocols.checksums import CHECKSUMS
from tirebench.protocols.layouts import Health
from tirebench.protocols.map_messages import LONGEST_FRAME, BinaryCut, Message, TextCut
from tirebench.protocols.map_parts import UserMap
from tirebench.protocols.signals import Signal
from tirebench.protocols.user_can import UserCan
from tirebench.wire.can_batch import CanBatch
from tirebench.wire.conditions import Measured
from tirebench.wire.frames import Frames
from tirebench.wire.line_counts import LineCounts

Found = list[tuple[int, bytes]]
"""Number of the message, and its data."""


class Cutter(Protocol):
    """Cuts the frames out of a line."""

    def push(self, data: bytes) -> Found:
        """Return the frames that `data` completes."""

    def interrupt(self) -> None:
        """Forget a half frame: the line was broken here."""


class UserLine:
    """A `tirebench.protocols.Decoder` made from a map."""

    def __init__(self, user_map: UserMap, counts: LineCounts) -> None:
        self.counts = counts
        self._frames = UserCan(user_map, counts)
        self._width = max(message.length for message in user_map.messages)
        binary = isinstance(user_map.messages[0].cut, BinaryCut)
        cutter = Binary if binary else Text
        self._cutter: Cutter = cutter(user_map.messages, counts)

    @property
    def health(self) -> Mapping[int, Health]:
        """What each wheel said last of itself: nothing."""
        return self._frames.health

    def push(self, data: bytes, arrival: int = 0) -> Sequence[Frames | Measured]:
        """Return the frames that `data` completes."""
        self.counts.bytes += len(data)
        found = self._cutter.push(data)
        if not found:
            return []
        m, packed = len(found), b"".join(body.ljust(self._width, b"\0") for _, body in found)
        return self._frames.push(
            CanBatch(
                identifier=np.array([number for number, _ in found], np.int64),
                extended=np.zeros(m, np.bool_),
                fd=np.zeros(m, np.bool_),
                length=np.full(m, self._width, np.int64),
                data=np.frombuffer(packed, np.uint8).reshape(m, self._width),
            ),
            arrival,
        )

    def interrupt(self) -> None:
        """Forget a half frame."""
        self._cutter.interrupt()
        self._frames.interrupt()


class Binary:
    """Frames that begin with a sync word; see `Cutter`."""

    def __init__(self, messages: Sequence[Message], counts: LineCounts) -> None:
        self._cuts = [
            (message.identifier, message.cut)
            for message in messages
            if isinstance(message.cut, BinaryCut)
        ]
        self._syncs = tuple(cut.sync for _, cut in self._cuts)
        self._longest = max(map(len, self._syncs))
        self._counts = counts
        self._tail = b""
        self._hunting = True  # nothing is damage before the first good frame

    def push(self, data: bytes) -> Found:
        """Return the frames that `data` completes."""
        data = self._tail + data
        found: Found = []
        place = 0
        while (first := self._next(data, place)) is not None:
            start, number, cut = first
            if start > place:
                self._reject("framing")
            place = start
            end = start + cut.length
            if end + (0 if cut.checksum else self._longest) > len(data):
                break
            if self._good(data[start : end + self._longest], cut):
                body = start + len(cut.sync)
                found.append((number, data[body : body + cut.size]))
                place, self._hunting = end, False
            else:
                self._reject("crc")
                place += 1
        else:  # what is left holds no sync word, but for its beginning at the very end
            keep = max(place, len(data) - self._longest + 1)
            if keep > place:
                self._reject("framing")
            place = keep
        self._tail = data[place:]
        return found

    def interrupt(self) -> None:
        """Forget a half frame."""
        self._tail, self._hunting = b"", True

    def _next(self, data: bytes, place: int) -> tuple[int, int, BinaryCut] | None:
        """Return where the next sync word stands, and of which message it is."""
        starts = [
            (start, -len(cut.sync), number, cut)
            for number, cut in self._cuts
            if (start := data.find(cut.sync, place)) >= 0
        ]
        if not starts:
            return None
        start, _, number, cut = min(starts, key=lambda one: one[:3])
        return start, number, cut

    def _good(self, data: bytes, cut: BinaryCut) -> bool:
        """Tell whether the frame at the beginning of `data` is one."""
        if not cut.checksum:
            return data.startswith(self._syncs, cut.length)
        frame = data[: cut.length]
        stated = int.from_bytes(frame[-cut.tail :], "big" if cut.big else "little")
        covered = frame[0 if cut.covers_sync else len(cut.sync) : -cut.tail]
        return CHECKSUMS[cut.checksum].of(covered) == stated

    def _reject(self, counter: str) -> None:
        """Count one damage, however many pieces are left of a frame."""
        if not self._hunting:
            setattr(self._counts, counter, getattr(self._counts, counter) + 1)
        self._hunting = True


class Text:
    """Lines of columns; see `Cutter`."""

    def __init__(self, messages: Sequence[Message], counts: LineCounts) -> None:
        self._cuts = [
            (message.identifier, message.cut)
            for message in messages
            if isinstance(message.cut, TextCut)
        ]
        self._counts = counts
        self._tail = b""
        self._too_long = False
        self._joined = False

    def push(self, data: bytes) -> Found:
        """Return the frames that `data` completes."""
        *lines, self._tail = (self._tail + data).split(b"\n")
        found: Found = []
        for line in lines:
            if self._too_long or len(line) > LONGEST_FRAME:
                self._too_long = False
                self._counts.framing += 1
            elif line.strip():
                self._take(line, found)
            self._joined = True
        if len(self._tail) > LONGEST_FRAME:
            self._tail, self._too_long = b"", True
        return found

    def interrupt(self) -> None:
        """Forget a half line."""
        self._tail, self._too_long, self._joined = b"", False, False

    def _take(self, line: bytes, found: Found) -> None:
        try:
            text = line.decode("ascii").strip()
        except UnicodeDecodeError:
            self._reject("framing")
            return
        why = "unknown"
        for number, cut in self._cuts:
            content, star, stated = text.rpartition("*") if cut.checksum else (text, "", "")
            words = (content if star else text).split(cut.blanks)
            if cut.starts:
                if words[:1] != [cut.starts]:
                    continue
                del words[0]
            if cut.checksum and not (star and _right(content, stated, cut.checksum)):
                why = "crc"
                continue
            why = "framing"
            if len(words) != len(cut.columns):
                continue
            try:
                found.append((number, b"".join(map(_packed, words, cut.columns))))
            except ValueError:
                continue
            return
        self._reject(why)

    def _reject(self, counter: str) -> None:
        if self._joined:
            setattr(self._counts, counter, getattr(self._counts, counter) + 1)


def _right(content: str, stated: str, checksum: str) -> bool:
    """Tell whether the hex digits after the star are the checksum of what is before it."""
    number = CHECKSUMS[checksum].of(content.lstrip("$!").encode())
    return f"{number:x}" == (stated.lower().lstrip("0") or "0")


def _packed(word: str, column: Signal) -> bytes:
    """Return a column as eight data bytes.

    Raises
    ------
    ValueError
        If it is no number, or does not go into its bits.
    """
    if "_" in word:  # Python would read over it
        raise ValueError(word)
    if column.real:
        value = float(word)
        if math.isinf(value):
            raise ValueError(word)
        return np.float64(value).tobytes()
    number = int(word)
    low, high = column.bounds
    if not low <= number <= high:
        raise ValueError(word)
    return (number % 2**64).to_bytes(8, "little")
