"""Files that the bench writes: whole or not at all, and never in the place of a recording."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mcap.writer import MCAP0_MAGIC

from tirebench.errors import RecordingError, cause
from tirebench.recording.header import part_path


def keep_recordings(file: Path | None, *recordings: Path | None) -> None:
    """Refuse a file that is a recording, or will be one.

    Parameters
    ----------
    file : Path or None
        That is to be written; None if none is.
    *recordings : Path or None
        Recordings that the same command writes, with all their parts.

    Raises
    ------
    RecordingError
    """
    if file is None:
        return
    whole = [part_path(path.resolve(), 1) for path in recordings if path is not None]
    if part_path(file.resolve(), 1) in whole or _is_recording(file):
        raise RecordingError(
            f"{file}: a recording, or a part of one, is never overwritten; another file is needed; "
            "name one"
        )


@contextmanager
def whole(out: Path) -> Iterator[Path]:
    """Give the path beside ``out`` to write a new file or folder to; it gets its name in the end.

    What was written is removed again where anything fails. Nothing written gives no file.

    Raises
    ------
    RecordingError
        If it cannot be written, as on a full disk.
    """
    new = out.with_name(f".{out.stem}.{os.getpid()}{out.suffix}")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        yield new
        if new.exists():
            new.replace(out)
    except OSError as error:
        raise RecordingError(
            f"{out}: cannot be written ({cause(error)}), and no partial file is left; free some "
            "space, or choose another disk"
        ) from None
    finally:
        if new.is_dir():
            shutil.rmtree(new, ignore_errors=True)
        else:
            new.unlink(missing_ok=True)


def _is_recording(file: Path) -> bool:
    """Return whether a file begins as recordings do; what is no file (a pipe) does not."""
    if not file.is_file():
        return False
    try:
        with file.open("rb") as opened:
            return opened.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
    except OSError as error:
        raise RecordingError(
            f"{file}: cannot be read ({cause(error)}), and could be a recording, which is never "
            "overwritten; name another file"
        ) from None
