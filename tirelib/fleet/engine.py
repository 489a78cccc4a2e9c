"""Tasks to Dask: a local cluster or one by address, with a bounded number of tasks at a time."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from distributed import Client, Future, as_completed
from distributed.comm.core import CommClosedError

from tirelib.core.errors import FormatError
from tirelib.core.version import __version__
from tirelib.fleet.dataset import ALSO_AS, ALSO_AT, DataSet, Finished, Rows
from tirelib.fleet.rows import Row
from tirelib.fleet.sources import Source, fingerprint
from tirelib.fleet.tables import PARTITION
from tirelib.fleet.work import Outcome, Recipe, Verb, failed, process

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
