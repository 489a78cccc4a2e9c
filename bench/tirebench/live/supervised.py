"""A process that is started again when it dies or hangs, and how often that was.

Python takes some tenths of a second of CPU to start, seconds on a busy machine. Where that costs
data, a second process stands by with everything loaded and takes over. The first that stands by is
begun before the process itself, so that it is ready as soon as there is something to lose.
"""

import gc
import os
import signal
import time
from collections.abc import Callable
from multiprocessing import get_context, parent_process
from multiprocessing.context import SpawnContext
from typing import Any

from tirebench.live.priority import as_parent

FIRST_PAUSE, LONGEST_PAUSE = 0.05, 10.0
"""Before a new start: it doubles while starts fail, [s]."""
LIVED = 5.0
"""A process that lived longer starts over with the first pause, [s]."""
STAND_BY = 0.5
"""A process that took over and has lived so long gets one that stands by, [s]."""
GLANCE = 0.5
"""Time between two looks of one that stands by whether the run goes on, [s]."""
RUN_ONLY = [getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)]
"""What a terminal sends to all of its processes, and only the run obeys."""
CONTEXT: SpawnContext = get_context("spawn")


class Supervised:
    """A process beside the run. `look` is called often and never waits.

    Parameters
    ----------
    target : callable
        Runs in the process.
    arguments : callable
        Called before each start, with the number of starts (from 1); gives what the target gets.
    hangs : callable, optional
        Tells whether a process that lives has to be ended: it does nothing any more.
    stand_by : callable, optional
        Another process stands by, and runs this with the same arguments: it loads whatever the
        target will need.

    Attributes
    ----------
    starts : int
    """

    def __init__(
        self,
        target: Callable[..., None],
        arguments: Callable[[int], tuple[Any, ...]],
        hangs: Callable[[], bool] | None = None,
        *,
        stand_by: Callable[..., None] | None = None,
    ) -> None:
        self.starts = 0
        self._stand_by = stand_by
        self._spare: Any = None
        self._call: Any = None
        self._called: Any = None
        self._target = target
        self._arguments = arguments
        self._hangs = hangs
        self._process: Any = None
        self._started = self._due = self._spare_begun = 0.0
        self._pause = FIRST_PAUSE
        self._begin_spare()
        self.start()

    @property
    def process_id(self) -> int | None:
        """Id of the process, while there is one."""
        return None if self._process is None else self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.is_alive()

    def start(self) -> None:
        """Start the process; the next time, call the one that stands by."""
        if self.starts and self._spare_alive:
            self._process, self._spare = self._spare, None
            self._called = self._call  # kept: it may not have been taken up yet
            self._called.release()
        else:
            self._process = _begun(self._target, self._arguments(self.starts + 1))
        self._started = time.monotonic()
        self.starts += 1

    def look(self) -> None:
        """Start the process again if it has ended, after a pause."""
        now = time.monotonic()
        if self._process is not None:
            if self._process.is_alive():
                if self._hangs is not None and self._hangs():
                    self._process.kill()
                elif not self._spare_alive and now > self._spare_due:
                    self._begin_spare()
                return
            self._pause = FIRST_PAUSE if now - self._started > LIVED else self._pause
            self._due = now + (0.0 if self._spare_alive else self._pause)
            self._pause = min(2.0 * self._pause, LONGEST_PAUSE)
            self._process.join()
            self._process.close()
            self._process = None
        if now >= self._due:
            self.start()

    def wait(self, patience: float) -> None:
        """Wait for a process that was asked to end; kill it when it does not end in time [s]."""
        process, self._process = self._process, None
        spare, self._spare = self._spare, None
        if spare is not None:
            spare.kill()
            spare.join()
            spare.close()
        if process is None:
            return
        process.join(patience)
        for end in (process.terminate, process.kill):
            if process.is_alive():
                end()
                process.join(2.0)
        process.close()

    @property
    def _spare_alive(self) -> bool:
        return self._spare is not None and self._spare.is_alive()

    @property
    def _spare_due(self) -> float:
        """When the next one that stands by is begun: one that has died is not missed at once."""
        return self._started + STAND_BY if self._spare is None else self._spare_begun + LIVED

    def _begin_spare(self) -> None:
        """Let another process stand by, if one is wanted."""
        if self._spare is not None:
            self._spare.close()
        if self._stand_by is not None:
            self._spare_begun = time.monotonic()
            self._call = CONTEXT.Semaphore(0)
            given = self._arguments(max(self.starts, 1) + 1)
            self._spare = _begun(_on_call, (self._call, self._stand_by, self._target, *given))


def _begun(target: Callable[..., None], arguments: tuple[Any, ...]) -> Any:
    """Return a new process that ignores Ctrl-C and a closed terminal from its first moment."""
    process = CONTEXT.Process(target=target, args=arguments, daemon=True)
    before = {number: signal.signal(number, signal.SIG_IGN) for number in RUN_ONLY}
    try:
        process.start()  # which inherits what is ignored
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return process


def _on_call(
    call: Any, load: Callable[..., None], target: Callable[..., None], *arguments: Any
) -> None:
    """Load what the target needs, and stand by until called or until the run is gone."""
    load(*arguments)
    while not call.acquire(timeout=GLANCE):
        if orphaned():
            return
    target(*arguments)


def settled() -> None:
    """Prepare a process of the run that has loaded what it needs.

    Ctrl-C is the run's, what is there is no garbage, and from now on it goes first if the run does.
    """
    for number in RUN_ONLY:
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    gc.collect()
    gc.freeze()
    as_parent()


def orphaned() -> bool:
    """Whether the run that started this process is gone."""
    parent = parent_process()
    if parent is None:
        return False
    if os.name == "posix":
        return os.getppid() != parent.pid  # costs a hundredth of what `is_alive` does
    return not parent.is_alive()
