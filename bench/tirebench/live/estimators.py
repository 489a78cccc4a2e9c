"""The estimators of a run, a process for each wheel, and what they report."""

import pickle
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

from tirebench.errors import FmuError
from tirebench.estimator.chain import Jump
from tirebench.estimator.estimation import News
from tirebench.estimator.fmu_model import FmuFile
from tirebench.live.estimator import EstimatorPlan, Report, estimate
from tirebench.live.exchange import Exchange
from tirebench.live.supervised import Supervised
from tirebench.wire.conditions import Conditions

MOST_CRASHES_WHEN_LOADED = 3
"""Number of crashes while the FMU is loaded after which it is given up."""


class Estimators:
    """The processes; each has a slot of the exchange, in the order in which wheels are heard.

    Parameters
    ----------
    file : FmuFile or None
        None: nothing is estimated, and nothing is ever started.
    conditions : Conditions
    laps, every : bool
        See `tirebench.live.estimator.EstimatorPlan`.
    exchange : Exchange
    jumped : callable
        Takes a jump as soon as it is reported.

    Attributes
    ----------
    kept : dict of slot to Supervised
    ready, done : set of int
        Slots whose FMU is loaded; slots that have ended and reported everything.
    cpu : dict of slot to float, [s]
        Time that they have used.
    """

    def __init__(
        self,
        file: FmuFile | None,
        conditions: Conditions,
        exchange: Exchange,
        jumped: Callable[[Jump], None],
        *,
        laps: bool,
        every: bool,
    ) -> None:
        self.kept: dict[int, Supervised] = {}
        self.ready: set[int] = set()
        self.done: set[int] = set()
        self.cpu: dict[int, float] = {}
        self._file, self._conditions = file, conditions
        self._exchange = exchange
        self._jumped = jumped
        self._laps, self._every = laps, every
        self._pending = News()
        self._turns: Counter[int] = Counter()  # of each slot
        self._cursors: Counter[int] = Counter()

    def start(self, slots: int) -> None:
        """Start those of the first slots that were not started yet."""
        file = self._file
        if file is None:
            return
        for slot in range(len(self.kept), slots):
            self.kept[slot] = Supervised(estimate, partial(self._given, file, slot))

    def look(self) -> None:
        """Start again what has ended too early."""
        for slot in self.kept.keys() - self.done:
            self.kept[slot].look()

    def gather(self) -> News:
        """Return their reports since the last call.

        Raises
        ------
        FmuError
            If the FMU says that it cannot be loaded.
        """
        news, self._pending = self._pending, News()
        for slot in self.kept:
            self._drain(slot, news)
        return news

    def check(self) -> None:
        """Refuse an FMU that ends each process which loads it.

        Raises
        ------
        FmuError
        """
        if any(kept.starts > MOST_CRASHES_WHEN_LOADED for kept in self.kept.values()):
            raise FmuError(
                f"{self._path}: the process that loads it died {MOST_CRASHES_WHEN_LOADED} times, "
                "so its native code probably crashes; an FMU that loads is needed; build it again "
                "with `tirelib fmu build`"
            )

    def awaited(self) -> str:
        """Say which of them are not ready."""
        slots = [f"estimator {slot}" for slot in self.kept if slot not in self.ready]
        return f"{', '.join(slots)} to load {self._path}"

    @property
    def _path(self) -> str:
        return "" if self._file is None else str(self._file.path)

    def _given(self, file: FmuFile, slot: int, starts: int) -> tuple[Any, ...]:
        """Return what a process is given at its start: it goes on behind what was reported."""
        self._drain(slot, self._pending)
        plan = EstimatorPlan(
            file,
            self._conditions,
            slot,
            self._laps,
            self._turns[slot],
            self._cursors[slot],
            starts > 1,
            self._every,
        )
        return plan, self._exchange.address

    def _drain(self, slot: int, news: News) -> None:
        queue = self._exchange.news[slot]
        while (message := queue.read()) is not None:
            report: Report = pickle.loads(message)
            queue.take()
            self._cursors[slot] = report.cursor
            self.cpu[slot] = report.cpu
            self._turns[slot] += len(report.news.turns)
            news.add(report.news)
            for jump in report.news.jumps:
                self._jumped(jump)
            if report.ready:
                self.ready.add(slot)
            if report.done:
                self.done.add(slot)
            if report.error and slot not in self.ready:
                raise FmuError(report.error)
            if report.error:
                news.messages.append(report.error)
