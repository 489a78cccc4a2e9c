"""A recording as a link: the same bytes in the same order, as fast as they are asked for."""

import time
from pathlib import Path

from bench.deadline import Deadline
from bench.recording import Recording


class ReplayLink:
    """Bytes of a recording; see `bench.links.Link`.

    Raises
    ------
    RecordingError
        If the file is no recording.
    """

    live = False

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self.recording = Recording(path)
        self._reads = self.recording.raw()

    def receive(self, deadline: Deadline) -> tuple[int, bytes] | None:
        """Return the bytes of the next read; None after the last."""
        for _, data in self._reads:
            return time.monotonic_ns(), data
        return None

    def close(self) -> None:
        """Close the file."""
        self.recording.close()
