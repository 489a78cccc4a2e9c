"""Recordings that are turned on and off while the run goes on."""

from collections.abc import Callable
from pathlib import Path

from bench.links import Read
from bench.recording import Recorder


class RecordingSwitch:
    """Recordings one after another, in files that the run names; a context manager.

    It stands where a session wants a recorder: while nothing is being recorded it takes reads and
    drops them.

    Parameters
    ----------
    make : callable
        Starts a recording in this file.
    first : Path
        Of the first recording; those after it get a number, see `numbered`.
    started : bool
        Whether to begin at once.

    Attributes
    ----------
    files : list of Path
        Recordings so far.
    """

    def __init__(self, make: Callable[[Path], Recorder], first: Path, *, started: bool) -> None:
        self.files: list[Path] = []
        self._make = make
        self._first = first
        self._recorder: Recorder | None = None
        if started:
            self._begin(first)

    @property
    def recorder(self) -> Recorder | None:
        """What records now; None if nothing does."""
        return self._recorder

    def start(self) -> str:
        """Begin a recording, unless one is going on; return the name of its file.

        Raises
        ------
        RecordingError
            If it cannot be written.
        """
        if self._recorder is None:
            self._begin(numbered(self._first))
        return self.files[-1].name

    def stop(self) -> None:
        """End the recording that is going on, if there is one."""
        self.close("stopped by a viewer")

    def read(self, read: Read) -> None:
        """Record a read of the link, if a recording is going on."""
        if self._recorder is not None:
            self._recorder.read(read)

    def close(self, reason: str) -> None:
        """End the recording; `reason` is kept in it."""
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close(reason)

    def __enter__(self) -> "RecordingSwitch":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close("closed" if kind is None else kind.__name__)

    def _begin(self, file: Path) -> None:
        self._recorder = self._make(file)
        self.files.append(file)


def numbered(file: Path) -> Path:
    """Return the file, or the first of ``name-2``, ``name-3`` ... that is not there yet."""
    number, free = 1, file
    while free.exists():
        number += 1
        free = file.with_name(f"{file.stem}-{number}{file.suffix}")
    return free
