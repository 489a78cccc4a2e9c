"""The recipe of a fleet's task, with its files in the data set, where every worker reads them."""

import json
import tempfile
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow.dataset as pads

from tirelib.core.errors import FormatError, ParameterError, TirelibError
from tirelib.fleet.dataset import DataSet
from tirelib.fleet.tables import PARTITION
from tirelib.fleet.work import NEEDS, TASKS, WRITES, Recipe

if TYPE_CHECKING:
    pass


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
