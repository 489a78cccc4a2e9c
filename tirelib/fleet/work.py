"""One task: a verb over one campaign or recording, in a worker.

The verb is the one of the command line, called in this process: `Verb` is handed in by whoever
builds the command line, so that results are those of ``tirelib VERB DIR --json FILE``.
"""

import json
import re
import socket
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from threading import Lock

from tirelib.campaign.campaign_fault import CampaignFault, errors_of
from tirelib.campaign.header import parse_header
from tirelib.campaign.mdf_header import started_at
from tirelib.campaign.plan import parse_plans
from tirelib.campaign.recording import FILE as RECORDING
from tirelib.campaign.recording import read_recording
from tirelib.core.errors import Fault, FormatError, TirelibError
from tirelib.core.version import __version__
from tirelib.fleet.dataset import HEAD, DataSet, now
from tirelib.fleet.rows import Channels, Row, every, result_rows
from tirelib.fleet.sources import Source, content_hash, fetched
from tirelib.report.fleet_container import container_page

TASKS: Mapping[str, tuple[str, ...]] = {
    "check": ("campaign", "check"),
    "features": ("features",),
    "calibrate": ("calibrate",),
    "estimate": ("estimate",),
    "identify": ("identify",),
    "compare": ("compare",),
    "diagnose": ("diagnose",),
}
"""The command behind each task."""
NEEDS: Mapping[str, str] = {"estimate": "calibration", "compare": "model", "diagnose": "model"}
"""The file that a task cannot go without."""
TABLES = frozenset({"features", "estimate"})
"""Tasks that give a table of turns."""
WRITES: Mapping[str, str] = {"calibrate": "calibration", "identify": "model"}
"""Tasks that make a file which another task takes."""
REPORTS: Mapping[str, str] = {
    "calibrate": "--report",
    "estimate": "--report",
    "compare": "--out",
    "diagnose": "--out",
}
"""Options by which a task writes its whole report, with figures."""
Verb = Callable[[Sequence[str]], tuple[int, str]]
"""Runs a command of the command line: its exit code, and what it printed."""
_ONE_AT_A_TIME = Lock()  # what a verb prints is caught for the whole process


@dataclass(frozen=True, slots=True)
class Recipe:
    """What is done to every source.

    Attributes
    ----------
    task : str
    options : tuple of str
        Further options of the verb.
    files : mapping of str to str
        ``calibration`` or ``model``: the path, below the data set, of a file or of an index by
        content and tire.
    reports : bool
        Write each container's whole report.
    hash : str
        SHA-256 of task, options and files.
    """

    task: str
    options: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    reports: bool = False
    hash: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a source: rows by table, or nothing where it was finished before.

    Attributes
    ----------
    container : int
    failed : str
        The message; empty where it was done.
    rows : mapping of table to rows
    note : str
        Path of the note that the client removes when the rows are added.
    known : bool
        It was finished before, perhaps at another address.
    """

    container: int
    failed: str
    rows: Mapping[str, list[Row]]
    note: str = ""
    known: bool = False


def container_of(recipe: Recipe, content: str) -> int:
    """Return the identifier of a container: 63 bits of the hash of task, recipe and content."""
    digest = sha256(f"{recipe.task}\0{recipe.hash}\0{content}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1


def process(source: Source, mark: str, recipe: Recipe, address: str, verb: Verb) -> Outcome:
    """Run the task over one source; whatever goes wrong becomes the outcome's message.

    Parameters
    ----------
    source : Source
    mark : str
        Its fingerprint.
    recipe : Recipe
    address : str
        Address of the data set.
    verb : callable
    """
    with _ONE_AT_A_TIME:
        try:
            return _processed(source, mark, recipe, DataSet(address), verb)
        except TirelibError as error:
            cause = error.faults[0].given if error.faults else str(error)
            return failed(source, mark, recipe, str(error), cause)
        except Exception as error:  # one bad source never stops the others
            lines = traceback.format_exception_only(error)
            where = traceback.extract_tb(error.__traceback__)[-1]
            said = f"{''.join(lines).strip()} (unexpected, in {where.name}, line {where.lineno})"
            return failed(source, mark, recipe, said, type(error).__name__)


def failed(source: Source, mark: str, recipe: Recipe, message: str, cause: str) -> Outcome:
    """Return the outcome of a source that could not be done."""
    place = source.url.rpartition("/")[2]
    shared = message.replace(source.url, place)
    container = container_of(recipe, mark)
    row = {
        "container_id": container,
        "file_path": source.url,
        "fingerprint": mark,
        "cause": re.sub(r"\d[\d.e+-]*", "N", cause.replace(source.url, "").strip(" :,"))[:120],
        "message": shared[:2000],
        "failed_dt": now(),
        "flags": "failed",
        "tirelib": __version__,
        "recipe": recipe.hash,
    }
    return Outcome(container, message, {"failures": [row]})


def _processed(source: Source, mark: str, recipe: Recipe, data: DataSet, verb: Verb) -> Outcome:
    with ExitStack() as stack:
        aside = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tirelib-fleet-")))
        _check_seen(source, data)
        folder = fetched(source, aside)
        content = content_hash(folder)
        container = container_of(recipe, content)
        names = _Names(recipe.task, container)
        if data.has(*names.note):
            return _noted(container, data, names)
        if data.has(*names.document):
            return Outcome(container, "", {}, known=True)
        return _compute(_Job(source, mark, recipe, data, container, content), folder, aside, verb)


def _check_seen(source: Source, data: DataSet) -> None:
    """Refuse a folder that only the client's machine has."""
    for url, seen in (
        (source.url, not source.local or Path(source.url).is_dir()),
        (data.url, not data.local or data.has(HEAD)),
    ):
        if not seen:
            raise FormatError(
                Fault(
                    url,
                    "no such folder on the worker's machine",
                    f"a path must be the same folder on every machine, {socket.gethostname()} too",
                    "give a shared file system or a URL",
                )
            )


@dataclass(frozen=True, slots=True)
class _Names:
    """Paths of a container's own files, below the data set."""

    task: str
    container: int

    @property
    def note(self) -> tuple[str, ...]:
        return ("pending", self.task, f"{self.container}.json")

    @property
    def document(self) -> tuple[str, ...]:
        return ("documents", self.task, f"{self.container}.json")

    @property
    def channels(self) -> tuple[str, ...]:
        return ("channels", f"task={self.task}", f"{self.container}.parquet")

    @property
    def page(self) -> tuple[str, ...]:
        return ("pages", self.task, f"{self.container}.html")

    @property
    def report(self) -> tuple[str, ...]:
        return ("pages", self.task, str(self.container))


@dataclass(frozen=True, slots=True)
class _Job:
    source: Source
    mark: str
    recipe: Recipe
    data: DataSet
    container: int
    content: str


def _noted(container: int, data: DataSet, names: _Names) -> Outcome:
    """Take what a worker noted and no client has added yet."""
    rows = json.loads(data.read(*names.note))
    for row in (*rows.get("container_metrics", ()), *rows.get("failures", ())):
        for key, value in row.items():
            if key.endswith("_dt") and value is not None:
                row[key] = datetime.fromisoformat(value)
    return Outcome(container, "", rows, note="/".join(names.note))


def _compute(job: _Job, folder: Path, aside: Path, verb: Verb) -> Outcome:
    began = time.perf_counter()
    recipe, data, names = job.recipe, job.data, _Names(job.recipe.task, job.container)
    about = _about(folder)
    if about.kind == "recording" and recipe.task != "estimate":
        raise FormatError(
            Fault(
                job.source.url,
                "a recording is given",
                f"{recipe.task} takes campaigns, and estimate takes both",
                "leave it out of PATHS",
            )
        )
    answer = aside / "answer.json"
    turns = aside / "turns.parquet"
    made = aside / "made.toml"
    report = aside / "report"
    command = [*TASKS[recipe.task], str(folder), "--json", str(answer), *recipe.options]
    for name, path in recipe.files.items():
        command += [f"--{name}", str(_local(data.url, path, job.content, about))]
    if recipe.task in TABLES:
        command += ["--out", str(turns)]
    if recipe.task in WRITES:
        command += ["--out", str(made)]
    reports = recipe.reports and recipe.task in REPORTS
    if reports and about.kind == "campaign":
        command += [REPORTS[recipe.task], str(report)]
    code, said = verb(command)
    if not answer.is_file():
        raise FormatError(said.strip()[-2000:] or f"the verb ended with exit code {code}")
    document = json.loads(answer.read_text())
    same = {"container_id": job.container, "tirelib": __version__, "recipe": recipe.hash}
    channels = Channels(job.container, recipe.hash, about.begins)
    if turns.is_file():
        with data.writing(*names.channels) as target:
            channels.write(turns, target)
    document.pop("turns", None) if recipe.task == "estimate" else None
    results = result_rows(recipe.task, document)
    file = ""
    if made.is_file():
        file = f"files/{recipe.task}/{job.container}.toml"
        data.write(made.read_bytes(), *file.split("/"))
    metrics = channels.metrics()
    begin = about.start
    end = max((row["end_s"] for row in metrics), default=about.length)
    container = {
        "start_dt": begin,
        "stop_dt": None if begin is None else begin + timedelta(seconds=end),
        "start_ts": None if begin is None else round(1e6 * begin.timestamp()),
        "stop_ts": None if begin is None else round(1e6 * (begin.timestamp() + end)),
        "duration_ms": round(1e3 * end),
        "num_channels": len(metrics),
        "file_name": job.source.url.rpartition("/")[2],
        "file_path": job.source.url,
        "kind": about.kind,
        "name": about.name,
        "tire": about.tire,
        "content_hash": job.content,
        "fingerprint": job.mark,
        "answer": code,
        "compute_s": time.perf_counter() - began,
        "page": "/".join(names.page),
        "document": "/".join(names.document),
        "file": file,
        "finished_dt": now(),
        "flags": "" if code == 0 else "negative",
    }
    tags = [{"key": key, "value": value} for key, value in about.tags.items() if value]
    rows = {
        "container_tags": every(tags, **same),
        "channel_metrics": every(metrics, **same),
        "channel_tags": every(channels.tags(), **same),
        "results": every(results, tire=about.tire, **same),
        "container_metrics": every([container], **same),
    }
    if report.is_dir():
        for part in sorted(each for each in report.rglob("*") if each.is_file()):
            data.write(part.read_bytes(), *names.report, *part.relative_to(report).parts)
    whole = names.report[-1] if report.is_dir() else ""
    page = container_page(recipe.task, container, results, metrics, said, whole)
    data.write(page.encode(), *names.page)
    data.write(json.dumps(rows, default=str).encode(), *names.note)
    data.write(json.dumps(document).encode(), *names.document)  # last: see `DataSet`
    return Outcome(job.container, "", rows, note="/".join(names.note))


@dataclass(frozen=True, slots=True)
class _About:
    kind: str
    name: str
    tire: str
    start: datetime | None
    length: float
    begins: Mapping[int, float]
    tags: Mapping[str, str]
    faults: tuple[CampaignFault, ...] = ()


def _about(folder: Path) -> _About:
    """Return what the tables say of a campaign or recording, as far as it can be read."""
    if (folder / RECORDING).is_file():
        recording = read_recording(folder)
        tires = sorted({wheel.tire for wheel in recording.wheels})
        wheels = {f"wheel.{wheel.name}": wheel.tire for wheel in recording.wheels}
        tags = {"name": recording.name, "tire": ";".join(tires), "axes": "iso", **wheels}
        began = min(filter(None, map(started_at, recording.files)), default=None)
        return _About("recording", recording.name, ";".join(tires), _date(began), 0.0, {}, tags)
    header, problems = parse_header(folder)
    plans, _ = parse_plans(folder, header.axes if header else "iso")
    begins = {plan.run: plan.start for plan in plans if plan.start is not None}
    began = min(filter(None, (started_at(folder / plan.file) for plan in plans)), default=None)
    name = header.name if header else folder.name
    tire = header.tire.name if header else ""
    tags = {"name": name, "tire": tire, "axes": "iso", "runs": str(len(plans))}
    if header is not None:
        tags |= {"rig": header.rig_name, "size": size_of(header.tire.free_radius)}
    faults = () if header is not None else tuple(errors_of(problems))
    return _About("campaign", name, tire, _date(began), 0.0, begins, tags, faults)


def size_of(free_radius: float) -> str:
    """Return the size class of a tire: its free radius to the millimetre."""
    return f"{1e3 * free_radius:.0f} mm"


def _date(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


@lru_cache(maxsize=64)
def _kept(address: str, path: str) -> Path:
    """Return a file of the data set as one of this machine; a worker copies it once."""
    data = DataSet(address)
    if data.local:
        return Path(data.path(path))
    folder = Path(tempfile.mkdtemp(prefix="tirelib-fleet-file-"))
    target = folder / path.rpartition("/")[2]
    target.write_bytes(data.read(path))
    return target


def _local(address: str, path: str, content: str, about: _About) -> Path:
    """Return the calibration or model of a container: one for all, or by content, or by tire."""
    if not path.endswith("index.json"):
        return _kept(address, path)
    index = json.loads(_kept(address, path).read_text())
    found = index["by_content"].get(content) or index["by_tire"].get(about.tire)
    if found is None:
        if about.faults:
            raise FormatError(about.faults)
        raise FormatError(
            Fault(
                f"tire {about.tire!r}",
                f"{index['data_set']} holds nothing of this campaign or tire",
                "a calibration or a model of it is needed",
                "run the task that makes it over the same paths first",
            )
        )
    return _kept(index["data_set"], found)
