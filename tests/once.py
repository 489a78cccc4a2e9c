"""What takes long to make is made by one process of a test run, and read by all of them."""

import atexit
import fcntl
import io
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from tirelib.core.forked import _Reader, _Writer

PLACE = "TIRELIB_TESTS_ONCE"
"""Environment variable with the folder that the processes of a run share."""
MADE: list[Path] = []
"""Folders that this process has filled."""
Value = TypeVar("Value")


def share_a_folder(at_the_end: Callable[[Callable[[], None]], object] = atexit.register) -> None:
    """Make the folder of a run; the processes that this one starts find it."""
    if PLACE not in os.environ:
        os.environ[PLACE] = tempfile.mkdtemp(prefix="tirelib_once_")
        at_the_end(lambda: shutil.rmtree(os.environ.pop(PLACE), ignore_errors=True))


def once(name: str, fill: Callable[[Path], object]) -> Path:
    """Return a folder that the first process to ask for it fills, while the others wait.

    A program of ``build`` that asks without a test run has a folder until it ends.
    """
    share_a_folder()
    folder = Path(os.environ[PLACE]) / name
    filled = folder.with_name(f"{name}.filled")
    with folder.with_name(f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not filled.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            fill(folder)
            filled.touch()
            MADE.append(folder)
    return folder


@contextmanager
def first_alone(name: str) -> Iterator[None]:
    """Let the first process that comes here go through alone, and all others together after it."""
    share_a_folder()
    with (Path(os.environ[PLACE]) / f"{name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            fcntl.flock(lock, fcntl.LOCK_SH)
        yield


def value_once(name: str, make: Callable[[], Value], shared: Sequence[object] = ()) -> Value:
    """Return what the first process to ask for it has made, read back from its file.

    What all processes have, as the effects of the catalogue, may be `shared`: it is not written.
    """

    def fill(folder: Path) -> None:
        text = io.BytesIO()
        _Writer(text, shared).dump(make())
        (folder / "value.pickle").write_bytes(text.getbuffer())

    text = io.BytesIO((once(name, fill) / "value.pickle").read_bytes())
    found: Value = _Reader(text, shared).load()
    return found
