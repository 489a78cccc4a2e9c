"""Which FMU files may be run: an FMU is native code, so an unknown one is refused.

An FMU is known if this installation would build it to the last byte from the calibration inside
(then it holds our own code and nothing else), or if its hash is in the user's list, where
``--trust`` puts it.
"""

import io
import json
import os
import tempfile
import zipfile
from inspect import signature
from pathlib import Path
from typing import Any

from tirebench.errors import FmuError
from tirebench.estimator.fmu_archive import FmuArchive, read_fmu
from tirebench.owned import prefix
from tirelib.core.errors import TirelibError

FOLDER = "tirebench"
LIST = "trusted_fmus"
_PARTS = ("resources/calibration.toml", "resources/settings.json")
_LARGEST_PART = 2**25
"""Bytes of a file that is read; a calibration of some hundred runs has two million."""


def trust_list() -> Path:
    """Return the file of trusted hashes, one a line; it need not exist."""
    base = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(base) / FOLDER / LIST


def how_known(archive: FmuArchive) -> str | None:
    """Say why an FMU may be run, or None."""
    if archive.sha256 in _listed():
        return "in the list of trusted FMUs"
    if _rebuilt(archive) == archive.content:
        return "identical to what this version of tirelib builds"
    return None


def check_trust(archive: FmuArchive, *, trust: bool) -> str:
    """Return why an FMU may be run.

    Parameters
    ----------
    trust : bool
        The user says so: its hash is remembered.

    Raises
    ------
    FmuError
        If it is unknown and `trust` is off.
    """
    known = how_known(archive)
    if known is not None:
        return known
    if not trust:
        raise FmuError(
            f"{archive.path}: sha256 {archive.sha256} is unknown, and an FMU is native code that "
            "runs with your rights; FMUs that this version of tirelib builds and those trusted "
            "before are allowed; build it with `tirelib fmu build`, or add --trust once if you "
            "trust its source"
        )
    remember(archive)
    return "added to the list of trusted FMUs by --trust"


def remember(archive: FmuArchive) -> None:
    """Put a hash into the list.

    Raises
    ------
    FmuError
        If the list cannot be written.
    """
    path = trust_list()
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{archive.sha256}  {archive.path.name}\n")
    except OSError as error:
        raise FmuError(
            f"{path}: the list of trusted FMUs cannot be written ({error.strerror}); a folder that "
            "you may write to is needed; set XDG_CONFIG_HOME"
        ) from None


def _listed() -> set[str]:
    try:
        lines = trust_list().read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return set()
    return {line.split()[0] for line in lines if line.strip()}


def _rebuilt(archive: FmuArchive) -> bytes | None:
    """Return the FMU that this installation builds from the calibration inside; None if it cannot.

    Nothing of the archive is run: two data files are read, and our own builder does the rest.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(archive.content)) as file:
            for name in _PARTS:
                if file.getinfo(name).file_size > _LARGEST_PART:
                    return None
            calibration, settings = (file.read(name) for name in _PARTS)
        said = dict(json.loads(settings))
        missing = float(said.get("missing", "nan"))
    except Exception:  # whatever a foreign archive provokes: then it is not one of ours
        return None
    from tirelib.fmu.build import build_fmu

    known = {p.name for p in signature(build_fmu).parameters.values() if p.default is not p.empty}
    options: dict[str, Any] = {
        name: value
        for name, value in said.items()
        if name in known - {"missing"} and isinstance(value, bool | int | float)
    }
    with tempfile.TemporaryDirectory(prefix=prefix()) as name:
        folder = Path(name)
        (folder / "calibration.toml").write_bytes(calibration)
        try:
            built = build_fmu(
                folder / "calibration.toml", folder / "x.fmu", missing=missing, **options
            )
            return read_fmu(built).content
        except (TirelibError, FmuError, OSError, TypeError, ValueError):
            return None
