"""What a long time before a trigger costs: memory, and whether bytes are lost while it is written.

    python build/bench_trigger.py [--before SECONDS]

Four wheels at 10 kHz. The time before the trigger is played as fast as the recorder takes it in,
then the trigger comes and the wheels go on in real time until all of it is on disk.
"""

import argparse
import pickle
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tirebench.estimator.wheels import Line, Wheels
from tirebench.links import Read
from tirebench.live.exchange import FINISH, STOP, Exchange
from tirebench.live.recorder import record
from tirebench.live.recording_state import Order, RecorderState, RecordingRule
from tirebench.live.supervised import CONTEXT, Supervised
from tirebench.protocols.decoder import SerialDecoder
from tirebench.recording.header import RecordingHeader
from tirebench.recording.recorder import alarm_event
from tirebench.wire.conditions import Conditions
from tirebench.wire.frames import encode, strain_frames
from tirelib.core.threads import one_thread

WHEELS, FRAMES, PERIOD_US, SAMPLES = 4, 5, 1600, 16
READ = 1e-6 * FRAMES * PERIOD_US
"""A read brings five frames of a wheel, [s]."""
AFTER = 5.0
"""The wheels go on for so long after all is on disk, [s]."""


def reads() -> Iterator[list[bytes]]:
    """Yield what each wheel sends in each read: waves with noise, which compress like strain."""
    rng = np.random.default_rng(1)
    angle = 2.0 * np.pi * 14.0 * np.arange(10_000)[:, None] / 1e4 + np.arange(5)
    counts = (3000.0 * np.sin(angle) + 30.0 * rng.standard_normal((10_000, 5))).astype(np.int16)
    number = 0
    while True:
        rows = (number * FRAMES * SAMPLES + np.arange(FRAMES * SAMPLES)) % len(counts)
        frames = strain_frames(
            counts[rows],
            period=1000,
            seq=number * FRAMES % 2**16,
            t_us=number * FRAMES * PERIOD_US % 2**32,
        )
        yield [b"".join(encode(frames))] * WHEELS
        number += 1


def resident(process: int | None) -> float:
    """Return the memory that a process holds, [bytes]."""
    pages = Path(f"/proc/{process}/statm").read_text().split()[1]
    return 4096.0 * int(pages)


class Bench:
    """A recorder in its process, and what feeds it."""

    def __init__(self, file: Path, before: float) -> None:
        self.exchange = exchange = Exchange.create(CONTEXT, WHEELS)
        self._order("start", str(file))
        rule = RecordingRule(around=(before, 1.0))
        header = RecordingHeader({}, more=({},) * (WHEELS - 1))
        self.recorder = Supervised(
            record, lambda _: (header, Conditions.constant(), rule, exchange.address)
        )
        self._wheels = Wheels([Line(SerialDecoder(), {}, wheel=n) for n in range(WHEELS)])
        self._reads = reads()

    def _order(self, kind: str, what: object) -> None:
        self.exchange.orders.put(pickle.dumps(Order(kind, what, time.monotonic_ns()), 5))

    def state(self) -> RecorderState:
        """Return how far the recorder is."""
        saved = self.exchange.recorded.get()
        return RecorderState() if saved is None else pickle.loads(saved)

    def send(self, arrival: int) -> None:
        """Put the next read of each wheel into the queues."""
        for wheel, data in enumerate(next(self._reads)):
            self.exchange.raw.put(pickle.dumps(Read(arrival, data, "", wheel), 5))
            for block in self._wheels.push(data, arrival, wheel):
                self.exchange.strain.put(pickle.dumps(block, 5))

    def fill(self, seconds: float) -> None:
        """Play the time before the trigger, as fast as it is taken in."""
        start = time.monotonic_ns() - round(1e9 * seconds)
        for number in range(round(seconds / READ)):
            while max(self.exchange.strain.waiting, self.exchange.raw.waiting) > 2**20:
                time.sleep(0.001)
            self.send(start + round(1e9 * READ * number))
        while self.exchange.strain.waiting or self.exchange.raw.waiting:
            time.sleep(0.01)

    def trigger(self) -> tuple[float, int]:
        """Trigger, and go on in real time; return how long the writing took and the most waiting.

        Returns
        -------
        seconds : float
        most : int, [bytes]
        """
        self._order("event", alarm_event("measured", "trigger", on=True))
        start, most, number, done = time.monotonic(), 0, 0, 0.0
        while not done or time.monotonic() - start < done + AFTER:
            due = start + READ * number
            if (wait := due - time.monotonic()) > 0.0:
                time.sleep(wait)
            self.send(time.monotonic_ns())
            most = max(most, self.exchange.raw.waiting + self.exchange.strain.waiting)
            number += 1
            state = self.state()
            if not done and state.recordings and state.path is None:  # all of it is on disk
                done = time.monotonic() - start
        return done, most

    def close(self) -> None:
        """End the recorder."""
        self.exchange.set(STOP)
        self.exchange.set(FINISH)
        self._order("close", "measured")
        self.recorder.wait(600.0)
        self.exchange.close()


def main() -> None:
    """Print what it costs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=float, default=600.0, help="seconds before the trigger")
    before = parser.parse_args().before
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder) / "a.mcap", before)
        bench.fill(before)
        memory = resident(bench.recorder.process_id)
        seconds, most = bench.trigger()
        lost = bench.exchange.raw.refused[1], bench.exchange.strain.refused[0]
        sys.stdout.write(
            f"{before:g} s of {WHEELS} wheels before a trigger: {memory / 1e6:.0f} MB of memory; "
            f"written in {seconds:.1f} s; at most {most / 1e6:.2f} MB waited; {lost[0]} raw bytes "
            f"and {lost[1]} blocks of strain lost\n"
        )
        bench.close()


if __name__ == "__main__":
    with one_thread():
        main()
