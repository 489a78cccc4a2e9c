"""A recording through the same decoder and estimators as a live run, in one process."""

import time
from typing import Any

from tirebench.deadline import Deadline
from tirebench.estimator.checked_turns import CheckedTurns
from tirebench.estimator.estimation import Estimation, News, skipped
from tirebench.estimator.wheels import Wheels
from tirebench.links import BACK, DECODED, PASSED, RESUMED, Link


class ReplayChain:
    """Reads of a link to news, one after the other; see `tirebench.estimator.session.Source`.

    Parameters
    ----------
    link : Link
    wheels : Wheels
        Fresh.
    estimation : Estimation
    """

    lost: float | None = None
    message = ""

    def __init__(self, link: Link, wheels: Wheels, estimation: Estimation) -> None:
        self.name, self.live = link.name, link.live
        self.ended = ""
        self.wheels = wheels
        self.heard: float | None = None
        self.last_byte: float | None = None
        self._link = link
        self._passing = False
        self._estimation = estimation
        self._judged = CheckedTurns()

    def poll(self, deadline: Deadline) -> News:
        """Return what the next read brings."""
        read = self._link.receive(deadline)
        if read is None:
            self.ended = "end"
            return News()
        if read.event in (BACK, RESUMED):
            self.wheels.interrupt(read.source)
        if read.event in (PASSED, DECODED):
            self._passing = read.event == PASSED
            self.wheels.forget()
        if not read.data or self._passing:
            return News()
        self.heard, self.last_byte = time.time(), time.monotonic()
        known = self.wheels.contradicted
        blocks = self.wheels.push(read.data, read.arrival, read.source)
        news = self._estimation.take(self.wheels.agreeing(blocks))
        news.turns = self._judged.take(news.turns, self.wheels)
        news.alarms += [text for n, text in self.wheels.contradicted.items() if n not in known]
        return news

    def finish(self, reason: str) -> News:
        """Step what is left."""
        news = self._estimation.finish()
        news.turns = self._judged.take(news.turns, self.wheels, end=True)
        return news

    def counts(self) -> dict[str, Any]:
        """Return nothing: there are no other processes."""
        return {}

    def cpu_time(self) -> float:
        """Return 0: there are no other processes."""
        return 0.0

    def wheel_counts(self, wheel: int) -> dict[str, int]:
        """Return what the run skipped of a wheel; a replay skips no more."""
        return {**skipped(self._estimation.jumps, wheel), "queue_overruns": 0}
