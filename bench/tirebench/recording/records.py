"""Records of an MCAP file one after the other, in bounded memory whatever the file says of itself.

A record, and a chunk once it is unpacked, may have `LARGEST_RECORD` bytes; all chunks together may
unpack to `LARGEST_RATIO` times their size in the file. The records of a chunk are yielded one by
one.
"""

import io
import zlib
from collections.abc import Iterator
from typing import BinaryIO

from lz4.frame import LZ4FrameDecompressor
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader
from zstandard import ZstdDecompressor

from tirebench.errors import RecordingError

LARGEST_RECORD = 64 * 2**20
"""A longer record is damage, not data, [bytes]."""
LARGEST_RATIO = 100
"""zstd makes strain 2 to 4 times smaller, and gages that say nothing 39 times (frames of
`tests.bench.campaigns`, serial and slcan), so that 50 would do; what goes beyond is made to cost
memory and time. The first `LARGEST_RECORD` bytes are free."""


def records(file: BinaryIO, left_out: list[str] | None = None) -> Iterator[McapRecord]:
    """Yield the records of a file; those of a chunk in the chunk's place.

    A chunk that cannot be unpacked ends them, or is left out where `left_out` takes the reason.

    Raises
    ------
    RecordingError
        If a record, a chunk or all chunks unpack to more than is allowed, or one cannot be
        unpacked. A damaged file raises whatever mcap does.
    """
    taken = unpacked = 0
    reader = StreamReader(file, emit_chunks=True, record_size_limit=LARGEST_RECORD)
    for record in reader.records:
        if not isinstance(record, Chunk):
            yield record
            continue
        try:
            content = _unpacked(record)
        except Exception as error:  # whatever a damaged chunk provokes in its decompressor
            if left_out is None:
                raise
            left_out.append(str(error) or type(error).__name__)
            continue
        taken, unpacked = taken + len(record.data), unpacked + len(content)
        if unpacked > LARGEST_RECORD + LARGEST_RATIO * taken:
            raise RecordingError(
                f"{taken} bytes of chunks unpack to {unpacked} or more; a factor of "
                f"{LARGEST_RATIO} is allowed"
            )
        yield from _within(content)


def _unpacked(chunk: Chunk) -> bytes:
    """Return what a chunk holds; never more than `LARGEST_RECORD` bytes are made of it."""
    if chunk.uncompressed_size > LARGEST_RECORD:
        raise RecordingError(
            f"a chunk unpacks to {chunk.uncompressed_size} bytes; {LARGEST_RECORD} are allowed"
        )
    if chunk.compression == "":
        return chunk.data
    if chunk.compression == "zstd":
        unpacking = ZstdDecompressor(max_window_size=LARGEST_RECORD).stream_reader(
            io.BytesIO(chunk.data)
        )
        content = unpacking.read(LARGEST_RECORD + 1)
    elif chunk.compression == "lz4":
        content = LZ4FrameDecompressor().decompress(chunk.data, max_length=LARGEST_RECORD + 1)
    else:
        raise RecordingError(
            f"a chunk is compressed with {chunk.compression[:20]!r}; zstd and lz4 are allowed"
        )
    if len(content) != chunk.uncompressed_size:
        raise RecordingError(
            f"a chunk unpacks to {len(content)} bytes or more, but states {chunk.uncompressed_size}"
        )
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise RecordingError("a chunk is damaged: its checksum does not match its content")
    return content


def _within(content: bytes) -> Iterator[McapRecord]:
    """Yield the records of an unpacked chunk, one by one."""
    stream = io.BytesIO(content)
    reader = StreamReader(stream, skip_magic=True, emit_chunks=True, record_size_limit=len(content))
    found = reader.records
    while stream.tell() < len(content):
        record = next(found)
        if isinstance(record, Chunk):
            raise RecordingError("a chunk contains a chunk; only messages are allowed there")
        yield record
