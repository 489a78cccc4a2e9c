"""Processes that are started again, one that stands by, and who goes first."""

import os
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest

from bench.deadline import Deadline
from bench.errors import DeviceError
from bench.live import kept as kept_module
from bench.live.kept import CONTEXT, Kept
from bench.live.priority import BELOW, PRIORITY, below, realtime

PATIENCE = 60.0


def tell(news: Any, number: int) -> None:
    """Say who it is, and wait."""
    news.put((number, os.getpid()))
    time.sleep(PATIENCE)


def until(true: Callable[[], bool], kept: Kept) -> None:
    end = Deadline.after(PATIENCE)
    while not true():
        kept.look()
        assert not end.expired
        time.sleep(0.01)


def test_one_that_stands_by_takes_over_and_gets_a_successor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(kept_module, "STAND_BY", 0.0)
    news = CONTEXT.SimpleQueue()
    kept = Kept(tell, lambda starts: (news, starts), stand_by=True)
    spares = []
    for number in (1, 2, 3):
        until(lambda: not news.empty(), kept)
        assert news.get() == (number, kept.process_id)
        assert kept.starts == number
        until(lambda: kept._spare is not None, kept)
        spares.append(kept._spare.pid)
        os.kill(kept.process_id or 0, signal.SIGKILL)
        until(lambda: kept.starts > number, kept)  # noqa: B023
        assert kept.process_id == spares[-1]
    until(lambda: not news.empty(), kept)
    assert news.get() == (4, spares[-1])
    kept.wait(0.0)
    assert not kept.alive


def test_where_the_one_that_stands_by_has_died_a_new_one_is_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(kept_module, "STAND_BY", 0.0)
    news = CONTEXT.SimpleQueue()
    kept = Kept(tell, lambda starts: (news, starts), stand_by=True)
    until(lambda: kept._spare is not None and not news.empty(), kept)
    assert news.get()[0] == 1
    spare = kept._spare
    os.kill(spare.pid, signal.SIGKILL)
    spare.join()
    os.kill(kept.process_id or 0, signal.SIGKILL)
    until(lambda: not news.empty(), kept)
    assert news.get() == (2, kept.process_id)
    left = kept._spare
    kept.wait(0.0)
    if left is not None:
        with pytest.raises(ValueError, match="closed"):
            left.is_alive()


def refused(*_: object) -> None:
    raise PermissionError


@pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="no real-time priority here")
def test_real_time_priority_is_asked_for_and_its_refusal_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[int, int]] = []
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda _, kind, param: asked.append((kind, param.sched_priority))
    )
    niced: list[int] = []
    monkeypatch.setattr(os, "nice", niced.append)
    realtime()
    below()
    assert asked == [(os.SCHED_RR, PRIORITY), (os.SCHED_OTHER, 0)]
    assert niced == [BELOW]
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    with pytest.raises(DeviceError, match=r"--realtime: .*limits\.conf"):
        realtime()
    monkeypatch.delattr(os, "sched_setscheduler")
    with pytest.raises(DeviceError, match=r"Linux is needed"):
        realtime()
