"""The bench keeps up with one wheel at 10 kHz (625 frames/s) at under half a core."""

import time
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.bench.campaigns import quantised
from tests.bench.in_process import InProcess
from tests.synthetic import cornering_runs, synthetic_run, write
from tirebench.emulator.emulator import write_script
from tirebench.emulator.faults import Faults
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.protocols.decoder import SerialDecoder
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device
from tirebench.wire.timeline import Timeline
from tirelib.campaign import read_campaign
from tirelib.estimators.calibration_file import write_calibration
from tirelib.estimators.train import train
from tirelib.fmu.build import build_fmu
from tirelib.measured.observations import observe

pytestmark = pytest.mark.speed
READ = 3
"""Frames that a read of the port brings at 625 frames/s."""
HALF_A_CORE = 0.5


@pytest.fixture(scope="module")
def wire() -> list[bytes]:
    run = quantised(synthetic_run(1, load=4500.0, turns=40.0))
    return list(write_script([run], Device(), Faults({})).frames)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fmu")
    campaign = read_campaign(write(folder / "set1", cornering_runs()))
    write_calibration(train(observe([campaign])).calibration, folder / "cal.toml")
    return build_fmu(folder / "cal.toml", folder / "x.fmu", samples_per_step=16)


@pytest.mark.parametrize("batch", [1, READ, 50])
def test_decode(benchmark: BenchmarkFixture, wire: list[bytes], batch: int) -> None:
    """Bytes to strain in line; divide by the frames for the cost of one."""
    reads = [b"".join(wire[i : i + batch]) for i in range(0, len(wire), batch)]

    def decode() -> int:
        decoder, timeline = SerialDecoder(), Timeline(Device())
        return sum(
            len(block.strain)
            for read in reads
            for frames in decoder.push(read)
            for block in timeline.push(frames)
        )

    assert 16 * (len(wire) - 1) < benchmark(decode) <= 16 * len(wire)
    benchmark.extra_info["us_per_frame"] = 1e6 * benchmark.stats.stats.median / len(wire)


def test_whole_chain(benchmark: BenchmarkFixture, wire: list[bytes], fmu: Path) -> None:
    """Decode and step the FMU file; against the time that the samples took."""
    reads = [b"".join(wire[i : i + READ]) for i in range(0, len(wire), READ)]
    duration = 16e-4 * len(wire)
    with FmuFile(read_fmu(fmu)) as file, FmuModel(file) as model:

        def estimate() -> int:
            chain = InProcess(lambda _: model, Conditions.constant(18.0, 2.3e5, 0.0))
            return sum(len(chain.push(read)) for read in reads) + len(chain.finish())

        start = time.process_time()
        assert benchmark.pedantic(estimate, rounds=3) >= 38
        used = (time.process_time() - start) / (3 * duration)
    benchmark.extra_info["share_of_a_core"] = used
    assert used < HALF_A_CORE
