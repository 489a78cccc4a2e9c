"""Our bulk slcan reader against python-can's, over the same pseudo-terminal: CPU of the reader."""

import threading
import time
from collections.abc import Callable

import can
import numpy as np
import pytest

from tests.bench.test_slcan import Keep
from tirebench.deadline import Deadline
from tirebench.links.pseudo import PseudoTerminal
from tirebench.links.slcan_port import SlcanLink
from tirebench.protocols.slcan import SlcanDecoder, encode
from tirebench.protocols.wheel_can import WheelCan
from tirebench.wire.can_batch import same_kind
from tirebench.wire.line_counts import LineCounts

pytestmark = pytest.mark.speed
FRAMES = 3000
PATIENCE = 30.0
LEAST = 10.0
"""Times that ours must be faster on CAN FD; about a hundred was measured."""


def lines(fd: bool) -> list[bytes]:
    data = np.random.default_rng(1).integers(0, 256, (FRAMES, 64 if fd else 8), np.uint8)
    return encode(same_kind(0x120, data, fd=fd))


def send(port: PseudoTerminal, text: list[bytes]) -> None:
    for start in range(0, FRAMES, 8):
        port.send(b"".join(text[start : start + 8]))
        time.sleep(0.0005)


def read_by_python_can(port: PseudoTerminal) -> Callable[[], int]:
    bus = can.Bus(interface="slcan", channel=port.path, bitrate=500_000, sleep_after_open=0.0)

    def read() -> int:
        seen, end = 0, Deadline.after(PATIENCE)
        while seen < FRAMES and not end.expired:
            seen += bus.recv(1.0) is not None
        bus.shutdown()
        return seen

    return read


def read_in_bulk(port: PseudoTerminal) -> Callable[[], int]:
    link = SlcanLink(port.path, 500_000, 2_000_000)
    decoder = SlcanDecoder(Keep(), LineCounts())

    def read() -> int:
        seen, end = 0, Deadline.after(PATIENCE)
        while seen < FRAMES and not end.expired:
            got = link.receive(end)
            seen += len(decoder.frames_of(got.data)) if got else 0
        link.close()
        return seen

    return read


def cost(reader: Callable[[PseudoTerminal], Callable[[], int]], fd: bool) -> float:
    """CPU of the reading thread for a frame, [s]."""
    port = PseudoTerminal()
    read = reader(port)
    sender = threading.Thread(target=send, args=(port, lines(fd)))
    sender.start()
    start = time.thread_time()
    seen = read()
    used = time.thread_time() - start
    sender.join()
    port.close()
    assert seen == FRAMES
    return used / FRAMES


@pytest.mark.parametrize("fd", [False, True])
def test_bulk_reading_is_much_faster(benchmark: object, fd: bool) -> None:
    theirs, ours = cost(read_by_python_can, fd), cost(read_in_bulk, fd)
    benchmark.extra_info |= {
        "python_can_us": 1e6 * theirs,
        "ours_us": 1e6 * ours,
        "speed_up": theirs / ours,
    }
    benchmark(lambda: None)
    print(
        f"fd={fd}: python-can {1e6 * theirs:.1f} us, ours {1e6 * ours:.1f} us a frame, "
        f"speed-up {theirs / ours:.0f}"
    )
    assert theirs > (LEAST if fd else 2.0) * ours


def test_four_wheels_at_10_khz_decode_far_below_a_core(benchmark: object) -> None:
    """Text of 6,667 FD frames a second to strain frames, in reads of 4 ms."""
    data = np.random.default_rng(1).integers(0, 256, (6667, 64), np.uint8)
    data[:, 60] = np.arange(6667) // 4
    time_us = np.arange(6667) // 4 * 600
    data[:, 61:] = np.stack((time_us, time_us >> 8, time_us >> 16), axis=1) & 0xFF
    text = encode(same_kind(0x120 + np.arange(6667) % 4, data, fd=True))
    reads = [b"".join(text[i : i + 27]) for i in range(0, 6667, 27)]

    def decode() -> int:
        counts = LineCounts()
        decoder = SlcanDecoder(WheelCan(1e4, counts), counts)
        for number, read in enumerate(reads):
            decoder.push(read, 4_000_000 * number)
        return counts.ok

    assert benchmark(decode) >= 6666
    start = time.process_time()
    decode()
    share = time.process_time() - start
    benchmark.extra_info["share_of_a_core"] = share
    print(f"four wheels: {100 * share:.1f} % of a core")
    assert share < 0.5
