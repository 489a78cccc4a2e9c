"""The last seconds before a trigger, kept in memory until they are on disk."""

import pickle
from collections import deque
from itertools import islice
from typing import Any

from tirebench.estimator.wheels import Block
from tirebench.links import LOST
from tirebench.live.exchange import Exchange


class PreTrigger:
    """What has come in the last seconds; what is older is forgotten.

    After a trigger it is written piece by piece, and what comes meanwhile is taken in behind it:
    the queues of the recorder hold seconds, and minutes of four wheels take longer to write. It is
    kept as the bytes of the queues, which the search for garbage does not look at.

    Parameters
    ----------
    length : float, [s]
    """

    def __init__(self, length: float) -> None:
        self._length = round(1e9 * length)
        self._kept: deque[tuple[int, str, bytes]] = deque()  # arrival, what it is, message
        self._written = 0  # of those, the first ones: they may not be on disk yet

    def __len__(self) -> int:
        """Return how much is to be written."""
        return len(self._kept) - self._written

    def take(self, exchange: Exchange, *, forget: bool = True) -> tuple[bool, int]:
        """Take what waits for the recorder; return whether there was anything.

        Parameters
        ----------
        exchange : Exchange
        forget : bool
            Whether what is too old is forgotten: nothing is, once there was a trigger.

        Returns
        -------
        busy : bool
        lost : int, [ns]
            Monotonic, when a port went away; 0 if none did.
        """
        found: list[tuple[int, str, bytes]] = []
        lost = 0
        while (message := exchange.raw.read()) is not None:
            read = pickle.loads(message)
            found.append((read.arrival, "read", message))
            lost = read.arrival if read.event == LOST else lost
        while (message := exchange.strain.read()) is not None:
            found.append((Block.unpack(message).arrival, "block", message))
        while (message := exchange.results.read()) is not None:
            found.append((pickle.loads(message)[1], "estimate", message))
        for queue in (exchange.raw, exchange.strain, exchange.results):
            queue.take()  # who reads them again finds them here
        self._kept += found
        newest = max((arrival for arrival, _, _ in found), default=0)
        while forget and self._kept and self._kept[0][0] < newest - self._length:
            self._kept.popleft()
        return bool(found), lost

    def write(self, recorder: Any, most: int) -> None:
        """Write what is kept, until so many bytes wait for the disk.

        Raises
        ------
        RecordingError
        """
        for _, kind, message in islice(self._kept, self._written, None):
            if recorder.waiting > most:
                return
            self._written += 1
            if kind == "estimate":
                recorder.estimate(*pickle.loads(message))
            elif kind == "block":
                recorder.block(Block.unpack(message))
            else:
                recorder.read(pickle.loads(message))

    def forget_written(self) -> None:
        """Forget what was written: it is on disk."""
        for _ in range(self._written):
            self._kept.popleft()
        self._written = 0

    def write_again(self) -> None:
        """Note that what was written is not on disk."""
        self._written = 0
