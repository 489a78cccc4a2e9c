"""slcan: the text lines of a CAN adapter on a serial line, in bulk.

A data frame is one line that ends with CR: ``tiiildd..`` classic and ``diiildd..`` or ``biiildd..``
CAN FD (b with a faster data phase), capitals with an identifier of 29 bits; ``l`` is the length
code. Four more digits may follow: the adapter's own time stamp, which is not used.

Every line is checked on its own: a bad letter, length, digit, or byte costs that line and no other.
The format has no checksum, so that a digit that became another digit cannot be seen.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from tirebench.protocols.frame_decoder import FrameDecoder
from tirebench.protocols.layouts import Health
from tirebench.wire.can_batch import FD_LENGTHS, CanBatch, joined
from tirebench.wire.conditions import Measured
from tirebench.wire.frames import Frames
from tirebench.wire.line_counts import LineCounts

LONGEST_LINE = 1 + 8 + 1 + 128 + 4
"""Characters of the longest line."""
_LETTERS = {
    b"t": (3, False),
    b"T": (8, False),
    b"d": (3, True),
    b"D": (8, True),
    b"b": (3, True),
    b"B": (8, True),
}
"""Digits of the identifier, and whether it is CAN FD."""
_REPLIES = frozenset(b"zZVvNFrR")
"""First letters of lines that are no data frame and no damage: replies, remote frames."""
_BAD = 255
_NIBBLES = np.full(256, _BAD, np.uint8)
for _digits in (b"0123456789abcdef", b"0123456789ABCDEF"):
    _NIBBLES[list(_digits)] = np.arange(16)


class SlcanDecoder:
    """Bytes of an slcan line to frames; memory is bounded. See `tirebench.protocols.Decoder`."""

    def __init__(self, frames: FrameDecoder, counts: LineCounts) -> None:
        self.counts = counts
        self._frames = frames
        self._tail = b""
        self._too_long = False
        self._joined = False

    @property
    def health(self) -> Mapping[int, Health]:
        """What each wheel said last of itself."""
        return self._frames.health

    def push(self, data: bytes, arrival: int = 0) -> Sequence[Frames | Measured]:
        """Return the frames that `data` completes."""
        batch = self.frames_of(data)
        return self._frames.push(batch, arrival) if len(batch) else []

    def frames_of(self, data: bytes) -> CanBatch:
        """Return the CAN frames whose lines `data` completes, in order."""
        self.counts.bytes += len(data)
        text = (self._tail + data).replace(b"\x07", b"\r")  # BEL ends a reply too
        *lines, self._tail = text.split(b"\r")
        if lines and self._too_long:
            self._too_long = False
            self._reject(1)
            lines = lines[1:]
        if lines and not self._joined:  # the first line may be a piece of one
            self._joined = True
            if not _is_frame(lines[0]):
                lines = lines[1:]
        if len(self._tail) > LONGEST_LINE:
            self._tail, self._too_long = b"", True
        return self._parsed(lines)

    def interrupt(self) -> None:
        """Forget a half line: the port was gone."""
        self._tail, self._too_long, self._joined = b"", False, False
        self._frames.interrupt()

    def _parsed(self, lines: list[bytes]) -> CanBatch:
        groups: dict[tuple[bytes, int], list[int]] = {}
        for number, line in enumerate(lines):
            if line:
                groups.setdefault((line[:1], len(line)), []).append(number)
        batches, order = [], []
        for (letter, size), numbers in groups.items():
            if letter not in _LETTERS:
                text_ok = letter[0] in _REPLIES
                self._reject(0 if text_ok else len(numbers))
                self.counts.overruns += sum(_overrun(lines[n]) for n in numbers) if text_ok else 0
                continue
            batch, good = _group(b"".join(lines[n] for n in numbers), letter, size)
            self._reject(len(numbers) - len(batch))
            batches.append(batch)
            order.append(np.asarray(numbers)[good])
        if len(batches) == 1:
            return batches[0]
        if not batches:
            return joined([])
        return joined(batches).take(np.argsort(np.concatenate(order), kind="stable"))

    def _reject(self, count: int) -> None:
        self.counts.framing += count


def _is_frame(line: bytes) -> bool:
    if line[:1] not in _LETTERS:
        return line[:1] in {bytes([letter]) for letter in _REPLIES} or not line
    return len(_group(line, line[:1], len(line))[0]) == 1


def _group(text: bytes, letter: bytes, size: int) -> tuple[CanBatch, npt.NDArray[np.bool_]]:
    """Return the frames of lines of one letter and size, and which lines were good."""
    places, fd = _LETTERS[letter]
    digits = _NIBBLES[np.frombuffer(text, np.uint8).reshape(-1, size)[:, 1:]]
    if size < places + 2:
        return joined([]), np.zeros(len(digits), np.bool_)
    length = FD_LENGTHS[np.minimum(digits[:, places], 15)]
    spare = size - 2 - places - 2 * length
    good = (digits != _BAD).all(axis=1) & ((spare == 0) | (spare == 4))
    good &= fd | (digits[:, places] <= 8)
    digits, length = digits[good], length[good]
    weights = 16 ** np.arange(places - 1, -1, -1, dtype=np.int64)
    identifier = digits[:, :places].astype(np.int64) @ weights
    allowed = identifier < (2**11 if places == 3 else 2**29)
    if not allowed.all():
        good[np.flatnonzero(good)] = allowed
        digits, length, identifier = digits[allowed], length[allowed], identifier[allowed]
    width = 64 if fd else 8
    data = np.zeros((len(digits), width), np.uint8)
    pairs = digits[:, places + 1 : places + 1 + 2 * width]
    pairs = pairs[:, : pairs.shape[1] // 2 * 2]
    data[:, : pairs.shape[1] // 2] = pairs[:, ::2] << 4 | pairs[:, 1::2]
    data[np.arange(width) >= length[:, None]] = 0  # of a time stamp
    m = len(digits)
    return CanBatch(identifier, np.full(m, places == 8), np.full(m, fd), length, data), good


def _overrun(line: bytes) -> int:
    """Tell whether a status line (F and two digits) says that a buffer was full."""
    if line[:1] != b"F" or len(line) != 3 or (_NIBBLES[list(line[1:])] == _BAD).any():
        return 0
    return int(bool(int(line[1:], 16) & 0b1001))  # receive queue full, data overrun


def encode(batch: CanBatch) -> list[bytes]:
    r"""Return each frame as its line, CR included.

    Examples
    --------
    >>> from tirebench.wire.can_batch import same_kind
    >>> encode(same_kind(0x123, np.array([[0, 255]], np.uint8), fd=False))
    [b't123200FF\r']
    """
    codes = np.searchsorted(FD_LENGTHS, batch.length)
    lines = []
    for row in range(len(batch)):
        letter = "b" if batch.fd[row] else "t"
        head = f"{letter}{batch.identifier[row]:03X}"
        if batch.extended[row]:
            head = f"{letter.upper()}{batch.identifier[row]:08X}"
        body = batch.data[row, : batch.length[row]].tobytes().hex().upper()
        lines.append(f"{head}{codes[row]:X}{body}\r".encode())
    return lines
