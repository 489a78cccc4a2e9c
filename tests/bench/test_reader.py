"""The reader: wherever it is killed, the one after it does just what is left."""

import pickle
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.bench.campaigns import tiny_runs
from tirebench.deadline import Deadline
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.estimator.estimation import News
from tirebench.estimator.wheels import Block, Wheels
from tirebench.links import DECODED, PASSED, RESUMED, Read
from tirebench.links.opening import PortPlan
from tirebench.live.exchange import Exchange
from tirebench.live.reader import ReaderPlan, _Reader
from tirebench.live.supervised import CONTEXT
from tirebench.protocols.decoder import SerialDecoder
from tirebench.recording.header import RecordingHeader
from tirebench.recording.link import ReplayLink
from tirebench.recording.recorder import Recorder
from tirebench.recording.replay import ReplayChain
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device


class KilledError(Exception):
    """What ends a reader in the middle of a read."""


WIRE = write_script(tiny_runs()[:1], Device(), Faults({})).frames
KILLS = range(1, 7)
"""Before each call that a reader makes for a read of two wheels; before none of them."""


def read_until(killed_before: int, *, room: bool = True) -> tuple[list[list[bytes]], list[Read]]:
    """Take four reads of two wheels; a reader ends in the second, another goes on.

    Returns what the estimators and the recorder were given.
    """
    exchange = Exchange.create(CONTEXT, 2)
    plan = ReaderPlan((SourcePlan(PortPlan("p")),), 60.0)
    lines = [WIRE, write_script(tiny_runs()[:1], Device(), Faults({}), wheel=1).frames]
    reads = [
        Read(i + 1, b"".join(part for line in lines for part in line[3 * i : 3 * i + 3]))
        for i in range(4)
    ]
    calls = 0

    def counted(method: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any) -> Any:
            nonlocal calls
            calls += 1
            if calls == killed_before:
                raise KilledError
            return method(*given)

        return call

    def reader() -> Any:
        made: Any = _Reader(plan, exchange)
        if not room:
            made._record = lambda _: False
        return made

    first = reader()
    first.publish()
    first.take(reads[0])
    queues: list[Any] = [exchange.raw, exchange.line, *exchange.samples]
    methods = [(queue, queue.put) for queue in queues]
    for queue, put in methods:
        queue.put = counted(put)
    first._decoded = counted(first._decoded)
    try:
        first.take(reads[1])
        rest = reads[2:]
    except KilledError:
        rest = [Read(2, b"", RESUMED), *reads[2:]]
    else:
        assert killed_before == KILLS[-1]
    for queue, put in methods:
        queue.put = put
    del first._decoded
    second = first
    if rest[0].event:
        second = reader()
        assert second.again
        second.catch_up()
    for read in rest:
        second.take(read)
    other = Exchange(exchange.address)
    given = [list(iter(queue.read, None)) for queue in other.samples]
    recorded = [pickle.loads(message) for message in iter(other.raw.read, None)]
    other.close()
    exchange.close()
    return given, recorded


@pytest.mark.parametrize("killed_before", KILLS)
def test_wherever_a_reader_is_killed_samples_come_once_and_a_replay_gives_the_same(
    killed_before: int,
) -> None:
    given, recorded = read_until(killed_before)
    wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
    blocks: list[list[bytes]] = [[], []]
    for read in recorded:
        if read.event == RESUMED:
            wheels.interrupt()
        for block in wheels.push(read.data, read.arrival) if read.data else []:
            blocks[block.wheel].append(block.pack())
    assert given == blocks
    assert all(given)


def test_a_read_that_ends_every_reader_is_left_alone() -> None:
    exchange = Exchange.create(CONTEXT, 1)
    plan = ReaderPlan((SourcePlan(PortPlan("p")),), 60.0)

    def deadly(_: Read) -> list[tuple[int, bytes]]:
        raise KilledError

    _Reader(plan, exchange).publish()
    exchange.raw.put(pickle.dumps(Read(1, b"deadly")))
    for _ in range(2):
        reader: Any = _Reader(plan, exchange)
        reader._decoded = deadly
        with pytest.raises(KilledError):
            reader.catch_up()
    third: Any = _Reader(plan, exchange)
    third._decoded = deadly
    third.catch_up()
    del third._decoded
    third.take(Read(2, WIRE[0]))
    assert third.state.wheels.line.counts.bytes == len(WIRE[0])
    exchange.close()


@pytest.mark.parametrize("killed_before", KILLS)
def test_samples_of_a_read_that_could_not_be_recorded_never_come_twice(killed_before: int) -> None:
    given, _ = read_until(killed_before, room=False)
    for messages in given:
        places = [Block.unpack(message).content.start for message in messages]
        assert places == sorted(set(places))


def test_what_waits_too_long_is_recorded_and_a_replay_leaves_it_out_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0]
    monkeypatch.setattr("tirebench.live.reader.time.monotonic_ns", lambda: now[0])
    exchange = Exchange.create(CONTEXT, 1, ports=1)
    reader = _Reader(ReaderPlan((SourcePlan(PortPlan("p")),), 60.0, apart=True), exchange)
    reader.publish()
    late = [0.0, 0.1, 3.0, 1.0, 0.5, 0.1, 0.0, 1.9, 2.1, 0.0]  # of each read, [s]
    for number, seconds in enumerate(late):
        read = Read((number + 10) * 10**9, b"".join(WIRE[3 * number : 3 * number + 3]))
        now[0] = read.arrival + round(seconds * 1e9)
        reader._pass_or_decode(read)
        reader.take(read)
    given = list(iter(exchange.samples[0].read, None))
    recorded: list[Read] = [pickle.loads(message) for message in iter(exchange.raw.read, None)]
    passed = [read for read in recorded if read.event in (PASSED, DECODED)]
    assert [(read.arrival // 10**9 - 10, read.event) for read in passed] == [
        (2, PASSED),
        (5, DECODED),
        (8, PASSED),
        (9, DECODED),
    ]
    assert b"".join(read.data for read in recorded) == b"".join(WIRE[:30])
    with Recorder(tmp_path / "a.mcap", RecordingHeader({}), Conditions.constant()) as recorder:
        for read in recorded:
            recorder.read(read)
    blocks: list[Block] = []
    with ReplayLink(tmp_path / "a.mcap") as link:
        wheels = Wheels.of_one(SerialDecoder(), {None: Device()})
        estimation: Any = SimpleNamespace(take=lambda found: blocks.extend(found) or News())
        chain = ReplayChain(link, wheels, estimation)
        while not chain.ended:
            chain.poll(Deadline.never())
    assert [block.pack() for block in blocks] == given
    assert wheels.counts == reader.state.wheels.counts
    assert reader.state.passed == sum(map(len, [*WIRE[6:15], *WIRE[24:27]]))
    exchange.close()
