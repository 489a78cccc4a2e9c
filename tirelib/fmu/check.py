"""Check an FMU: validate it, play its reference signals, and compare the outputs with them.

The FMU runs in a process of its own (`tirelib.fmu.trial`), so that a broken one is a result and not
the end. Nothing is unpacked before the archive has been looked at.
"""

import hashlib
import importlib.util
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.errors import FormatError
from tirelib.core.version import __version__
from tirelib.fmu.reference import FOLDER, TOLERANCE

FORMAT = "tirelib-fmu-check/1"
LARGEST_UNPACKED = 2_000_000_000
"""Bytes that an FMU may unpack to."""
MOST_FILES = 20_000
TIME_LIMIT = 600.0
"""Seconds for one FMU."""
OWN = {f"resources/{n}" for n in ("slavemodule.txt", "StrainTire.core", "VirtualTire.core")}
"""What FMUs of this library hold beside ``resources/settings.json``: one of these."""
_PARTS = ("archive", "validation", "run", "reference")


def check_fmu(
    file: str | Path,
    *,
    reference: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Check an FMU and return the document of ``tirelib fmu check --json``.

    Parameters
    ----------
    file : path
        An FMU of this library, or any FMI 1.0 to 3.0 FMU. **Its code is run.**
    reference : path, optional
        Folder with ``X_in.csv``, ``X_ref.csv`` and ``X_ref.opt`` for an FMU that holds none.
    progress : callable, optional
        Called with the name of each part that is done.

    Returns
    -------
    dict
        ``passed``; ``parts``, each with ``name``, ``passed`` and ``detail``; ``compared``, whether
        there were reference signals; ``variables``: largest difference of each.

    Raises
    ------
    FormatError
        If the file is no FMU at all, or the reference folder holds no signals.
    """
    path = Path(file)
    names = _archive(path)
    if importlib.util.find_spec("fmpy") is None:
        raise FormatError(
            "fmu check: the package fmpy, which runs the FMU, is not installed; install it with "
            "pip install 'tirelib[fmu]'"
        )
    own = "resources/settings.json" in names and bool(OWN & set(names))
    document: dict[str, Any] = {
        "format": FORMAT,
        "file": path.name,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "size": path.stat().st_size,
        "made_by_tirelib": own,
        "environment": _environment(),
        "facts": {},
        "parts": [],
        "compared": False,
        "tolerance": None,
        "variables": [],
        "messages": [],
    }
    tell = progress or (lambda _: None)
    fault = _damage(path)
    _add(document, "archive", not fault, fault or f"{len(names)} files, undamaged")
    tell("archive")
    if not fault:
        with tempfile.TemporaryDirectory(prefix="tirelib_check_") as name:
            folder = Path(name)
            if reference is not None:
                _take_reference(Path(reference), folder / FOLDER)
            _try(path, folder, document)
            tell("run")
            _compare(path, folder, document, names)
            tell("reference")
    document["passed"] = all(part["passed"] for part in document["parts"])
    return document


def _add(document: dict[str, Any], name: str, passed: bool, detail: str) -> None:
    document["parts"].append({"name": name, "passed": passed, "detail": detail})


def _environment() -> dict[str, str]:
    found = {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "tirelib": __version__,
    }
    for package in ("numpy", "scipy", "fmpy", "pythonfmu"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def _archive(path: Path) -> list[str]:
    """Return the names inside; refuse a file that is not an FMU."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except OSError as error:
        raise FormatError(
            f"{path}: cannot be read ({error.strerror}); an FMU is needed; check the path"
        ) from None
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        with path.open("rb") as file:
            if file.read(4) == b"PK\x03\x04":
                raise FormatError(
                    f"{path}: is truncated or damaged (it begins as a zip archive, but: {error}); "
                    "a complete FMU is needed; copy it again, or build it again"
                ) from None
        raise FormatError(
            f"{path}: is not an FMU ({error}); an FMU is a zip archive; build one with `tirelib "
            "fmu build`"
        ) from None
    if "modelDescription.xml" not in names:
        raise FormatError(
            f"{path}: is not an FMU (a zip archive without modelDescription.xml); build one with "
            "`tirelib fmu build`"
        )
    return names


def _damage(path: Path) -> str:
    """Return why an archive must not be unpacked; empty if it may."""
    with zipfile.ZipFile(path) as archive:
        entries = archive.infolist()
        size = sum(entry.file_size for entry in entries)
        if len(entries) > MOST_FILES or size > LARGEST_UNPACKED:
            return (
                f"it would unpack to {len(entries)} files and {size / 1e6:.0f} MB; allowed are "
                f"{MOST_FILES} and {LARGEST_UNPACKED / 1e6:.0f} MB"
            )
        for entry in entries:
            parts = entry.filename.replace("\\", "/").split("/")
            if ".." in parts or parts[0] == "" or ":" in parts[0] or "\\" in entry.filename:
                return f"{entry.filename!r} would be written outside the folder of the FMU"
        if len({entry.filename for entry in entries}) != len(entries):
            return "a name occurs twice in the archive"
        try:
            broken = archive.testzip()
        except (
            zipfile.BadZipFile,
            NotImplementedError,
            RuntimeError,
            OSError,
            EOFError,
            ValueError,
        ) as error:
            return f"a file in the archive cannot be read: {error}"
        except Exception as error:  # zlib.error and what other compressions raise
            return f"a file in the archive is damaged: {error}"
    return f"{broken} in the archive is damaged (checksum)" if broken else ""


def _take_reference(source: Path, target: Path) -> None:
    if not source.is_dir() or not list(source.glob("*_ref.opt")):
        raise FormatError(
            f"{source}: holds no reference signals (X_in.csv, X_ref.csv, X_ref.opt); give a folder "
            "in the FMI cross-check layout"
        )
    shutil.copytree(source, target)


def _try(path: Path, folder: Path, document: dict[str, Any]) -> None:
    """Run the trial in its own process, and return its findings."""
    command = [sys.executable, "-m", "tirelib.fmu.trial", str(path.resolve()), str(folder)]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(
            [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
        ).rstrip(os.pathsep),
    }
    end = ""
    try:
        process = subprocess.run(
            command,
            capture_output=True,
            timeout=TIME_LIMIT,
            check=False,
            cwd=folder,
            env=environment,
        )
        if process.returncode < 0:
            end = f"its process died of signal {-process.returncode}"
        elif process.returncode:
            last = process.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
            end = f"its process ended with code {process.returncode}: {' '.join(last)}"
    except subprocess.TimeoutExpired:
        end = f"the run did not end within {TIME_LIMIT:g} s"
    found: dict[str, Any] = {}
    if (folder / "trial.json").is_file():
        found = json.loads((folder / "trial.json").read_text())
    document["facts"] = {**found.get("facts", {}), "platforms": found.get("platforms", [])}
    document["units"] = found.get("units", {})
    document["messages"] = found.get("messages", [])
    document["parts"] += found.get("parts", [])
    if end:
        done = {part["name"] for part in document["parts"]}
        name = next((name for name in _PARTS if name not in done), "end")
        _add(document, name, False, end)


def _compare(path: Path, folder: Path, document: dict[str, Any], names: list[str]) -> None:
    """Compare the reference run with the expected outputs."""
    model = document["facts"].get("modelName")
    passed = {part["name"]: part["passed"] for part in document["parts"]}
    place = f"resources/{FOLDER}/{model}_ref"
    if (folder / FOLDER).is_dir():
        place = ""
        expected = folder / FOLDER / f"{model}_ref.csv"
        text = expected.read_text() if expected.is_file() else None
    else:
        text = None
        if f"{place}.csv" in names:
            with zipfile.ZipFile(path) as archive:
                text = archive.read(f"{place}.csv").decode("utf-8", "replace")
    if text is None:
        if document["made_by_tirelib"] and model is not None and not _sealed(path):
            _add(
                document,
                "reference",
                False,
                "the reference signals that `tirelib fmu build` embeds are missing; build the FMU "
                "again",
            )
        return
    if not passed.get("run") or not (folder / "result.csv").is_file():
        _add(document, "reference", False, "not compared, because the run failed")
        return
    try:
        head, wanted = _table(text)
        shown, given = _table((folder / "result.csv").read_text())
        document["tolerance"] = _tolerance(path, folder, f"{place}.opt", model)
        document["variables"] = _differences(head, wanted, shown, given, document)
    except (ValueError, KeyError, IndexError) as error:
        _add(document, "reference", False, f"the reference signals cannot be read: {error}")
        return
    document["compared"] = True
    document["curves"] = _curves(head, wanted, shown, given)
    bad = [row["name"] for row in document["variables"] if not row["passed"]]
    rows = document["variables"]
    _add(
        document,
        "reference",
        not bad,
        f"{', '.join(bad[:8])} differ from the reference signals"
        if bad
        else f"{len(rows)} outputs at {len(wanted)} points agree with the reference signals",
    )


def _sealed(path: Path) -> bool:
    """Tell whether an FMU of this library was built to hold no reference signals."""
    with zipfile.ZipFile(path) as archive:
        settings = json.loads(archive.read("resources/settings.json"))
    return isinstance(settings, dict) and settings.get("sealed") is True


def _table(text: str) -> tuple[list[str], Any]:
    """Return names and numbers; of a cell with several each has a column: ``name[1]`` .."""
    lines = text.splitlines()
    cells = [[cell.split() for cell in line.split(",")] for line in lines[1:] if line]
    head: list[str] = []
    for name, first in zip(lines[0].split(","), cells[0] if cells else (), strict=False):
        plain, n = name.strip().strip('"'), len(first)
        head += [plain] if n == 1 else [f"{plain}[{i}]" for i in range(1, n + 1)]
    rows = np.array([[float(number) for cell in row for number in cell] for row in cells])
    return head, rows.reshape(-1, len(head))


def _tolerance(path: Path, folder: Path, name: str, model: Any) -> float:
    from tirelib.fmu.trial import read_options

    file = folder / FOLDER / f"{model}_ref.opt"
    if not file.is_file():
        with zipfile.ZipFile(path) as archive:
            file = folder / "ref.opt"
            file.write_bytes(archive.read(name))
    return float(read_options(file).get("RelTol", TOLERANCE))


def _differences(
    head: list[str], wanted: Any, shown: list[str], given: Any, document: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Return a row for each expected output; a NaN must meet a NaN."""
    if given.shape[0] != wanted.shape[0]:
        raise ValueError(
            f"the reference has {wanted.shape[0]} points, but the run reached {given.shape[0]}"
        )
    rows = []
    for column, name in enumerate(head[1:], start=1):
        a, b = wanted[:, column], given[:, shown.index(name)]
        apart = np.where(np.isnan(a) & np.isnan(b), 0.0, np.abs(a - b))
        apart = np.where(np.isnan(apart), math.inf, apart)
        size = float(np.nanmax(np.abs(a), initial=0.0))
        worst = int(apart.argmax())
        limit = document["tolerance"] * size
        rows.append(
            {
                "name": name,
                "unit": document["units"].get(name.partition("[")[0], ""),
                "largest_difference": None if math.isinf(apart[worst]) else float(apart[worst]),
                "allowed": limit,
                "magnitude": size,
                "time": float(wanted[worst, 0]),
                "passed": bool(apart[worst] <= limit),
            }
        )
    return rows


def _curves(head: list[str], wanted: Any, shown: list[str], given: Any) -> dict[str, Any]:
    """Return the course of a few outputs, for the page."""
    chosen = [name for name in head[1:] if not name.endswith(("valid", "_std"))][:4]
    return {
        "time": wanted[:, 0].tolist(),
        "expected": {name: wanted[:, head.index(name)].tolist() for name in chosen},
        "seen": {name: given[:, shown.index(name)].tolist() for name in chosen},
    }
