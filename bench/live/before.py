"""The last seconds before a trigger, kept in memory."""

import pickle
from collections import deque
from typing import Any

from bench.links import LOST
from bench.live.exchange import Exchange


class Before:
    """What has come in the last seconds; what is older is forgotten.

    Parameters
    ----------
    length : float, [s]
    """

    def __init__(self, length: float) -> None:
        self._length = round(1e9 * length)
        self._kept: deque[tuple[int, str, Any]] = deque()

    def take(self, exchange: Exchange) -> tuple[bool, int]:
        """Take what waits for the recorder; tell whether there was anything.

        Returns
        -------
        busy : bool
        lost : int, [ns]
            Monotonic, when a port went away; 0 if none did.
        """
        found: list[tuple[int, str, Any]] = []
        lost = 0
        while (message := exchange.raw.read()) is not None:
            read = pickle.loads(message)
            found.append((read.arrival, "read", read))
            lost = read.arrival if read.event == LOST else lost
        while (message := exchange.strain.read()) is not None:
            block = pickle.loads(message)
            found.append((block.arrival, "block", block))
        while (message := exchange.results.read()) is not None:
            turn = pickle.loads(message)
            found.append((turn[1], "estimate", turn))
        for queue in (exchange.raw, exchange.strain, exchange.results):
            queue.take()  # who reads them again finds them here
        self._kept += found
        newest = max((arrival for arrival, _, _ in found), default=0)
        while self._kept and self._kept[0][0] < newest - self._length:
            self._kept.popleft()
        return bool(found), lost

    def write(self, recorder: Any) -> None:
        """Write what is kept, see `bench.recorder.Recorder`."""
        for _, kind, content in self._kept:
            if kind == "estimate":
                recorder.estimate(*content)
            else:
                getattr(recorder, kind)(content)

    def clear(self) -> None:
        """Forget all of it: it is on disk."""
        self._kept.clear()
