"""The estimates of a run as a document that grows while the run goes on.

The file begins like the document of `tirebench.recording.document` and gets a line for each turn as
it comes, so that what was estimated can be read whatever happens next. In the end the whole
document takes its place in one step. A file without its end is completed by `completed`.
"""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tirebench.errors import RecordingError, cause
from tirebench.estimator.chain import Turn
from tirebench.recording.document import QUANTITIES, empty_summary, turn_document
from tirebench.recording.new_file import keep_recordings
from tirelib.core.documents import plain
from tirelib.core.version import __version__
from tirelib.estimators.edge import FORMAT

HEAD = f'{{"format": "{FORMAT}", "axes": "iso", "turns": [\n'
_BETWEEN = b",\n"


class Journal:
    """Write turns as they come, and the document in the end.

    What cannot be written waits and is tried again with the next turns. A path that is no file
    (a pipe, a device) gets the document alone.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    error : str
        Why turns wait at the moment; empty if none do.

    Raises
    ------
    RecordingError
        If the file cannot be written, or is a recording.
    """

    def __init__(self, path: Path) -> None:
        keep_recordings(path)
        self.error = ""
        self._name = path
        self._path = path.resolve()
        self._waiting: list[bytes] = []
        self._length = self._count = 0
        self._file = None
        if self._path.exists() and not self._path.is_file():
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("wb", buffering=0)
            self._write(HEAD.encode())
        except OSError as error:
            if self._file is not None:
                self._file.close()
            raise _unwritable(path, error) from None

    def add(self, turns: Sequence[Turn]) -> None:
        """Write turns; see `error` for whether they stand in the file."""
        if self._file is None or not (turns or self._waiting):
            return
        for turn in turns:
            line = json.dumps(plain(turn_document(turn)), allow_nan=False).encode()
            self._waiting.append((_BETWEEN if self._count else b"") + line)
            self._count += 1
        try:
            self._write(b"".join(self._waiting))
        except OSError as error:
            self.error = (
                f"{self._name}: turns cannot be written ({cause(error)}); they are kept "
                "in memory until they can"
            )
            return
        self._waiting.clear()
        self.error = ""

    def finish(self, document: dict[str, Any]) -> None:
        """Put the whole document in the place of what was written.

        Raises
        ------
        RecordingError
            If it cannot be written; what stands in the file stays.
        """
        text = (json.dumps(plain(document), indent=1, allow_nan=False) + "\n").encode()
        if self._file is None:
            target = self._path
        else:
            self._file.close()
            target = self._path.with_name(f".{self._path.name}.{os.getpid()}")
        try:
            target.write_bytes(text)
            if target != self._path:
                target.replace(self._path)
        except OSError as error:
            if target != self._path:
                target.unlink(missing_ok=True)
            raise RecordingError(
                f"{self._name}: the document cannot be written ({cause(error)}); the turns already "
                "in the file are kept; free some space and complete it with `tirebench repair`"
            ) from None

    def close(self) -> None:
        """Leave the file as it is."""
        if self._file is not None:
            self._file.close()

    def _write(self, data: bytes) -> None:
        """Write all of it, or nothing."""
        if self._file is None:
            return
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) or 0 :]
        except OSError:
            self._file.truncate(self._length)
            self._file.seek(self._length)
            raise
        self._length += len(data)


def completed(text: str) -> dict[str, Any] | None:
    """Return the document of a file that breaks off; None if it is not of a `Journal`.

    A last line that is not whole is left out.
    """
    if not text.startswith(HEAD):
        return None
    turns = []
    for line in text.removeprefix(HEAD).split(",\n"):
        try:
            turns.append(json.loads(line))
        except ValueError:
            break
    return {
        "format": FORMAT,
        "tirelib": __version__,
        "axes": "iso",
        "summary": {name: empty_summary(name) for name in QUANTITIES},
        "turns": turns,
        "source": {"ended": "broke off"},
    }


def whole_document(text: str) -> dict[str, Any] | None:
    """Return the document of a file that is complete; None if it is no document of turns."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    known = isinstance(found, dict) and found.get("format") == FORMAT
    return found if known and isinstance(found.get("turns"), list) else None


def _unwritable(path: Path, error: OSError) -> RecordingError:
    return RecordingError(
        f"{path}: cannot be written ({cause(error)}); a file in a folder with free space is "
        "needed; name another file"
    )
