"""Files of a session: written as a whole or not at all, safe names, one server at a time."""

import json
import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

from tirelib.core.errors import FormatError

_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")


def write_atomic(path: Path, text: str | bytes) -> None:
    """Write a file so that a reader sees the old content or the new, never a part."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f".{path.name}.new")
    new.write_bytes(text.encode() if isinstance(text, str) else text)
    new.replace(path)


def read_document(path: Path) -> dict[str, Any] | None:
    """Return a JSON document; None where there is none, or not a whole one."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a small JSON document as a whole."""
    write_atomic(path, json.dumps(document, indent=1))


def move_into(target: Path, results: Path) -> None:
    """Move what a folder of results holds into its place, each as a whole."""
    target.mkdir(parents=True, exist_ok=True)
    for result in results.iterdir():
        place = target / result.name
        if place.is_dir():
            shutil.rmtree(place)
        result.replace(place)


def safe_name(name: str) -> str:
    """Return a name that can be a file's on any system; never a path, never hidden.

    Examples
    --------
    >>> safe_name("../../etc/pass wd")
    'etc-pass-wd'
    >>> safe_name("..")
    'file'
    """
    return _UNSAFE.sub("-", name.replace("..", "")).strip("-.")[:80] or "file"


def hold(folder: Path) -> IO[str]:
    """Keep a session for this server until the file that is returned is closed.

    Raises
    ------
    FormatError
        If another server has it.
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    stream = (folder / "held").open("a")
    try:
        if os.name == "posix":
            import fcntl

            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        stream.close()
        raise FormatError(
            f"{folder}: another `tirelib studio` shows this session; close it, or give another "
            "folder with --session"
        ) from None
    return stream
