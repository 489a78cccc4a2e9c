"""A session ends when it should; what is played in a loop goes on in time."""

import time
from collections.abc import Sequence
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from tests.bench.campaigns import tiny_runs
from tests.bench.clocks import Clock
from tests.bench.in_process import FakeSource, InProcess
from tests.bench.test_page import block
from tests.bench.test_page import turn as made_turn
from tirebench.cli.run_session import print_summary
from tirebench.deadline import Deadline
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.estimator.chain import Outputs, Turn
from tirebench.estimator.dead_gages import DeadGages
from tirebench.estimator.estimation import News, WheelEstimation
from tirebench.estimator.session import Limits, Session
from tirebench.estimator.wheels import Block
from tirebench.links import Read
from tirebench.recording.replay import ReplayChain
from tirebench.wire.conditions import Condition, Conditions
from tirebench.wire.device import Device
from tirelib.core.arrays import FloatArray
from tirelib.core.flags import TurnFlag


class Counter:
    """An estimator that ends a turn every 1000 samples."""

    samples = 16

    def start(self, period: float) -> None:
        self.count = 0

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        before, self.count = self.count, self.count + len(strain)
        if before // 1000 == self.count // 1000:
            return None
        names = ("Fz", "alpha", "kappa", "Fy", "flags", "age")
        return {**dict.fromkeys(names, 0.0), "valid": 1.0}, {}


class Scripted:
    """A link that gives prepared reads; None ends it, an exception is raised."""

    name, live, encoding = "scripted", True, "serial-v1"

    def __init__(self, reads: Sequence[bytes | Exception | None]) -> None:
        self._reads = list(reads)

    def receive(self, deadline: Deadline) -> Read | None:
        if not self._reads:
            time.sleep(min(deadline.remaining, 0.01))
            return Read(time.monotonic_ns(), b"")
        read = self._reads.pop(0)
        if isinstance(read, Exception):
            raise read
        return None if read is None else Read(time.monotonic_ns(), read)

    def close(self) -> None:
        pass

    def overruns(self) -> int:
        return 0


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Time that passes only where nothing comes any more."""
    made = Clock()
    for module in (
        "tirebench.estimator.session",
        "tirebench.recording.replay",
        "tirebench.deadline",
        __name__,
    ):
        monkeypatch.setattr(f"{module}.time", made)
    return made


@pytest.fixture(scope="module")
def wire() -> list[bytes]:
    return list(write_script(tiny_runs()[:1], Device(), Faults({})).frames)


def session(reads: Sequence[bytes | Exception | None], **options: object) -> Session:
    line = InProcess(lambda _: Counter(), Conditions.constant())
    return Session(ReplayChain(Scripted(reads), line.wheels, line.estimation), **options)


@pytest.mark.parametrize(
    ("limits", "end", "reason"),
    [
        (Limits(), [None], "end"),
        (Limits(turns=2), [], "turns"),
        (Limits(silence=0.05), [], "silence"),
        (Limits(duration=2.0), [], "duration"),
    ],
)
def test_a_session_ends_for_a_reason(
    wire: list[bytes], limits: Limits, end: list[Exception | None], reason: str
) -> None:
    outcome = session([*wire, *end], limits=limits).run()
    assert outcome.reason == reason
    assert len(outcome.turns) == (2 if reason == "turns" else 6)


def test_silence_counts_from_the_first_byte() -> None:
    outcome = session([], limits=Limits(duration=0.2, silence=0.05)).run()
    assert outcome.reason == "duration"


def test_stop_ends_in_good_order(wire: list[bytes]) -> None:
    seen: list[Turn] = []
    running = session(wire, watch=lambda news: (seen.extend(news.turns), running.stop())[0])
    assert running.run().reason == "stopped"


def test_turns_whose_load_may_be_used_are_counted() -> None:
    running = session([])
    running._note(News([made_turn(1, valid=0.0, Fz_valid=1.0), made_turn(2, valid=0.0)]))
    assert (running.outcome.count, running.outcome.valid, running.outcome.with_load) == (2, 0, 1)


def test_what_spoils_the_load_is_counted_by_flag_and_printed_at_the_end() -> None:
    running = session([])
    good = replace(made_turn(1, valid=1.0, Fz_valid=1.0), flags=int(TurnFlag.BRIDGED))
    bad = replace(made_turn(2, valid=0.0), flags=int(TurnFlag.GAP | TurnFlag.ACCELERATING))
    running._note(News([good, bad, bad]))
    assert running.outcome.spoiled == {"gap": 2, "accelerating": 2}
    with StringIO() as text:
        console = Console(file=text, width=200)
        print_summary(console, running.outcome, FakeSource(), DeadGages(), 0.0, None, None)
        assert "turns without Fz, by flag: gap 2, accelerating 2" in text.getvalue()


def test_what_the_gages_show_is_passed_on_where_nobody_looks_and_nothing_turns() -> None:
    estimation = WheelEstimation(Counter(), Conditions.constant(), laps=False)
    news = estimation.take(Block(0, 0, 0, block(0, np.zeros((2500, 5)))))
    assert (len(news.levels), len(news.turns)) == (1, 0)
    assert news


def test_a_pass_of_a_loop_goes_on_in_time_and_number() -> None:
    runs, device = tiny_runs()[:2], Device()
    passes = [write_script(runs, device, Faults({}), turn=turn) for turn in (0, 1, 2)]
    known = passes[0].conditions
    looped = Conditions(known.t_us, known.values, known.runs, round(passes[0].duration * 1e6))
    chain = InProcess(lambda _: Counter(), looped)
    turns = [t for script in passes for t in chain.push(b"".join(script.frames))] + chain.finish()
    assert chain.timeline.counts.resets == 5
    assert chain.timeline.counts.lost_frames == 0
    per_pass = [t.run for t in turns[: len(turns) // 3]]
    assert [turn.run for turn in turns] == per_pass * 3
    assert [turn.ready for turn in turns[: len(per_pass)]] == pytest.approx(
        [turn.ready for turn in turns[-len(per_pass) :]], abs=1e-5
    )
