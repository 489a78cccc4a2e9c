"""The beginning of an ASAM MDF 4 file: whether it is one, whether it is whole, when it began."""

import mmap
import struct
from pathlib import Path

from tirelib.core.errors import Fault, FormatError

_MAGIC = b"MDF     "
_UNFINISHED = b"UnFinMF "
WHOLE = (
    "a complete file is needed",
    "copy it again from the logger or take the run out of runs.csv",
)
HEADER_END = 168  # identification block 64 bytes, header block 104 bytes
START_TIME = 64 + 24 + 6 * 8  # in the header block, after its links: ns since 1970
_BLOCK_HEAD = 24  # of any block: 4 bytes name, 4 spare, 8 length, 8 number of links


def check_beginning(content: "bytes | mmap.mmap") -> None:
    """Refuse what does not begin like a finished MDF 4 file.

    Raises
    ------
    FormatError
        Saying what it is instead.
    """
    beginning = content[:8]
    if beginning == _UNFINISHED:
        raise FormatError(
            Fault(
                "",
                "the recording was never finished (UnFinMF)",
                "a finished MDF 4 file is needed",
                "finish it with the logger's own tool",
            )
        )
    if beginning != _MAGIC:
        raise FormatError(
            Fault(
                "",
                f"not an MDF file (begins with {beginning!r})",
                "ASAM MDF 4 is needed",
                "convert it with `tirelib import`",
            )
        )
    if content[8:9] != b"4":
        version = content[8:16].decode("ascii", "replace").strip(" \0")
        raise FormatError(
            Fault(
                "",
                f"MDF version {version or 'unknown'}",
                "version 4 is needed",
                "convert it with the logger's own tool",
            )
        )
    if not _has_header(content):
        raise FormatError(
            Fault(
                "",
                f"truncated or damaged MDF 4 file of {len(content)} bytes (no whole header)",
                *WHOLE,
            )
        )


def _has_header(content: "bytes | mmap.mmap") -> bool:
    """Return whether the header and the chains of data and channel groups lie within the file.

    The reader would find that out too, but leaves a half-made object behind.
    """
    if len(content) < HEADER_END or content[64:68] != b"##HD":
        return False
    first_group, *others = struct.unpack_from("<6Q", content, 64 + _BLOCK_HEAD)
    if any(address and _links(content, address) is None for address in others):
        return False
    to_visit, seen = [first_group], {0}
    while to_visit:
        address = to_visit.pop()
        if address in seen:
            continue
        seen.add(address)
        links = _links(content, address)
        if links is None:
            return False
        # a data group links to the next one and its first channel group, that to the next
        count = {b"##DG": 2, b"##CG": 1}.get(content[address : address + 4], 0)
        to_visit += links[:count]
    return True


def _links(content: "bytes | mmap.mmap", address: int) -> list[int] | None:
    """Return the links of the block at an address, None when it does not lie within the file."""
    if address + _BLOCK_HEAD > len(content):
        return None
    length, count = struct.unpack_from("<2Q", content, address + 8)
    if address + length > len(content) or _BLOCK_HEAD + 8 * count > length:
        return None
    return list(struct.unpack_from(f"<{count}Q", content, address + _BLOCK_HEAD))


def started_at(path: Path) -> float | None:
    """Return when a recording began, [s since 1970-01-01 UTC]; None if the file does not say."""
    try:
        with path.open("rb") as stream:
            head = stream.read(HEADER_END)
    except OSError:
        return None
    if len(head) < HEADER_END or not head.startswith(_MAGIC):
        return None
    return 1e-9 * float(struct.unpack_from("<Q", head, START_TIME)[0]) or None
