"""What four wheels lose at ordinary priority on a busy machine.

    python build/bench_priority.py CAMPAIGN [--seconds 15] [--hogs 4] [--wheels 4]
        [--realtime | --together]

A sender of its own writes slcan FD at 10 kHz a wheel into a pseudo-terminal, as a USB adapter does:
it has a buffer of 16 kB, and what does not fit is lost. The sender has real-time priority, so that
only the bench is short of processor. Beside it run jobs that use all they get. Bytes that were lost
are counted by the sender, bytes that came by the recording.
"""

import argparse
import multiprocessing
import os
import time
import tty
from contextlib import suppress
from multiprocessing.queues import Queue
from pathlib import Path

from bench_recording import READ, pieces, write

from tirebench.deadline import Deadline
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.live_plan import LivePlan
from tirebench.live.priority import realtime
from tirebench.live.reader import ReaderPlan
from tirebench.protocols import SLCAN
from tirebench.protocols.layouts import RAW16
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.header import RecordingHeader
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import Conditions
from tirelib.core.threads import one_thread

FIFO = 16 * 1024


def send(
    master: int, reads: list[bytes], seconds: float, results: "Queue[tuple[int, int]]"
) -> None:
    """Write at the pace of the wheels; count what the buffer did not hold."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(20))
    os.set_blocking(master, False)
    fifo, sent, lost, start = bytearray(), 0, 0, time.monotonic()
    steps = 8  # of a read: half a millisecond each
    number = 0
    while (now := time.monotonic() - start) < seconds:
        due = int(now / (READ / steps))
        while number <= due:
            data = reads[(number // steps) % len(reads)]
            part = len(data) * (number % steps) // steps, len(data) * (number % steps + 1) // steps
            piece = data[slice(*part)]
            sent += len(piece)
            if len(fifo) + len(piece) > FIFO:
                lost += len(piece)
            else:
                fifo += piece
            number += 1
        with suppress(BlockingIOError):
            while fifo:
                del fifo[: os.write(master, fifo[:4096])]
        time.sleep(2e-4)
    results.put((sent, lost))


def hog() -> None:
    """Use all there is."""
    while True:
        sum(range(10_000))


def main() -> None:
    """Print what was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaign", type=Path)
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--hogs", type=int, default=4)
    parser.add_argument("--wheels", type=int, default=4)
    parser.add_argument("--realtime", action="store_true")
    parser.add_argument("--together", action="store_true", help="read and decode in one process")
    parser.add_argument("--out", type=Path, default=Path("build/out/bench-priority.mcap"))
    given = parser.parse_args()
    length, reads = pieces(given.campaign, SLCAN, RAW16, tuple(range(given.wheels)), given.seconds)
    seconds = min(given.seconds, length)
    given.out.unlink(missing_ok=True)
    master, slave = os.openpty()
    tty.setraw(slave)
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    hogs = [context.Process(target=hog, daemon=True) for _ in range(given.hogs)]
    sender = context.Process(target=send, args=(master, reads, seconds, results))
    said = realtime(given.realtime)
    source = SourcePlan(
        PortPlan(f"slcan:{os.ttyname(slave)}", bitrate=1_000_000, data_bitrate=5_000_000),
        ProtocolPlan(SLCAN, 1e4),
    )
    apart = not (given.realtime or given.together)
    reader = ReaderPlan((source,), 5.0, apart=apart)
    plan = LivePlan(reader, None, Conditions.constant(), RecordingHeader({}), given.out)
    with LiveChain(plan) as chain:
        for process in (*hogs, sender):
            process.start()
        while sender.is_alive():
            chain.poll(Deadline.after(0.2))
        sent, lost = results.get()
        for process in hogs:
            process.terminate()
        chain.finish("stopped")
        counts = chain.counts()
        timeline = chain.wheels.counts[1]
    write(
        f"{said}; load {os.getloadavg()[0]:.0f}; {given.hogs} hogs, {given.wheels} wheels: "
        f"{100 * lost / sent:.1f} % of {sent / 1e6:.1f} MB lost in the adapter's buffer, "
        f"{counts['raw']['lost_bytes']} bytes for want of a recorder; "
        f"{timeline.lost_samples} samples lost, "
        f"{counts['raw']['not_decoded_bytes']} bytes not decoded; {counts['cpu_s']}"
    )


if __name__ == "__main__":
    with one_thread():
        main()
