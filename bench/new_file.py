"""Files that the bench writes never take the place of a recording."""

from pathlib import Path

from mcap.writer import MCAP0_MAGIC

from bench.errors import RecordingError, cause
from bench.recording_header import part_path


def keep_recordings(file: Path | None, *recordings: Path | None) -> None:
    """Refuse a file that is a recording, or will be one.

    Parameters
    ----------
    file : Path or None
        That is to be written; None if none is.
    *recordings : Path or None
        Of the same command; all parts of each count.

    Raises
    ------
    RecordingError
    """
    if file is None:
        return
    whole = [part_path(path.resolve(), 1) for path in recordings if path is not None]
    if part_path(file.resolve(), 1) in whole or _is_recording(file):
        raise RecordingError(
            f"{file}: it is a recording, or a part of one, and a recording is never overwritten; "
            "a file of its own is needed; name another one"
        )


def _is_recording(file: Path) -> bool:
    """Return whether a file begins as recordings do; what is no file (a pipe) does not."""
    if not file.is_file():
        return False
    try:
        with file.open("rb") as opened:
            return opened.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
    except OSError as error:
        raise RecordingError(
            f"{file}: it cannot be read ({cause(error)}), and may be a recording, which is never "
            "overwritten; name another file"
        ) from None
