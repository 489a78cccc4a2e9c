"""Shared memory and temporary folders that bear their owner's name, so that none outlives it.

A process that is ended by ``kill -9`` leaves them behind; the next run removes what belongs to
nobody any more. A name holds the owner's process number, when it started, and the namespace that
the number is of: what a process of another namespace (a container) owns is left alone. Systems
without ``/proc`` have plain names, and nothing is removed.
"""

import os
import re
import secrets
import shutil
import tempfile
from contextlib import suppress
from multiprocessing import current_process
from pathlib import Path
from typing import Any

SHARED = Path("/dev/shm")  # Linux; other systems have no such folder
_NAME = re.compile(r"(?:sem\.)?tirebench-(\d+)-(\d+)-(\d+)-")


def prefix() -> str:
    """Return how names of this process begin."""
    try:
        namespace = Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        return "tirebench-"
    return f"tirebench-{namespace}-{os.getpid()}-{_started(os.getpid())}-"


def shared_name() -> str | None:
    """Return a name for new shared memory; None where the system is to choose it."""
    return f"{prefix()}{secrets.token_hex(4)}" if SHARED.is_dir() else None


def name_semaphores() -> None:
    """Let semaphores that this process makes from now on bear its name too."""
    process: Any = current_process()  # multiprocessing has no public way to name them
    if SHARED.is_dir():
        process._config["semprefix"] = f"/{prefix().rstrip('-')}"


def sweep() -> list[Path]:
    """Remove what belonged to processes that are gone; return what that was."""
    mine = _NAME.match(prefix())
    if mine is None:
        return []
    removed = []
    for place in (SHARED, Path(tempfile.gettempdir())):
        entries = list(place.iterdir()) if place.is_dir() else []
        for entry in entries:
            owner = _NAME.match(entry.name)
            if owner is None or owner[1] != mine[1] or _started(int(owner[2])) == owner[3]:
                continue
            with suppress(OSError):  # another user's, or swept by another run just now
                shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
                removed.append(entry)
    return removed


def _started(number: int) -> str:
    """Return when a process started, in ticks since the system did; empty if there is none."""
    try:
        text = Path(f"/proc/{number}/stat").read_text()
    except OSError:
        return ""
    state, *fields = text.rpartition(")")[2].split()
    return "" if state in "ZX" else fields[18]
