"""The process that steps the FMU of one wheel: samples from the queue to reports for the run."""

import pickle
import time
from dataclasses import dataclass, field

from tirebench.errors import FmuError
from tirebench.estimator.chain import RESTARTED, SKIPPED, Jump, Place
from tirebench.estimator.estimation import News, WheelEstimation
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.estimator.wheels import Block
from tirebench.live.exchange import FINISH, Address, Exchange, woken
from tirebench.live.rings import ByteQueue
from tirebench.live.supervised import orphaned, settled
from tirebench.wire.conditions import Conditions
from tirebench.wire.timeline import Samples

BACKLOG = 3.0
"""When samples have waited longer than this, whole turns are skipped, [s]."""
CAUGHT_UP = 0.5
"""Only an estimator that was once up to date skips: after a start it may catch up first, [s]."""
LOOK = 0.1
"""Longest wait for samples before a process looks whether the run goes on, and how much of them it
takes together, [s]."""
RESTED = 0.98
"""Share of a turn's length for which nothing is due after a turn: what comes in that time is taken
together. An estimate of a wheel that turns up to a fiftieth faster than before waits for nothing;
of another it may come later by `LONGEST_REST`."""
LONGEST_REST = 0.2  # [s]
CLOCKS_APART = 1e-3
"""Largest relative difference of the clocks of wheel and host: ten times that of two quartzes."""
FULL = 0.01
"""Wait for the run to take its news, [s]."""


@dataclass(frozen=True, slots=True)
class EstimatorPlan:
    """The FMU and the wheel of an estimator process.

    Attributes
    ----------
    file : FmuFile
    conditions : Conditions
    slot : int
        Whose samples.
    laps : bool
        Whether anybody looks at laps.
    turns : int
        Turns of the wheel so far.
    cursor : int
        What is before this in the queue was done by an estimator that ended.
    again : bool
        Whether there was one.
    every : bool
        Estimate every turn, however late; else turns that are too late are skipped.
    """

    file: FmuFile
    conditions: Conditions
    slot: int
    laps: bool
    turns: int = 0
    cursor: int = 0
    again: bool = False
    every: bool = False


@dataclass(slots=True)
class Report:
    """A report from an estimator to the run.

    Attributes
    ----------
    news : News
    cursor : int
        What is before this in the queue is done.
    cpu : float, [s]
        Time that the process has used.
    ready, done : bool
        The FMU is loaded; nothing will come any more.
    error : str
        What the FMU failed of; empty if it did not.
    """

    news: News = field(default_factory=News)
    cursor: int = 0
    cpu: float = 0.0
    ready: bool = False
    done: bool = False
    error: str = ""


def estimate(plan: EstimatorPlan, address: Address) -> None:
    """Estimate until the run ends; the target of the process."""
    exchange = Exchange(address)
    exchange.samples[plan.slot].go_to(plan.cursor)
    worker = _Estimator(plan, exchange)
    try:
        with FmuModel(plan.file) as model:
            worker.send(Report(ready=True))
            settled()
            worker.run(model)
    except FmuError as error:
        worker.send(Report(error=str(error)))
    exchange.close()


class _Estimator:
    def __init__(self, plan: EstimatorPlan, exchange: Exchange) -> None:
        self._plan = plan
        self._exchange = exchange
        self._queue = exchange.samples[plan.slot]
        self._reports = exchange.news[plan.slot]
        self._expected: Place | None = None
        self._end_us = 0
        self._why = RESTARTED if plan.again else ""  # for a jump with the next samples
        self._caught_up = False
        self._last_turn = float("nan")
        self._turn_length = float("nan")
        self._turn_came = float("nan")  # the bytes that ended it

    def run(self, model: FmuModel) -> None:
        """Take blocks in order until the run wants no more."""
        plan, fresh = self._plan, self._exchange.address.fresh[self._plan.slot]
        self._model = model
        self._estimation = WheelEstimation(model, plan.conditions, laps=plan.laps, turns=plan.turns)
        while not orphaned():
            message = self._queue.read()
            if message is not None:
                self._take(Block.unpack(message))
                self._queue.take()
            elif self._exchange.is_set(FINISH):
                self._report(self._estimation.finish())
                self.send(Report(done=True))
                return
            else:
                self._caught_up = self._caught_up or self._expected is not None
                time.sleep(rest(time.monotonic() - self._turn_came, self._turn_length))
                woken(fresh, LOOK)

    def _take(self, block: Block) -> None:
        content = block.content
        if not isinstance(content, Samples):
            self._report(self._estimation.take(block))
            return
        age = _age(block)
        self._caught_up = self._caught_up or age < CAUGHT_UP
        place = Place(content.segment, content.start)
        if self._why:
            self._jump(Jump(block.wheel, place, place, self._why))
            self._why = ""
        elif self._too_late(age):
            block, content = self._newest(block, content)
        elif self._expected is not None and not content.reset and place != self._expected:
            self._left_out(block.wheel, self._expected, self._end_us, content)  # no room for them
        if content.reset:
            self._report(self._estimation.finish())  # before the FMU takes its time to start again
        block, content = with_following(block, content, self._queue)
        start = Place(content.segment, content.start)
        self._expected = Place(content.segment, content.end)
        self._end_us = content.end_us
        try:
            news = self._estimation.take(block, live=not self._plan.every)
        except FmuError:  # ends this process; the next goes on behind what was taken together
            self._jump(Jump(block.wheel, start, self._expected, RESTARTED, len(content.strain)))
            raise
        self._report(news)

    def _too_late(self, age: float) -> bool:
        """Return whether samples that have waited for this time [s] are to be skipped."""
        if self._plan.every or self._exchange.is_set(FINISH):
            return False
        return self._caught_up and age > BACKLOG

    def _newest(self, block: Block, content: Samples) -> tuple[Block, Samples]:
        """Leave out what is late, up to samples that are not or are the last ones."""
        start, start_us, first = Place(content.segment, content.start), content.t_us, block
        while _age(block) > CAUGHT_UP and (message := self._queue.read()) is not None:
            newer = Block.unpack(message)
            if isinstance(newer.content, Samples):
                block, content = newer, newer.content
        if block is not first:
            self._left_out(block.wheel, start, start_us, content)
        return block, content

    def _left_out(self, wheel: int, start: Place, start_us: int, content: Samples) -> None:
        """Note that samples are left out up to these, and about how many."""
        samples = max(0, round(1e-6 * (content.t_us - start_us) / content.period))
        turns = samples * content.period / self._turn_length
        self._jump(
            Jump(
                wheel,
                start,
                Place(content.segment, content.start),
                SKIPPED,
                samples,
                max(1, round(turns)) if turns == turns else 0,
            )
        )

    def _jump(self, jump: Jump) -> None:
        self._estimation.jump(jump.why)
        self._report(News(jumps=[jump]))

    def _report(self, news: News) -> None:
        news.messages += self._model.take_messages()
        for turn in news.turns:
            self._turn_length = turn.device_time - self._last_turn
            self._last_turn = turn.device_time
            self._turn_came = on_time(1e-9 * turn.arrival, self._turn_came, self._turn_length)
        if news:
            self.send(Report(news))

    def send(self, report: Report) -> None:
        """Send a report to the run; laps are dropped first when the run is busy."""
        report.cursor, report.cpu = self._queue.cursor, time.process_time()
        while not self._reports.put(pickle.dumps(report, 5)):
            report.news.left_out += len(report.news.laps)
            report.news.laps = []
            time.sleep(FULL)
            if orphaned():
                return
        self._exchange.address.news.release()


def with_following(block: Block, content: Samples, queue: ByteQueue) -> tuple[Block, Samples]:
    """Put samples together with those that wait and go on where they end, up to `LOOK`."""
    packed, parts, end = [content.pack()], [(len(content.strain), block.arrival)], content.end
    while (end - content.start) * content.period < LOOK:
        cursor = queue.cursor
        message = queue.read()
        _, arrival, _, more = pickle.loads(message) if message else (0,) * 4
        if not isinstance(more, tuple) or more[:3] != (content.segment, "", end):
            queue.cursor = cursor  # it stays there
            break
        packed.append(more)
        end += len(more[-2])  # a byte for each sample
        parts.append((end - content.start, arrival))
    if len(packed) > 1:
        content = Samples.unpack(*packed)
        block = Block(block.wheel, parts[-1][1], block.first_us, content, tuple(parts))
    return block, content


def rest(since: float, length: float) -> float:
    """Return how long an estimator may rest with its samples taken, [s].

    Parameters
    ----------
    since : float, [s]
        Time since the bytes came that ended the last turn.
    length : float, [s]
        Length of that turn; NaN where it is not known.
    """
    left = RESTED * length - since
    return min(left, LONGEST_REST) if left > 0.0 else 0.0


def on_time(came: float, before: float, length: float) -> float:
    """Return when the bytes that ended a turn would have come if none had been late, [s].

    A read that was late says nothing of when the next turn is due.

    Parameters
    ----------
    came : float, [s]
        When they came.
    before : float, [s]
        The same of the turn before, if none had been late; NaN where there was none.
    length : float, [s]
        Length of the turn by the wheel's clock; NaN where it is not known.
    """
    due = before + (1.0 + CLOCKS_APART) * length
    return due if 0.0 < came - due < 0.5 * length else came


def _age(block: Block) -> float:
    """Time since the bytes of a block came, [s]."""
    return 1e-9 * (time.monotonic_ns() - block.arrival)
