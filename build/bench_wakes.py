"""What an estimator process of the bench spends, part by part, at the pace of a live line.

    python build/bench_wakes.py [--rate 200] [--seconds 8]

Blocks of a wheel at 10 kHz go through the bench's queue into a process that does nothing but wait
for them, then one that also takes them from the queue, one that unpickles them, one that prepares
the steps of the FMU, and one that takes these steps. Each is timed alone. The last two lines are
all of it once more: as the bench does it, resting until the next turn may be due, and with blocks
that lie ready, so without a pause.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.fmu import live
from tests.synthetic import record
from tirebench.estimator.estimation import WheelEstimation
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.estimator.wheels import Block
from tirebench.live.estimator import rest, with_following
from tirebench.live.exchange import FINISH, Address, Exchange, woken
from tirebench.live.supervised import CONTEXT, orphaned, settled
from tirebench.wire.conditions import Conditions
from tirebench.wire.timeline import Samples
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.fmu.build import build_fmu

RATE, SAMPLES = 1e4, 16
WAITS, TAKES, UNPICKLES, PREPARES, STEPS = range(5)
SAID = ("waits", "takes", "unpickles", "prepares steps", "steps the FMU")


class _NoModel:
    """An estimator that does nothing."""

    samples = SAMPLES

    def start(self, period: float) -> None: ...

    def step(self, *_: Any) -> None: ...


def work(does: int, said: str, rests: bool, file: FmuFile, address: Address, rate: float) -> None:
    """Do as much as an estimator process does, and print what it costs."""
    exchange = Exchange(address)
    queue, model = exchange.samples[0], FmuModel(file) if does == STEPS else _NoModel()
    estimation = WheelEstimation(model, Conditions.constant(speed=live.SPEED), laps=False)
    settled()
    address.news.release()
    woken(address.fresh[0], 60.0)
    wakes = blocks = 0
    came, length = [float("nan")] * 2, float("nan")  # when the last two turns came
    begin, used = time.monotonic(), time.process_time()
    while not orphaned():
        while does > WAITS and (message := queue.read()) is not None:
            blocks += 1
            if does >= UNPICKLES:
                block = Block.unpack(message)
            if does >= PREPARES:
                block, _ = with_following(block, block.content, queue)
                blocks += max(0, len(block.parts) - 1)
                if (turns := estimation.take(block).turns) and rests:
                    came = [came[1], 1e-9 * turns[-1].arrival]
                    length = came[1] - came[0]
            queue.take()
        if exchange.is_set(FINISH):
            break
        wakes += 1
        time.sleep(rest(time.monotonic() - came[1], length))
        woken(address.fresh[0], 0.1)
    used, length = time.process_time() - used, time.monotonic() - begin
    each = used / (blocks or wakes)
    sys.stdout.write(
        f"{said}: woken {wakes / length:.0f} times a second, {1e6 * each:.0f} us a block, "
        f"{100 * each * rate:.1f} % of a core at {rate:g} blocks a second\n"
    )
    sys.stdout.flush()
    exchange.close()


def feed(exchange: Exchange, strain: FloatArray, rate: float, seconds: float, pause: bool) -> None:
    """Write blocks into the queue: in real time, or all before the other process looks."""
    size, begin = round(RATE / rate), time.monotonic()
    plain = np.zeros((size, strain.shape[1]), np.bool_)
    for i in range(round(seconds * rate)):
        first = i * size
        rows = strain[first % (len(strain) - size) :][:size]
        samples = Samples(
            0,
            "" if i else "start",
            first,
            round(1e6 * first / RATE),
            1 / RATE,
            rows,
            plain[:, 0],
            plain,
        )
        exchange.samples[0].put(Block(0, time.monotonic_ns(), 0, samples).pack())
        if pause:
            exchange.address.fresh[0].release()
            time.sleep(max(0.0, begin + (i + 1) / rate - time.monotonic()))
    exchange.set(FINISH)
    exchange.address.fresh[0].release()


def main() -> None:
    """Time each part."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--rate", type=float, default=200.0, help="blocks a second")
    options.add_argument("--seconds", type=float, default=8.0)
    given = options.parse_args()
    strain = record(turns=40.0, speed=live.SPEED, noise=4e-6, rate=RATE)[0].T.copy()
    with tempfile.TemporaryDirectory() as folder:
        fmu = build_fmu(live.calibration_file(), Path(folder) / "x.fmu", samples_per_step=SAMPLES)
        with FmuFile(read_fmu(fmu)) as file:
            parts = [(does, said, False, True) for does, said in enumerate(SAID)]
            parts += [(STEPS, "rests", True, True), (STEPS, "without a pause", False, False)]
            for does, said, rests, pause in parts:
                exchange = Exchange.create(CONTEXT, 1)
                process = CONTEXT.Process(
                    target=work, args=(does, said, rests, file, exchange.address, given.rate)
                )
                process.start()
                exchange.address.news.acquire()
                feed(exchange, strain, given.rate, given.seconds, pause)
                process.join()
                exchange.close()


if __name__ == "__main__":
    with one_thread():
        main()
