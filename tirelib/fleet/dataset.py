"""The data set on disk or in a bucket: what is finished, and how results are added to it.

Three rules make it safe against a kill at any time. A worker first writes the channels of a
container, then its small rows as a note under ``pending/``, and its document last. The client
adds the small rows of many containers as one file a table, ``container_metrics`` last, and then
removes the notes. At the next start, files of a batch whose ``container_metrics`` is missing are
removed, and notes that are still there are taken without computing anything again.
"""

import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

import pyarrow as pa
import pyarrow.dataset as pads
import pyarrow.parquet as pq

from tirelib.core.errors import FormatError
from tirelib.core.version import __version__
from tirelib.fleet.sources import filesystem
from tirelib.fleet.tables import CLIENT_TABLES, PARTITION, SCHEMAS

FORMAT = "tirelib-fleet/1"
HEAD = "fleet.json"
ALSO_AT, ALSO_AS = "also_at", "also_as"
"""Tags of a container: address and fingerprint of a copy, whose content is the container's."""
Rows = Mapping[str, Sequence[Mapping[str, Any]]]


@dataclass(frozen=True, slots=True)
class Finished:
    """The finished containers of a task.

    Attributes
    ----------
    answers : dict of int to int
        The verb's exit code, by identifier.
    marks : dict of str to int
        The same by fingerprint, that of a copy too.
    places : set of (int, str)
        Identifier and address, those of copies too.
    """

    answers: dict[int, int] = field(default_factory=dict)
    marks: dict[str, int] = field(default_factory=dict)
    places: set[tuple[int, str]] = field(default_factory=set)


class DataSet:
    """A data set at an address.

    Parameters
    ----------
    url : str
        A folder, or an address that fsspec knows.

    Raises
    ------
    FormatError
        If there is something else at the address, or a version that is unknown here.
    """

    def __init__(self, url: str) -> None:
        self.fs, self.root = filesystem(url)
        self.local = self.fs.protocol in ("file", ("file", "local"))
        self.url = self.root if self.local else url  # workers have another working directory

    def path(self, *parts: str) -> str:
        """Return the path of a file on the data set's file system."""
        return "/".join((self.root.rstrip("/"), *parts))

    def open(self) -> None:
        """Begin a data set, or check that this is one.

        Raises
        ------
        FormatError
            If it is not one of this version, or cannot be written.
        """
        try:
            if self.fs.exists(self.path(HEAD)):
                self.check_version()
                return
            if self.fs.exists(self.root) and self.fs.ls(self.root):
                raise FormatError(
                    f"{self.url}: not empty and not a data set of `tirelib fleet` (no {HEAD}); "
                    "choose another --out"
                )
            head = {"format": FORMAT, "tirelib": __version__}
            self.write(json.dumps(head).encode(), HEAD)
        except FormatError:
            raise
        except Exception as error:  # each kind of storage has errors of its own
            raise FormatError(
                f"{self.url}: cannot be written ({error}); choose another --out, or check its keys"
            ) from None

    def check_version(self) -> None:
        """Refuse a data set of another version, or one whose head is damaged.

        Raises
        ------
        FormatError
            If it is one.
        """
        head = self.read(HEAD)
        try:
            given = json.loads(head)["format"]
        except (ValueError, KeyError, TypeError):
            raise FormatError(
                f"{self.url}: {HEAD} is damaged ({head[:40]!r}); it must hold "
                f"{json.dumps({'format': FORMAT})}; write that into it, or choose another data set"
            ) from None
        if given != FORMAT:
            raise FormatError(
                f"{self.url}: a data set of format {given!r}; this version reads {FORMAT!r}; "
                "choose another data set"
            )

    def write(self, content: bytes, *parts: str) -> None:
        """Write a file whole or not at all."""
        with self.writing(*parts) as aside:
            aside.write_bytes(content)

    @contextmanager
    def writing(self, *parts: str) -> Iterator[Path]:
        """Yield a file of this machine that becomes the data set's at the end, whole or not.

        Raises
        ------
        FormatError
            If it cannot be written, for instance because the disk is full.
        """
        target = self.path(*parts)
        if self.local:
            place = Path(target)
            aside = place.with_name(f".{uuid4().hex}.part")
            try:
                place.parent.mkdir(parents=True, exist_ok=True)
                yield aside
                aside.replace(place)
            except OSError as error:
                raise FormatError(
                    f"{target}: cannot be written ({error.strerror or error}); make room or give "
                    "the right to write, and give the same command again"
                ) from None
            finally:
                aside.unlink(missing_ok=True)
            return
        with tempfile.TemporaryDirectory() as folder:
            aside = Path(folder, "part")
            yield aside
            self.fs.put_file(str(aside), target)

    def read(self, *parts: str) -> bytes:
        """Return the content of a file."""
        return bytes(self.fs.cat_file(self.path(*parts)))

    def has(self, *parts: str) -> bool:
        """Return whether there is such a file."""
        return bool(self.fs.exists(self.path(*parts)))

    def table(
        self, name: str, columns: Sequence[str] | None = None, filter: Any = None
    ) -> pa.Table:
        """Return the rows of a table; empty if there are none."""
        files = self._files(name)
        schema = SCHEMAS[name].append(pa.field(PARTITION, pa.string()))
        if not files:
            empty = schema.empty_table()
            return empty if columns is None else empty.select(list(columns))
        data = pads.dataset(
            files,
            schema=schema,
            filesystem=self.fs,
            format="parquet",
            partitioning=pads.partitioning(
                pa.schema([pa.field(PARTITION, pa.string())]), flavor="hive"
            ),
            partition_base_dir=self.path(name),
        )
        return data.to_table(columns=None if columns is None else list(columns), filter=filter)

    def files(self, name: str) -> list[str]:
        """Return the paths of a table's files within it."""
        return [path.partition(f"/{name}/")[2] for path in self._files(name)]

    def _files(self, name: str) -> list[str]:
        folder = self.path(name)
        if not self.fs.exists(folder):
            return []
        return [
            path
            for path in self.fs.find(folder)
            if path.endswith(".parquet") and f"/{name}/{PARTITION}=" in path and "/." not in path
        ]

    def finished(self, task: str, recipe: str) -> Finished:
        """Return what of a task is finished, and where its content lies."""
        found = Finished()
        chosen = (pads.field(PARTITION) == task) & (pads.field("recipe") == recipe)
        columns = ["container_id", "fingerprint", "answer", "file_path"]
        for row in self.table("container_metrics", columns, chosen).to_pylist():
            found.answers[row["container_id"]] = row["answer"]
            found.marks[row["fingerprint"]] = row["answer"]
            found.places.add((row["container_id"], row["file_path"]))
        columns = ["container_id", "key", "value"]
        chosen &= pads.field("key").isin([ALSO_AT, ALSO_AS])
        for row in self.table("container_tags", columns, chosen).to_pylist():
            if row["key"] == ALSO_AT:
                found.places.add((row["container_id"], row["value"]))
            elif row["container_id"] in found.answers:
                found.marks[row["value"]] = found.answers[row["container_id"]]
        return found

    def repair(self, task: str) -> None:
        """Remove the files of batches that were not written to their end."""
        whole = {_batch(path) for path in self._files("container_metrics")}
        for name in CLIENT_TABLES:
            if name == "container_metrics":
                continue
            for path in self._files(name):
                if f"/{PARTITION}={task}/" in path and _batch(path) not in whole:
                    self.fs.rm(path)

    def add(self, task: str, rows: Rows) -> list[tuple[str, str]]:
        """Add the rows of a batch; return (table, path within it) of each file."""
        batch = uuid4().hex
        written = []
        for name in CLIENT_TABLES:
            if name != "container_metrics" and not rows.get(name):
                continue
            table = pa.Table.from_pylist(list(rows.get(name, ())), schema=SCHEMAS[name])
            place = f"{PARTITION}={task}/{batch}.parquet"
            with self.writing(name, place) as aside:
                pq.write_table(table, aside, compression="zstd")
            written.append((name, place))
        return written


def _batch(path: str) -> str:
    return path.rpartition("/")[2].removesuffix(".parquet")


def now() -> datetime:
    """Return the time, UTC."""
    return datetime.now(UTC)
