"""Tasks to Dask: a local cluster or one by address, with a bounded number of tasks at a time."""

import json
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow.dataset as pads
from distributed import Client, Future, as_completed
from distributed.comm.core import CommClosedError

from tirelib.core.errors import FormatError, ParameterError, TirelibError
from tirelib.core.version import __version__
from tirelib.fleet.dataset import ALSO_AS, ALSO_AT, DataSet, Finished, Rows
from tirelib.fleet.rows import Row
from tirelib.fleet.sources import Source, fingerprint
from tirelib.fleet.tables import PARTITION
from tirelib.fleet.work import NEEDS, TASKS, WRITES, Outcome, Recipe, Verb, failed, process

if TYPE_CHECKING:
    from tirelib.fleet.delta import DeltaLog

AHEAD = 8
"""Tasks a worker that are handed to the scheduler at once. With half of it a worker may wait for
the client between tasks of a millisecond; double costs the scheduler's memory only."""
FEWEST_AHEAD = 64
BATCH = 500
"""Containers whose rows are added as one file."""
LATEST = 5.0
"""Time after which finished rows are added, however few they are, [s]."""


@dataclass(slots=True)
class Counts:
    """How far a fleet has come.

    Among the known, `copies` have the content of another source, here or in an earlier run;
    `negative` counts the finished whose answer is negative.
    """

    total: int = 0
    skipped: int = 0
    known: int = 0
    copies: int = 0
    done: int = 0
    failed: int = 0
    negative: int = 0
    began: float = field(default_factory=time.monotonic)
    messages: dict[str, str] = field(default_factory=dict)
    causes: dict[str, list[str]] = field(default_factory=dict)

    @property
    def left(self) -> int:
        """Sources that are still to be done."""
        return self.total - self.skipped - self.known - self.done - self.failed

    @property
    def rate(self) -> float:
        """Sources done a second."""
        return (self.done + self.failed + self.known) / max(time.monotonic() - self.began, 1e-9)


class SchedulerLostError(FormatError):
    """The scheduler went away; what was finished is kept."""


def recipe_of(
    task: str,
    data: DataSet,
    *,
    files: Mapping[str, str],
    options: Sequence[str] = (),
    reports: bool = False,
) -> Recipe:
    """Return a recipe, and put its files into the data set, where every worker can read them.

    Parameters
    ----------
    task : str
        One of `TASKS`.
    data : DataSet
    files : mapping of str to str
        ``calibration`` and ``model``: a file, the name of a tire that ships with tirelib, or
        another data set of `tirelib fleet calibrate` or `identify`.
    options : sequence of str
    reports : bool

    Raises
    ------
    ParameterError
        If the task is unknown, or lacks the file that it needs, or does not take one.
    FormatError
        If a file cannot be read.
    """
    if task not in TASKS:
        raise ParameterError(f"task {task!r}; allowed are {', '.join(TASKS)}; correct the name")
    needed = NEEDS.get(task)
    if needed is not None and needed not in files:
        raise ParameterError(f"fleet {task}: --{needed} is missing; give a file or a data set")
    for name in files:
        if name != needed:
            raise ParameterError(f"fleet {task}: takes no --{name}; leave it out")
    content = {name: _taken(data, name, given) for name, given in files.items()}
    given = [_by_content(option) for option in options]
    whole = json.dumps(
        [task, [known for _, known in given], {name: h for name, (_, h) in content.items()}]
    )
    return Recipe(
        task,
        tuple(option for option, _ in given),
        {name: path for name, (path, _) in content.items()},
        reports,
        sha256(whole.encode()).hexdigest(),
    )


def _by_content(option: str) -> tuple[str, str]:
    """Return an option for workers of another folder, and what it is known by.

    That is the option itself, or the content of the file that it names (``mine.py``,
    ``--tire=T.toml``), so that results of a file that has changed are not taken for finished.
    """
    name, equals, value = option.rpartition("=") if option.startswith("--") else ("", "", option)
    path = Path(value)
    if not value or not path.is_file():
        return option, option
    digest = sha256(path.read_bytes()).hexdigest()
    return f"{name}{equals}{path.resolve()}", f"{name}{equals}{digest}"


def _taken(data: DataSet, name: str, given: str) -> tuple[str, str]:
    """Put a file, or the index of a data set of such files, into the data set."""
    path = Path(given)
    if path.is_file():
        _check_readable(name, path)
        content, ending = path.read_bytes(), path.name
    else:
        other = DataSet(given)
        if not other.has("fleet.json"):
            if name == "model" and "/" not in given:
                return _shipped(data, given)
            raise FormatError(
                f"--{name} {given}: neither a file nor a data set of `tirelib fleet`; correct it"
            )
        other.check_version()
        content, ending = _index(other, name), "index.json"
    digest = sha256(content).hexdigest()
    place = f"recipes/{digest[:16]}/{ending}"
    data.write(content, *place.split("/"))
    return place, digest


def _check_readable(name: str, path: Path) -> None:
    """Refuse once, before any work, what every task would refuse."""
    from tirelib.core.parameters import read_tire
    from tirelib.estimators.calibration_file import read_calibration

    try:
        read_calibration(path) if name == "calibration" else read_tire(path)
    except TirelibError as error:
        raise FormatError(f"--{name} {error}") from None


def _shipped(data: DataSet, name: str) -> tuple[str, str]:
    """Write a tire that ships with tirelib as a file."""
    from tirelib.core.parameters import read_tire, write_tire

    try:
        tire = read_tire(name)
    except ParameterError as error:
        raise FormatError(f"--model {name}: no data set of `tirelib fleet`; {error}") from None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.toml")
        write_tire(tire, path, "tirelib-model/1")
        return _taken(data, "model", str(path))


def _index(other: DataSet, name: str) -> bytes:
    """Return where a data set has the file of each container and of each tire, the newest last."""
    task = next(task for task, written in WRITES.items() if written == name)
    columns = ["content_hash", "tire", "file", "finished_dt"]
    rows = other.table("container_metrics", columns, pads.field(PARTITION) == task)
    found = sorted(rows.to_pylist(), key=lambda row: row["finished_dt"])
    if not found:
        raise FormatError(
            f"--{name} {other.url}: a data set without any {name}; run `tirelib fleet {task} "
            f"PATHS... --out {other.url}` first"
        )
    return json.dumps(
        {
            "data_set": other.url,
            "by_content": {row["content_hash"]: row["file"] for row in found},
            "by_tire": {row["tire"]: row["file"] for row in found},
        },
        sort_keys=True,
    ).encode()


def run(
    sources: Sequence[Source],
    data: DataSet,
    recipe: Recipe,
    client: Client,
    verb: Verb,
    *,
    counts: Counts | None = None,
    delta: bool = False,
    report: Callable[[Counts], None] = lambda counts: None,
) -> Counts:
    """Run a task over every source that is not finished.

    Parameters
    ----------
    sources : sequence of Source
    data : DataSet
        Opened.
    recipe : Recipe
    client : Client
    verb : callable
        Runs a command of the command line in a worker.
    counts : Counts, optional
        Brought up to date as results come.
    delta : bool
        Keep a Delta log beside the Parquet files; a data set that has one keeps it in any case.
    report : callable
        Called with the counts when the first tasks are handed out, and after results.

    Raises
    ------
    SchedulerLostError
        If the scheduler goes away.
    """
    counts = Counts() if counts is None else counts
    counts.total, counts.began = len(sources), time.monotonic()
    delta = delta or data.has("container_metrics", "_delta_log")
    data.repair(recipe.task)
    finished = data.finished(recipe.task, recipe.hash)
    book = _Book(data, recipe, finished, _delta(data) if delta else None)
    waiting = _unfinished(sources, finished.marks, counts)
    given: dict[Future[Any], tuple[Source, str]] = {}
    done = as_completed()
    room = max(FEWEST_AHEAD, AHEAD * max(sum(client.nthreads().values()), 1))
    try:
        _submit(client, waiting, given, done, room, recipe, data.url, verb)
        report(counts)
        while given:
            for future in done.next_batch():
                source, mark = given.pop(future)
                _take(_outcome(future, source, mark, recipe, client), source, mark, counts, book)
                future.release()
            report(counts)
            book.close(only_if_due=True)
            _submit(client, waiting, given, done, room, recipe, data.url, verb)
    finally:
        client.cancel(list(given), asynchronous=False, force=True) if _alive(client) else None
        book.close()
    return counts


def _delta(data: DataSet) -> "DeltaLog":
    from tirelib.fleet.delta import DeltaLog  # with a package that only --delta needs

    return DeltaLog(data)


def _unfinished(
    sources: Sequence[Source], marks: Mapping[str, int], counts: Counts
) -> Iterator[tuple[Source, str]]:
    for source in sources:
        mark = fingerprint(source)
        if mark in marks:
            counts.skipped += 1
            counts.negative += bool(marks[mark])
        else:
            yield source, mark


def _submit(
    client: Client,
    waiting: Iterator[tuple[Source, str]],
    given: dict[Future[Any], tuple[Source, str]],
    done: Any,
    room: int,
    recipe: Recipe,
    address: str,
    verb: Verb,
) -> None:
    while len(given) < room:
        each = next(waiting, None)
        if each is None:
            return
        future = client.submit(
            process,
            *each,
            recipe,
            address,
            verb,
            key=f"{recipe.task}-{recipe.hash[:8]}-{each[1]}",
            pure=False,
        )
        given[future] = each
        done.add(future)


def _outcome(
    future: Future[Any], source: Source, mark: str, recipe: Recipe, client: Client
) -> Outcome:
    lost = future.status in ("lost", "cancelled")
    if future.status == "finished":
        try:
            return future.result()  # type: ignore[no-any-return]
        except CommClosedError:  # it went while the result was on its way
            lost = True
    if lost:
        raise SchedulerLostError(
            "the scheduler went away; what is finished is kept; start it again, and give the same "
            "command once more"
        )
    error = future.exception()
    return failed(source, mark, recipe, f"{source.url}: {error}", type(error).__name__)


def _alive(client: Client) -> bool:
    return bool(client.status == "running")


def _take(outcome: Outcome, source: Source, mark: str, counts: Counts, book: "_Book") -> None:
    if outcome.failed:
        counts.failed += 1
        counts.messages[source.url] = outcome.failed
        cause = outcome.rows["failures"][0]["cause"]
        counts.causes.setdefault(cause, []).append(outcome.failed)
    elif outcome.known or outcome.container in book.answers:
        counts.known += 1
    else:
        counts.done += 1
    counts.copies += book.add(outcome, source, mark)
    counts.negative += bool(book.answers.get(outcome.container))


class _Book:
    """Rows that are still to be added to the data set."""

    def __init__(
        self, data: DataSet, recipe: Recipe, finished: Finished, log: "DeltaLog | None"
    ) -> None:
        self._data, self._task, self._log = data, recipe.task, log
        self._recipe, self.answers, self._places = recipe.hash, finished.answers, finished.places
        self._open()

    def _open(self) -> None:
        self._rows: dict[str, list[Mapping[str, Any]]] = {}
        self._notes: list[str] = []
        self._channels: list[str] = []
        self._count = 0
        self._since = time.monotonic()

    def add(self, outcome: Outcome, source: Source, mark: str) -> bool:
        """Keep the rows of an outcome, once for each container; return whether it is a copy."""
        if outcome.note:
            self._notes.append(outcome.note)
        rows, copy = outcome.rows, False
        if not outcome.failed:
            if outcome.known or outcome.container in self.answers:
                if (outcome.container, source.url) in self._places:
                    return False
                copy = True
                rows = {"container_tags": self._copy(outcome.container, source.url, mark)}
            else:
                (row,) = rows["container_metrics"]
                self.answers[outcome.container] = row.get("answer", 0)
                self._channels.append(f"{PARTITION}={self._task}/{outcome.container}.parquet")
            self._places.add((outcome.container, source.url))
        if not self._count:
            self._since = time.monotonic()
        self._count += 1
        for name, more in rows.items():
            self._rows.setdefault(name, []).extend(more)
        return copy

    def _copy(self, container: int, url: str, mark: str) -> list[Row]:
        """Return the tags that say where a copy lies."""
        same = {"container_id": container, "tirelib": __version__, "recipe": self._recipe}
        return [{"key": ALSO_AT, "value": url, **same}, {"key": ALSO_AS, "value": mark, **same}]

    def close(self, *, only_if_due: bool = False) -> None:
        """Add the rows to the data set, and remove the notes of what was added."""
        late = time.monotonic() - self._since > LATEST
        if only_if_due and not (self._count >= BATCH or (self._count and late)):
            return
        if self._count:
            rows: Rows = self._rows
            written = self._data.add(self._task, rows)
            if self._log is not None:
                kept = set(self._data.files("channels")) if self._channels else set()
                channels = [("channels", path) for path in self._channels if path in kept]
                self._log.add([*written, *channels])
        for note in self._notes:
            path = self._data.path(note)
            if self._data.fs.exists(path):
                self._data.fs.rm(path)
        self._open()


def causes(counts: Counts) -> list[tuple[str, int]]:
    """Return a message of each cause of failure, the most frequent first, with their numbers."""
    ordered = sorted(counts.causes.values(), key=len, reverse=True)
    return [(messages[0].splitlines()[0], len(messages)) for messages in ordered]
