"""From samples of the wheels to turns and laps; the same code live and in a replay."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from tirebench.estimator.chain import RESTARTED, Estimator, Jump, Place, Turn, WheelChain
from tirebench.estimator.laps import Laps
from tirebench.estimator.standing import Level, Levels
from tirebench.estimator.wheels import Block
from tirebench.wire.conditions import Conditions
from tirebench.wire.timeline import Samples

LONGEST_WAIT_FOR_LAPS = 1.0
"""When samples have waited longer than this, laps are left out, [s]."""


@dataclass(slots=True)
class News:
    """Results of some samples.

    Attributes
    ----------
    turns : list of Turn
    laps : list of bytes
        See `tirebench.estimator.laps.Lap.pack`.
    messages : list of str
        What an estimator said.
    alarms : list of str
        What the user has to know at once: nothing can be recorded, or it can again.
    jumps : list of Jump
    levels : list of Level
        Strain of the last moments, for whoever looks.
    left_out : int
        Laps that were left out because the estimator was late.
    latency : list of float, [s]
        From the arrival of the bytes that ended a turn to its estimate; live only.
    """

    turns: list[Turn] = field(default_factory=list)
    laps: list[bytes] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    alarms: list[str] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    levels: list[Level] = field(default_factory=list)
    left_out: int = 0
    latency: list[float] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(
            self.turns
            or self.laps
            or self.messages
            or self.alarms
            or self.jumps
            or self.levels
            or self.left_out
        )

    def add(self, other: "News") -> None:
        """Add what came later."""
        for name in ("turns", "laps", "messages", "alarms", "jumps", "levels", "latency"):
            getattr(self, name).extend(getattr(other, name))
        self.left_out += other.left_out


def skipped(jumps: Sequence[Jump], wheel: int) -> dict[str, int]:
    """Return what estimators left out of a wheel, and how often one was started again."""
    mine = [jump for jump in jumps if jump.wheel == wheel]
    return {
        "skipped_turns": sum(jump.turns for jump in mine),
        "skipped_samples": sum(jump.samples for jump in mine),
        "estimator_restarts": sum(jump.why == RESTARTED for jump in mine),
    }


class WheelEstimation:
    """One wheel.

    Parameters
    ----------
    estimator : Estimator
    conditions : Conditions
    jumps : sequence of Jump
        What a recording says of the run, in order; done again here.
    laps : bool
        Whether anybody looks at laps.
    turns : int
        Turns before, of an estimator that was ended.
    """

    def __init__(
        self,
        estimator: Estimator,
        conditions: Conditions,
        jumps: Sequence[Jump] = (),
        *,
        laps: bool = True,
        turns: int = 0,
    ) -> None:
        self._chain = WheelChain(estimator, conditions)
        self._jumps = list(jumps)
        self._turns = turns
        self._looked_at = laps
        self._laps: Laps | None = None
        self._levels: Levels | None = None

    def take(self, block: Block, *, live: bool = False) -> News:
        """Take the next block and return its results."""
        content = block.content
        if isinstance(content, Samples):
            if self._left_out(Place(content.segment, content.start)):
                return News()
            if self._looked_at:
                self._laps = self._laps or Laps(block.wheel)
                self._laps.samples(content)
        news = self._news(self._chain.take(block))
        if isinstance(content, Samples):
            self._levels = self._levels or Levels(block.wheel)
            news.levels = self._levels.take(content)
        if live and news.laps and time.monotonic_ns() - block.arrival > 1e9 * LONGEST_WAIT_FOR_LAPS:
            news.left_out, news.laps = len(news.laps), []
        return news

    def jump(self, why: str) -> None:
        """Start again with the next samples."""
        self._chain.jump(why)
        self._laps = None

    def finish(self) -> News:
        """Step the remaining samples."""
        return self._news(self._chain.finish())

    def _left_out(self, place: Place) -> bool:
        """Do what the recorded run did here; return whether it left these samples out."""
        if not self._jumps or place < self._jumps[0].start:
            return False
        if place < self._jumps[0].end:
            return True
        self.jump(self._jumps.pop(0).why)
        return self._left_out(place)

    def _news(self, turns: list[Turn]) -> News:
        news = News(turns)
        for turn in turns:
            self._turns += 1
            if self._laps is not None:
                self._laps.turn(turn, self._turns)
        if self._laps is not None:
            news.laps = [lap.pack() for lap in self._laps.take()]
        return news


class Estimation:
    """All wheels of a line, in this process.

    Parameters
    ----------
    estimator : callable
        Gives the estimator of a wheel by its number.
    conditions : Conditions
    jumps : sequence of Jump
    laps : bool
        See `WheelEstimation`.

    Attributes
    ----------
    jumps : tuple of Jump
    """

    def __init__(
        self,
        estimator: Callable[[int], Estimator],
        conditions: Conditions,
        jumps: Sequence[Jump] = (),
        *,
        laps: bool = True,
    ) -> None:
        self._estimator = estimator
        self.jumps = tuple(jumps)
        self._conditions = conditions
        self._laps = laps
        self._wheels: dict[int, WheelEstimation] = {}

    def take(self, blocks: Sequence[Block]) -> News:
        """Take what a read brought, all wheels."""
        news = News()
        for block in blocks:
            news.add(self._wheel(block.wheel).take(block))
        return news

    def finish(self) -> News:
        """Step what is left of every wheel."""
        news = News()
        for wheel in self._wheels.values():
            news.add(wheel.finish())
        return news

    def _wheel(self, number: int) -> WheelEstimation:
        if number not in self._wheels:
            jumps = [jump for jump in self.jumps if jump.wheel == number]
            estimator = self._estimator(number)
            self._wheels[number] = WheelEstimation(
                estimator, self._conditions, jumps, laps=self._laps
            )
        return self._wheels[number]
