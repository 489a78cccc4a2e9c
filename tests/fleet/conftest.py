"""A calibration and a few tiny campaigns of a made-up tire; a cluster in this process."""

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="the extra tirelib[fleet] is not installed")

from distributed import Client, LocalCluster

from tests.synthetic import synthetic_run, write
from tests.trained import observed_and_trained
from tirelib.estimators.calibration_file import write_calibration


@pytest.fixture(scope="session")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibration") / "cal.toml"
    write_calibration(observed_and_trained()[1].calibration, path, {})
    return path


@pytest.fixture(scope="session")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three campaigns of two runs, and one whose header is of another format."""
    folder = tmp_path_factory.mktemp("campaigns")
    for day in range(3):
        runs = [
            synthetic_run(1, load=3000.0, slip_angle=0.02, seed=day),
            synthetic_run(2, load=5000.0, slip_angle=-0.02, seed=day),
        ]
        write(folder / "north" / f"day-{day}", runs, name=f"day {day}")
    (folder / "broken").mkdir()
    (folder / "broken" / "campaign.toml").write_text('format = "tirelib-campaign/99"\n')
    return folder


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    """One worker in this process."""
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0"
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
