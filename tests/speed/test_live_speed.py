"""The live chain in processes: from bytes to an estimate, its cost, and how fast it is back."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.campaigns import quantised
from tests.synthetic import cornering_runs, synthetic_run, write
from tirebench.deadline import Deadline
from tirebench.estimator.estimation import News
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile
from tirebench.links import BACK, LOST
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.live_plan import LivePlan
from tirebench.live.reader import ReaderPlan
from tirebench.protocols import SERIAL, SLCAN
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.recording import Recording, RecordingHeader
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import Conditions
from tirelib.campaign import read_campaign
from tirelib.estimators.calibration_file import write_calibration
from tirelib.estimators.train import train
from tirelib.fmu.build import build_fmu
from tirelib.measured.observations import observe

pytestmark = pytest.mark.speed
PATIENCE = 60.0
SECONDS = 8.0
LATENCY = 0.020
"""From the bytes that ended a turn to its estimate, 99 %, [s]."""
LOST_AT_MOST = 1.0
BACK_WITHIN = 2.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of one long run, and an FMU."""
    made = tmp_path_factory.mktemp("live")
    write(made / "long", [quantised(synthetic_run(1, load=4500.0, turns=200.0, seed=5))])
    campaign = read_campaign(write(made / "set1", cornering_runs()))
    write_calibration(train(observe([campaign])).calibration, made / "cal.toml")
    build_fmu(made / "cal.toml", made / "x.fmu", samples_per_step=16)
    return made


@pytest.fixture
def emulate(folder: Path, tmp_path: Path) -> Iterator[Callable[..., str]]:
    """Start an emulator behind a name that stays; return the name."""
    started: list[subprocess.Popen[bytes]] = []

    def start(*more: object) -> str:
        port = tmp_path / "port"
        command = ["emulate", "--campaign", folder / "long", "--loop", "--link", port, *more]
        started.append(
            subprocess.Popen(
                [sys.executable, "-m", "tirebench", *map(str, command)], stdout=subprocess.DEVNULL
            )
        )
        end = time.monotonic() + PATIENCE
        while not port.is_symlink() and time.monotonic() < end:
            time.sleep(0.02)
        return str(port)

    yield start
    for process in started:
        process.kill()
        process.wait()


def plan_of(port: PortPlan, file: FmuFile, record: Path) -> LivePlan:
    protocol = ProtocolPlan(port.encoding)
    reader = ReaderPlan((SourcePlan(port, protocol),), 60.0)
    conditions = Conditions.constant(18.0, 2.3e5, 0.0)
    header = RecordingHeader({}, protocol=protocol.as_header())
    return LivePlan(reader, file, conditions, header, record)


def gathered(chain: LiveChain, news: News, enough: Callable[[], bool]) -> None:
    end = Deadline.after(PATIENCE)
    while not (enough() or end.expired):
        news.add(chain.poll(Deadline.after(0.1)))


@pytest.mark.parametrize(("line", "wheels"), [(SERIAL, 1), (SLCAN, 4)])
def test_an_estimate_comes_soon_after_its_bytes(
    benchmark: Any,
    emulate: Callable[..., str],
    folder: Path,
    tmp_path: Path,
    line: str,
    wheels: int,
) -> None:
    numbers = [word for wheel in range(wheels) for word in ("--wheel", wheel)]
    kind = ["--format", "RAW16"] if line == SLCAN else []
    name = emulate(*kind, *numbers)
    port = PortPlan(name)
    if line == SLCAN:
        port = PortPlan(f"slcan:{name}", bitrate=1_000_000, data_bitrate=5_000_000)
    with (
        FmuFile(read_fmu(folder / "x.fmu")) as file,
        LiveChain(plan_of(port, file, tmp_path / "a.mcap")) as chain,
    ):
        gathered(chain, News(), lambda: len(chain.wheels.heard) == wheels)
        ready = Deadline.after(4.0)  # the estimators of the other wheels start meanwhile
        gathered(chain, News(), lambda: ready.expired)
        news, end, start = News(), Deadline.after(SECONDS), chain.cpu_time()
        gathered(chain, news, lambda: end.expired)
        share = (chain.cpu_time() - start) / SECONDS
        counts = chain.wheels.counts
        chain.finish("stopped")
    middle, high = np.percentile(news.latency, (50.0, 99.0))
    benchmark.extra_info |= {
        "median_ms": 1e3 * middle,
        "p99_ms": 1e3 * high,
        "cores": share,
        "load_average": os.getloadavg()[0],
    }
    benchmark(lambda: None)
    print(
        f"{wheels} wheels over {line}: median {1e3 * middle:.1f} ms, "
        f"99 % {1e3 * high:.1f} ms, {share:.2f} cores"
    )
    assert counts[1].lost_samples == 0
    assert high < LATENCY
    assert share < wheels


def test_a_killed_process_costs_less_than_a_second_of_raw_bytes(
    benchmark: Any, emulate: Callable[..., str], folder: Path, tmp_path: Path
) -> None:
    port = PortPlan(emulate())
    with (
        FmuFile(read_fmu(folder / "x.fmu")) as file,
        LiveChain(plan_of(port, file, tmp_path / "a.mcap")) as chain,
    ):
        news = News()
        gathered(chain, news, lambda: len(news.turns) > 3)
        for victim in ("estimator 0", "recorder", "reader"):
            os.kill(chain.process_ids[victim] or 0, signal.SIGKILL)
            gathered(chain, news, lambda victim=victim: chain.counts()["restarts"][victim] == 1)
            seen = len(news.turns) + 5
            gathered(chain, news, lambda seen=seen: len(news.turns) > seen)
        chain.finish("stopped")
    recording = Recording(tmp_path / "a.mcap")
    arrivals = [1e-9 * arrival for arrival, _ in recording.raw()]
    recording.close()
    longest = max(b - a for a, b in pairwise(arrivals))
    benchmark.extra_info["longest_gap_s"] = longest
    benchmark(lambda: None)
    print(f"longest gap of the recording {longest:.2f} s")
    assert longest < LOST_AT_MOST


def test_a_cable_that_is_plugged_in_again_is_read_within_two_seconds(
    benchmark: Any, emulate: Callable[..., str], folder: Path, tmp_path: Path
) -> None:
    away = 0.3
    port = PortPlan(emulate("--unplug", 0.7, "--replug", away))
    with (
        FmuFile(read_fmu(folder / "x.fmu")) as file,
        LiveChain(plan_of(port, file, tmp_path / "a.mcap")) as chain,
    ):
        gathered(chain, News(), lambda: chain.wheels.line.counts.reconnects >= 3)
        chain.finish("stopped")
    recording = Recording(tmp_path / "a.mcap")
    events = [(read.event, 1e-9 * read.arrival) for read in recording.reads() if read.event]
    recording.close()
    waits = [b - a for (x, a), (y, b) in pairwise(events) if (x, y) == (LOST, BACK)]
    benchmark.extra_info["longest_s"] = max(waits) - away
    benchmark(lambda: None)
    assert len(waits) >= 3
    assert max(waits) - away < BACK_WITHIN
