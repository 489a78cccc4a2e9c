"""A recording as a link: the same bytes in the same order, as fast as asked for."""

import time
from pathlib import Path

from tirebench.deadline import Deadline
from tirebench.links import Read
from tirebench.recording.recording import Recording


class ReplayLink:
    """Bytes of a recording; see `tirebench.links.Link`.

    Parameters
    ----------
    path : Path
    pace : float, optional
        Replay speed as a multiple of real time; by default as fast as possible. The reported
        arrival is always the recorded one, so that the estimates do not depend on the pace.

    Raises
    ------
    RecordingError
        If the file is no recording.
    """

    live = False

    def __init__(self, path: Path, pace: float | None = None) -> None:
        self.name = str(path)
        self.recording = Recording(path)
        self.encoding = self.recording.header.encoding
        self._pace = pace
        self._reads = self.recording.reads()
        self._ahead: Read | None = None
        self._start: tuple[float, int] | None = None  # monotonic now, recorded then

    def receive(self, deadline: Deadline) -> Read | None:
        """Return the next read when its time has come; None after the last."""
        if self._ahead is None:
            self._ahead = next(self._reads, None)
            if self._ahead is None:
                return None
        read = self._ahead
        if self._pace is not None:
            if self._start is None:
                self._start = time.monotonic(), read.arrival
            due = self._start[0] + 1e-9 * (read.arrival - self._start[1]) / self._pace
            wait = due - time.monotonic()
            if wait > 0.0:
                time.sleep(min(wait, deadline.remaining))
            if time.monotonic() < due:
                return Read(read.arrival, b"")
        self._ahead = None
        return read

    def close(self) -> None:
        """Close the file."""
        self.recording.close()

    def overruns(self) -> int:
        """Return 0: those of the run are not repeated."""
        return 0

    def __enter__(self) -> "ReplayLink":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
