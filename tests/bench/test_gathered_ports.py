"""Reads of several ports through one exchange: in order, none twice, none lost."""

import pickle
from collections.abc import Iterator

import pytest

from tirebench.deadline import Deadline
from tirebench.errors import UnpluggedError
from tirebench.links import Read
from tirebench.live.exchange import Exchange
from tirebench.live.ports import GatheredLink, PortState
from tirebench.live.supervised import CONTEXT


@pytest.fixture
def exchange() -> Iterator[Exchange]:
    made = Exchange.create(CONTEXT, 1, 0, 2)
    for number in range(2):
        made.ports[number].put(pickle.dumps(PortState(f"port {number}"), 5))
    yield made
    made.close()


def put(exchange: Exchange, source: int, *arrivals: int) -> None:
    for arrival in arrivals:
        exchange.reads[source].put(pickle.dumps(Read(arrival, b"x", "", source), 5))


def test_reads_of_several_ports_come_in_the_order_of_the_clock(exchange: Exchange) -> None:
    put(exchange, 0, 1, 4, 5)
    put(exchange, 1, 2, 3, 5)
    link = GatheredLink(exchange, {})
    assert link.name == "port 0 + port 1"
    reads = [link.receive(Deadline.after(1.0)) for _ in range(6)]
    assert [(r.arrival, r.source) for r in reads if r] == [
        (1, 0),
        (2, 1),
        (3, 1),
        (4, 0),
        (5, 0),
        (5, 1),
    ]
    nothing = link.receive(Deadline.after(0.0))
    assert nothing is not None
    assert nothing.data == b""


def test_a_reader_after_another_takes_nothing_twice_and_loses_nothing(exchange: Exchange) -> None:
    put(exchange, 0, 1, 3)
    put(exchange, 1, 2)
    first = GatheredLink(exchange, {})
    assert [getattr(first.receive(Deadline.after(1.0)), "arrival", 0) for _ in range(2)] == [1, 2]
    other = Exchange(exchange.address)  # the first one ended while it was busy with the second read
    rest = GatheredLink(other, {0: 1, 1: 2}).receive(Deadline.after(1.0))
    assert rest is not None
    assert (rest.arrival, rest.source) == (3, 0)
    other.close()


def test_a_port_that_stays_away_is_told_after_what_it_brought(exchange: Exchange) -> None:
    put(exchange, 1, 1)
    gone = PortState("port 1", error=("UnpluggedError", "port 1: it went away"))
    exchange.ports[1].put(pickle.dumps(gone, 5))
    link = GatheredLink(exchange, {})
    read = link.receive(Deadline.after(1.0))
    assert read is not None
    assert read.data == b"x"
    link._next_look = 0.0
    with pytest.raises(UnpluggedError, match="port 1: it went away"):
        link.receive(Deadline.after(1.0))


def test_several_ports_are_unplugged_when_the_last_one_is_given_up(exchange: Exchange) -> None:
    link = GatheredLink(exchange, {})
    for number in range(2):
        assert link.receive(Deadline.after(0.0)) is not None
        gone = PortState(f"port {number}", gone=f"port {number}: it went away")
        exchange.ports[number].put(pickle.dumps(gone, 5))
        link._next_look = 0.0
    with pytest.raises(UnpluggedError, match="port 0: it went away; port 1: it went away"):
        link.receive(Deadline.after(0.0))
