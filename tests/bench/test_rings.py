"""A queue and a cell in shared memory: order, bounds, and what outlives a process."""

from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirebench.errors import LinkError
from tirebench.live.board import SIZE
from tirebench.live.exchange import LEAST_SAMPLE_BYTES, SAMPLE_BYTES, Exchange
from tirebench.live.rings import _CONTROL, ByteQueue, Cell, _stride, memory
from tirebench.live.supervised import CONTEXT

ROOM = 256


def queue() -> tuple[bytearray, ByteQueue]:
    buffer = bytearray(_CONTROL + ROOM)
    return buffer, ByteQueue(memoryview(buffer))


@given(moves=st.lists(st.one_of(st.binary(max_size=120), st.just(None), st.just("take"))))
def test_a_queue_gives_every_message_once_in_order_or_refuses_it(moves: list[object]) -> None:
    """Against a list; a refused message is one that the bytes that wait leave no room for."""
    buffer, writer = queue()
    reader = ByteQueue(memoryview(buffer))
    sent: deque[bytes] = deque()
    refused = held = 0  # held: bytes of messages that wait or were not taken up
    taken: list[int] = []
    for move in moves:
        if isinstance(move, bytes):
            good = writer.put(move)
            refused += not good
            if good:
                sent.append(move)
                held += _stride(len(move))
            else:
                assert held + _stride(len(move)) > ROOM - 144  # at most one skip to the start
        elif move is None:
            got = reader.read()
            assert got == (sent.popleft() if sent else None)
            if got is not None:
                taken.append(_stride(len(got)))
        else:
            reader.take()
            held -= sum(taken)
            taken.clear()
    assert writer.refused[0] == refused
    assert [reader.read() for _ in sent] == list(sent)
    assert reader.read() is None
    assert writer.high <= ROOM


def test_a_full_queue_refuses_and_keeps_what_it_has() -> None:
    _, both = queue()
    sent = [bytes([number]) * 20 for number in range(10)]
    good = [both.put(message) for message in sent]
    assert good == [True] * 6 + [False] * 4  # 40 bytes each, of 256
    assert both.refused == (4, 80)
    assert [both.read() for _ in range(7)] == [*sent[:6], None]
    assert not both.put(b"x" * 20)  # read, but not taken up
    both.take()
    assert both.put(b"x" * 20)
    assert both.read() == b"x" * 20


def test_a_reader_that_starts_again_gets_what_was_not_taken_up() -> None:
    buffer, writer = queue()
    for message in (b"one", b"two", b"three"):
        writer.put(message)
    first = ByteQueue(memoryview(buffer))
    assert first.read() == b"one"
    first.take()
    assert first.read() == b"two"  # and dies
    second = ByteQueue(memoryview(buffer))
    assert [second.read(), second.read(), second.read()] == [b"two", b"three", None]
    third = ByteQueue(memoryview(buffer))
    third.go_to(first.cursor)  # "two" is known to be done
    assert third.read() == b"three"
    assert ByteQueue(memoryview(buffer)).read() == b"three"


def test_a_message_that_a_writer_left_half_done_is_never_seen() -> None:
    buffer, writer = queue()
    writer.put(b"whole")
    before = writer._control[0]
    writer.put(b"half")
    writer._control[0] = before  # killed before it was declared written
    reader = ByteQueue(memoryview(buffer))
    assert [reader.read(), reader.read()] == [b"whole", None]
    ByteQueue(memoryview(buffer)).put(b"after")  # the writer that comes next
    assert reader.read() == b"after"
    writer.put(b"torn")
    place = (writer._control[0] - _stride(4)) % ROOM + 16
    writer._data[place] ^= 0xFF
    assert reader.read() is None


def test_a_cell_holds_the_newest_message_even_while_the_next_is_written() -> None:
    buffer = bytearray(_CONTROL + 128)
    cell, other = Cell(memoryview(buffer)), Cell(memoryview(buffer))
    assert other.get() is None
    for number in range(5):
        assert cell.put(bytes([number]) * 20)
        assert other.get() == bytes([number]) * 20
    version = cell._control[0]
    cell.put(b"half done")
    cell._control[0] = version
    assert other.get() == bytes([4]) * 20
    assert not cell.put(bytes(100))


def test_too_little_shared_memory_is_told_before_it_is_used() -> None:
    with pytest.raises(LinkError, match=r"of shared memory are free; .* --wheel"):
        memory(1 << 60)


def test_where_shared_memory_is_short_the_queues_of_samples_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The 64 MB of a container hold four wheels and their page."""
    for megabytes, beside, full in ((1000, SIZE, True), (64, SIZE, False), (40, 0, False)):
        monkeypatch.setattr("tirebench.live.exchange.free", lambda n=megabytes: float(n * 2**20))
        exchange = Exchange.create(CONTEXT, 4, beside)
        size = exchange.address.samples
        assert (size == SAMPLE_BYTES) == full
        assert LEAST_SAMPLE_BYTES <= size <= SAMPLE_BYTES
        assert exchange.samples[3].put(bytes(size // 2))
        assert exchange._shared.size + beside <= megabytes * 2**20
        other = Exchange(exchange.address)
        assert other.samples[3].read() == bytes(size // 2)
        other.close()
        exchange.close()


def test_too_little_shared_memory_names_all_that_a_run_needs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tirebench.live.exchange.free", lambda: 40.0 * 2**20)
    with pytest.raises(LinkError, match=r"; 54 MB are needed; .*--shm-size.*--wheel.*--no-page"):
        Exchange.create(CONTEXT, 4, SIZE)
