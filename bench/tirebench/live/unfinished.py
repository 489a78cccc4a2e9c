"""Files of a recording that have no end yet, because nothing could be written any more."""

from contextlib import suppress
from pathlib import Path

from tirebench.errors import RecordingError
from tirebench.recording.recorder import finish


class Unfinished:
    """They are finished as soon as there is room for it; each is readable without its end."""

    def __init__(self) -> None:
        self._files: list[tuple[Path, int, str]] = []

    def add(self, path: Path, length: int, reason: str) -> None:
        """Add a file of which so many bytes are whole; `reason` says why it ends."""
        self._files.append((path, length, reason))

    def finish(self) -> None:
        """Try to write the ends."""
        for file in self._files[:]:
            with suppress(RecordingError):
                finish(*file)
                self._files.remove(file)
