"""An MCAP file with chunks and an index that can be gone on with, whoever ended before.

The writer of the `mcap` package cannot go on in a file that another process has begun, nor take
back what a full disk did not hold. Its records are used here; what is added is which bytes of the
file are whole, so that everything after them can be cut off.
"""

import zlib
from collections import defaultdict
from collections.abc import Callable, Mapping
from io import SEEK_CUR
from pathlib import Path
from struct import Struct
from typing import Any, BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

LEVEL = 1
"""Level of the compression: 1 halves the text of samples at 300 MB/s; 3 takes twice the time for 5
%."""
LARGEST_CHUNK = 4 * 2**20
"""A chunk is closed when it is longer, [bytes before compression]."""
_HEAD = Struct("<BQ")
_MESSAGE = Struct("<BQHIQQ")
_INDEX = Struct("<HI")
_INDEX_ENTRY = 16


class McapLog:
    """Write messages in chunks; what `flush` has written stays whatever happens next.

    Parameters
    ----------
    path : Path
    length : int, optional
        Length of the undamaged part of an existing file, in bytes. What follows is cut off.

    Attributes
    ----------
    length : int
        Bytes of the file that are whole: all records, and each chunk with its index.

    Raises
    ------
    OSError
        If the file exists already (without `length`), or cannot be written.
    """

    def __init__(self, path: Path, length: int | None = None) -> None:
        self.length = 0
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = defaultdict(int)
        self._pending = RecordBuilder()  # records that stand before the next chunk
        self._noted: list[MetadataIndex] = []
        self._begin_chunk()
        self._sequence = 0
        self._file: BinaryIO = path.open("xb" if length is None else "r+b", buffering=0)
        if length is None:
            self._pending.write(MCAP0_MAGIC)
            Header("", "tirebench").write(self._pending)
            return
        try:
            with path.open("rb") as file:
                self._scan(file, length)
            self._file.truncate(self.length)
            self._file.seek(self.length)
        except BaseException:
            self._file.close()
            raise

    @property
    def waiting(self) -> int:
        """Bytes that are not written yet, before compression."""
        return self._pending.count + len(self._chunk)

    def channel(
        self,
        topic: str,
        encoding: str,
        schema: tuple[str, bytes] | None = None,
        metadata: Mapping[str, str] | None = None,
    ) -> int:
        """Return the channel of a topic; a new one the first time.

        Parameters
        ----------
        topic, encoding : str
        schema : tuple of str and bytes, optional
            Name and JSON schema of the messages.
        metadata : mapping, optional
        """
        for channel in self._channels.values():
            if channel.topic == topic:
                return int(channel.id)
        number = 0 if schema is None else self._schema(*schema)
        channel = Channel(len(self._channels) + 1, topic, encoding, dict(metadata or {}), number)
        self._channels[channel.id] = channel
        channel.write(self._pending)
        return int(channel.id)

    def message(self, channel: int, time: int, data: bytes) -> None:
        """Add a message of a moment [ns, UTC]."""
        self._offsets[channel].append((time, len(self._chunk)))
        self._sequence = (self._sequence + 1) % 2**32
        self._chunk += _MESSAGE.pack(
            Opcode.MESSAGE, 22 + len(data), channel, self._sequence, time, time
        )
        self._chunk += data
        if len(self._chunk) > LARGEST_CHUNK:
            self.flush()

    def metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Add a record of texts; it stands before the chunk that is not closed yet."""
        place = self.length + self._pending.count
        before = self._pending.count
        Metadata(metadata=dict(entries), name=name).write(self._pending)
        self._noted.append(
            MetadataIndex(length=self._pending.count - before, name=name, offset=place)
        )

    def flush(self) -> None:
        """Close the chunk and write everything; on an error nothing of it is in the file.

        Raises
        ------
        OSError
            After which the messages since the last `flush` are forgotten.
        """
        if not self.waiting:
            return
        try:
            before = _taken(self._pending)
            chunk, index = self._closed_chunk(self.length + len(before))
            self._write(before + chunk)
        except OSError:
            self._take_back()
            raise
        self.length += len(before) + len(chunk)
        self._metadata += self._noted
        if index is not None:
            self._chunks.append(index)
            for channel, offsets in self._offsets.items():
                self._counts[channel] += len(offsets)
        self._begin_chunk()

    def finish(self) -> None:
        """Write what waits and the summary, and close the file.

        Raises
        ------
        OSError
            If there is no room for it: the file is closed up to what was written before.
        """
        try:
            self.flush()
            self._write(self._summary())
        except OSError:
            self._take_back()
            raise
        finally:
            self._file.close()

    def abandon(self) -> None:
        """Close the file as it is."""
        self._file.close()

    @property
    def closed(self) -> bool:
        """Whether the file is closed."""
        return self._file.closed

    def _schema(self, name: str, data: bytes) -> int:
        for schema in self._schemas.values():
            if schema.name == name:
                return int(schema.id)
        schema = Schema(data=data, encoding="jsonschema", id=len(self._schemas) + 1, name=name)
        self._schemas[schema.id] = schema
        schema.write(self._pending)
        return int(schema.id)

    def _begin_chunk(self) -> None:
        self._chunk = bytearray()
        self._offsets: dict[int, list[tuple[int, int]]] = defaultdict(list)
        self._noted = []

    def _write(self, data: bytes) -> None:
        """Write all of it: a raw file may take a part where a disk is nearly full."""
        view = memoryview(data)
        while view:
            view = view[self._file.write(view) or 0 :]

    def _take_back(self) -> None:
        """Cut off what was written in part; channels that were in it are announced again."""
        self._pending = RecordBuilder()
        if self.length == 0:
            self._pending.write(MCAP0_MAGIC)
            Header("", "tirebench").write(self._pending)
        for record in (*self._schemas.values(), *self._channels.values()):
            record.write(self._pending)  # the same ones again, which MCAP allows
        self._begin_chunk()
        if not self._file.closed:
            self._file.truncate(self.length)
            self._file.seek(self.length)

    def _closed_chunk(self, place: int) -> tuple[bytes, ChunkIndex | None]:
        """Return the chunk that goes to this place, with the index of its messages."""
        if not self._chunk:
            return b"", None
        content = bytes(self._chunk)
        packed = zstandard.compress(content, LEVEL)
        times = [time for offsets in self._offsets.values() for time, _ in offsets]
        chunk = Chunk(
            compression="zstd",
            data=packed,
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        builder = RecordBuilder()
        chunk.write(builder)
        length = builder.count
        offsets: dict[int, int] = {}
        for channel, records in self._offsets.items():
            offsets[channel] = place + builder.count
            MessageIndex(channel, records).write(builder)
        index = _index_of(chunk, place, length, offsets, builder.count - length)
        return _taken(builder), index

    def _scan(self, file: BinaryIO, length: int) -> None:
        """Read the index of a file that was begun before; what chunks hold is passed over."""
        stream = ReadDataStream(file)
        file.seek(len(MCAP0_MAGIC))
        while file.tell() + _HEAD.size <= length:
            place = file.tell()
            code, size = _HEAD.unpack(file.read(_HEAD.size))
            end = place + _HEAD.size + size
            if end > length or code in (Opcode.DATA_END, Opcode.FOOTER):
                break
            if code == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self._schemas[schema.id] = schema
            elif code == Opcode.CHANNEL:
                channel = Channel.read(stream)
                self._channels[channel.id] = channel
            elif code == Opcode.METADATA:
                name = Metadata.read(stream).name
                self._metadata.append(MetadataIndex(length=end - place, name=name, offset=place))
            elif code == Opcode.CHUNK:
                self._chunks.append(_index_at(file, stream, place, end - place))
            elif code == Opcode.MESSAGE_INDEX:
                number, entries = _INDEX.unpack(file.read(_INDEX.size))
                chunk = self._chunks[-1]
                chunk.message_index_offsets[number] = place
                chunk.message_index_length += end - place
                self._counts[number] += entries // _INDEX_ENTRY
            file.seek(end)
            self.length = end

    def _summary(self) -> bytes:
        """Return all that follows the data."""
        builder = RecordBuilder()
        DataEnd(0).write(builder)
        start = self.length + builder.count
        groups: list[tuple[int, list[Any]]] = [
            (Opcode.SCHEMA, list(self._schemas.values())),
            (Opcode.CHANNEL, list(self._channels.values())),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        offsets = []
        for code, records in groups:
            place = self.length + builder.count
            for record in records:
                record.write(builder)
            if records:
                size = self.length + builder.count - place
                offsets.append(
                    SummaryOffset(group_opcode=code, group_start=place, group_length=size)
                )
        offset_start = self.length + builder.count
        for offset in offsets:
            offset.write(builder)
        data = _taken(builder)
        crc = zlib.crc32(data[start - self.length :])
        crc = zlib.crc32(Struct("<BQQQ").pack(Opcode.FOOTER, 20, start, offset_start), crc)
        Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc).write(
            builder
        )
        return data + _taken(builder) + MCAP0_MAGIC

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _taken(builder: RecordBuilder) -> bytes:
    """Return what was built, and empty the builder."""
    end: Callable[[], bytes] = builder.end  # mcap has no annotation here
    return end()


def _index_at(file: BinaryIO, stream: ReadDataStream, place: int, length: int) -> ChunkIndex:
    """Return the index entry of a chunk without reading its content."""
    first, last, size = stream.read8(), stream.read8(), stream.read8()
    crc, compression, packed = stream.read4(), stream.read_prefixed_string(), stream.read8()
    file.seek(packed, SEEK_CUR)
    chunk = Chunk(
        compression=compression,
        data=b"",
        message_start_time=first,
        message_end_time=last,
        uncompressed_crc=crc,
        uncompressed_size=size,
    )
    entry = _index_of(chunk, place, length, {}, 0)
    entry.compressed_size = packed
    return entry


def _index_of(
    chunk: Chunk, place: int, length: int, offsets: dict[int, int], index_length: int
) -> ChunkIndex:
    return ChunkIndex(
        chunk_length=length,
        chunk_start_offset=place,
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        message_end_time=chunk.message_end_time,
        message_index_length=index_length,
        message_index_offsets=offsets,
        message_start_time=chunk.message_start_time,
        uncompressed_size=chunk.uncompressed_size,
    )
