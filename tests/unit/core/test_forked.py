"""Calls in this process and in a copy of it: the same results with one processor and two."""

import os
import select
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.forked import forked

COUNT = 5


@pytest.fixture(params=[1, 2])
def processors(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("tirelib.core.forked._processors", lambda: request.param)
    return int(request.param)


def test_results_come_in_the_order_of_the_calls(processors: int) -> None:
    found = forked([partial(np.full, 3, float(k)) for k in range(COUNT)])
    np.testing.assert_array_equal(found, np.arange(COUNT)[:, None] * np.ones(3))


def test_what_the_copy_cannot_send_is_computed_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first call waits for the second, so that each process has one of them."""
    monkeypatch.setattr("tirelib.core.forked._processors", lambda: 2)
    back, out = os.pipe()

    def first() -> Callable[[], int]:
        assert select.select([back], [], [], 30.0)[0], "the other waits for this call"
        return lambda: 7

    def second() -> Callable[[], int]:
        os.write(out, b".")
        return lambda: 8

    try:
        made = forked([first, second])
    finally:
        os.close(back)
        os.close(out)
    assert [each() for each in made] == [7, 8]


def test_a_long_call_does_not_keep_the_others_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tirelib.core.forked._processors", lambda: 2)
    back, out = os.pipe()

    def first() -> int:
        assert select.select([back], [], [], 30.0)[0], "the others wait for this call"
        return os.getpid()

    def last() -> int:
        os.write(out, b".")
        return os.getpid()

    try:
        found = forked([first, os.getpid, last])
    finally:
        os.close(back)
        os.close(out)
    assert found[1] == found[2] != found[0]
    assert os.getpid() in found


def test_what_both_have_comes_back_as_the_same_object(processors: int) -> None:
    def law() -> None:
        """Be a function that cannot be sent."""

    def tell() -> tuple[Callable[[], None], int]:
        return law, 3

    assert all(each[0] is law for each in forked([tell] * 2, [law]))


def test_what_cannot_be_sent_is_computed_here(processors: int) -> None:
    made: list[Callable[[], int]] = forked([lambda: lambda: 7] * 2)
    assert [each() for each in made] == [7, 7]


def test_what_a_call_raises_is_raised_here(processors: int) -> None:
    def refuse() -> int:
        raise ParameterError("no such thing")

    with pytest.raises(ParameterError, match="no such thing"):
        forked([lambda: 1, refuse])
    with pytest.raises(ParameterError, match="no such thing"):
        forked([refuse, lambda: 1])


def test_an_iteration_that_fails_in_the_copy_fails_here_with_its_iterate(processors: int) -> None:
    def fails() -> None:
        raise ConvergenceError("no contact", [1.0, 2.0], 0.5)

    with pytest.raises(ConvergenceError, match="no contact") as found:
        forked([lambda: None, fails])
    assert (found.value.iterate, found.value.residual) == ([1.0, 2.0], 0.5)
