"""Processes that are started again, one that stands by, and who goes first."""

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.bench.programs import PATIENCE
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError
from tirebench.live import supervised as kept_module
from tirebench.live.priority import BELOW, PRIORITY, as_parent, below, realtime
from tirebench.live.supervised import CONTEXT, Supervised


def tell(news: Any, number: int) -> None:
    """Say who it is and what it had loaded before, and wait.

    Through a pipe, without a lock: who is killed as soon as it was heard would keep it.
    """
    news.send((number, os.getpid(), os.environ.get("LOADED", "")))
    time.sleep(PATIENCE)


def load(news: Any, number: int) -> None:
    """Take the place of what one that stands by loads."""
    os.environ["LOADED"] = str(number)


def until(true: Callable[[], bool], kept: Supervised) -> None:
    end = Deadline.after(PATIENCE)
    while not true():
        kept.look()
        assert not end.expired
        time.sleep(0.01)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Any, Supervised]]:
    """What processes say, and one of them with another that stands by at once."""
    monkeypatch.setattr(kept_module, "STAND_BY", 0.0)
    news, telling = CONTEXT.Pipe(duplex=False)
    kept = Supervised(tell, lambda starts: (telling, starts), stand_by=load)
    with news, telling:
        yield news, kept
        kept.wait(0.0)
        assert not kept.alive


def test_one_that_stands_by_takes_over_and_gets_a_successor(told: tuple[Any, Supervised]) -> None:
    news, kept = told
    assert kept._spare_alive
    assert kept._spare_begun <= kept._started  # before there is anything to lose
    spares = []
    for number in (1, 2, 3):
        until(news.poll, kept)
        assert news.recv() == (number, kept.process_id, str(number) if number > 1 else "")
        assert kept.starts == number
        until(lambda: kept._spare_alive, kept)
        spares.append(kept._spare.pid)
        os.kill(kept.process_id or 0, signal.SIGKILL)
        until(lambda before=number: kept.starts > before, kept)
        assert kept.process_id == spares[-1]
    until(news.poll, kept)
    assert news.recv() == (4, spares[-1], "4")


def test_where_the_one_that_stands_by_has_died_a_new_one_is_started(
    told: tuple[Any, Supervised], monkeypatch: pytest.MonkeyPatch
) -> None:
    news, kept = told
    monkeypatch.setattr(kept_module, "LIVED", PATIENCE)
    until(news.poll, kept)
    assert news.recv()[0] == 1
    spare = kept._spare
    os.kill(spare.pid, signal.SIGKILL)
    spare.join()
    os.kill(kept.process_id or 0, signal.SIGKILL)
    until(news.poll, kept)
    assert news.recv() == (2, kept.process_id, "")
    assert kept._spare is spare  # not missed at once: what ends it may end others too
    monkeypatch.setattr(kept_module, "LIVED", 0.0)
    until(lambda: kept._spare_alive, kept)
    left = kept._spare
    kept.wait(0.0)
    if left is not None:
        with pytest.raises(ValueError, match="closed"):
            left.is_alive()


class System:
    """What a Linux system knows of priorities; the parent's is that of this process."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.policy, self.priority, self.nice = 0, 0, 0
        linux = {
            "SCHED_RR": 2,
            "SCHED_RESET_ON_FORK": 0x4000_0000,
            "sched_param": int,
            "sched_setscheduler": self.set,
            "sched_getscheduler": lambda _: self.policy,
            "nice": self.be_nice,
        }
        for name, value in linux.items():  # other systems have none of them
            monkeypatch.setattr(os, name, value, raising=False)

    def set(self, _: int, policy: int, priority: int) -> None:
        self.policy, self.priority = policy, priority

    def be_nice(self, by: int) -> None:
        self.nice += by


def refused(*_: object) -> None:
    raise PermissionError


def test_real_time_priority_is_taken_where_it_may_be_had(monkeypatch: pytest.MonkeyPatch) -> None:
    system = System(monkeypatch)
    assert realtime(False) == "ordinary, as asked for"
    assert system.policy == 0
    assert realtime(None) == f"real-time {PRIORITY}"
    assert (system.policy, system.priority) == (0x4000_0002, PRIORITY)


def test_processes_of_a_run_take_over_its_priority(monkeypatch: pytest.MonkeyPatch) -> None:
    system = System(monkeypatch)
    as_parent()
    assert system.priority == 0
    realtime(True)
    system.priority = 0
    as_parent()
    assert system.priority == PRIORITY
    below()
    assert system.nice == BELOW


def test_the_refusal_of_real_time_priority_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    System(monkeypatch)
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    assert re.search(r"ordinary.*limits\.conf", realtime(None))
    with pytest.raises(DeviceError, match=r"--realtime: .*limits\.conf"):
        realtime(True)
    monkeypatch.delattr(os, "sched_setscheduler")
    assert "no real-time priority" in realtime(None)
    with pytest.raises(DeviceError, match=r"Linux is needed"):
        realtime(True)
    as_parent()
