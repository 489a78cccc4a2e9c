"""A recording without its end, or with damaged chunks, as a whole file with an index."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from tirebench.errors import RecordingError, cause
from tirebench.recording.new_file import whole
from tirebench.recording.records import records

CHUNK = 2**20
"""Chunk size of the repaired file, [bytes before compression]."""


@dataclass(frozen=True, slots=True)
class Repaired:
    """What was found.

    Attributes
    ----------
    messages : int
    topics : tuple of str
    damage : str
        Where the file breaks off, and which chunks are left out; empty if it is whole.
    """

    messages: int
    topics: tuple[str, ...]
    damage: str


def repair(path: Path, out: Path) -> Repaired:
    """Write all that can be read of a recording into a new file, with its index.

    Raises
    ------
    RecordingError
        If nothing can be read, or the new file not be written.
    """
    with whole(out) as new:
        return _repaired(path, new)


def _repaired(path: Path, new: Path) -> Repaired:
    try:
        with path.open("rb") as file, new.open("xb") as target:
            writer = Writer(target, CHUNK, CompressionType.ZSTD)
            writer.start("", "tirebench")
            left_out: list[str] = []
            found = _copied(records(file, left_out), writer, left_out)
            finish: Callable[[], None] = writer.finish  # mcap has no annotation here
            finish()
    except OSError as error:
        raise RecordingError(
            f"{path}: cannot be read, or its repaired copy cannot be written ({cause(error)}), and "
            "no partial copy is left; a recording and enough free disk space are needed; check "
            "both"
        ) from None
    if not found.topics:
        raise RecordingError(
            f"{path}: nothing in it can be read ({found.damage}); a file that `tirebench run` "
            "wrote with --record or --json is needed; name one"
        )
    return found


def _copied(found: Iterator[McapRecord], writer: Writer, left_out: list[str]) -> Repaired:
    """Copy records up to the end, or up to the first that is broken outside a chunk left out."""
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    topics: dict[str, None] = {}
    count, damage = 0, ""
    try:
        for record in found:
            if isinstance(record, Schema) and record.id not in schemas:
                number = writer.register_schema(record.name, record.encoding, record.data)
                schemas[record.id] = number
            elif isinstance(record, Channel) and record.id not in channels:
                topics[record.topic] = None
                channels[record.id] = writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    schemas[record.schema_id],
                    record.metadata,
                )
            elif isinstance(record, Message):
                if left_out and record.channel_id not in channels:
                    continue  # its channel stood in a chunk that is left out
                count += 1
                writer.add_message(
                    channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            elif isinstance(record, Metadata):
                writer.add_metadata(record.name, record.metadata)
    except OSError:
        raise
    except Exception as error:  # whatever a damaged file provokes in mcap
        damage = str(error) or type(error).__name__
    if left_out:
        chunks = "chunk is" if len(left_out) == 1 else "chunks are"
        damage = "; ".join(
            [f"{len(left_out)} {chunks} left out: {left_out[0]}", *([damage] if damage else [])]
        )
    return Repaired(count, tuple(topics), damage)
