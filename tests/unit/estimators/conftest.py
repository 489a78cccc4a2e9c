"""Observations of a made-up tire, made once."""

import numpy as np
import pytest

from tests import trained as cornering_tire
from tests.synthetic import cornering_runs, synthetic_run, write
from tirelib.campaign import Campaign, read_campaign
from tirelib.estimators.train import Trained
from tirelib.measured.observations import Observations


@pytest.fixture(scope="session")
def cornering() -> Campaign:
    return read_campaign(cornering_tire.campaign_folder())


@pytest.fixture(scope="session")
def another_day(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return read_campaign(write(tmp_path_factory.mktemp("c") / "day2", cornering_runs(seed=7)))


@pytest.fixture(scope="session")
def pressures(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    runs = [
        synthetic_run(i, load=load, pressure=pressure, kind="free")
        for i, (load, pressure) in enumerate(
            (load, pressure)
            for load in (2500.0, 4500.0, 6500.0)
            for pressure in (1.7e5, 2.0e5, 2.3e5, 2.6e5)
        )
    ]
    return read_campaign(write(tmp_path_factory.mktemp("c") / "pressures", runs))


@pytest.fixture(scope="session")
def braking(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    slips = np.array([-0.3, -0.1, -0.05, -0.02, 0.0, 0.02, 0.05, 0.1, 0.3])
    runs = [
        synthetic_run(
            i,
            load=4500.0,
            slip_ratio=float(k),
            kind="free" if k == 0 else "brake" if k < 0 else "drive",
        )
        for i, k in enumerate(slips)
    ]
    return read_campaign(write(tmp_path_factory.mktemp("c") / "braking", runs))


@pytest.fixture(scope="session")
def observed() -> Observations:
    return cornering_tire.observed_and_trained()[0]


@pytest.fixture(scope="session")
def trained() -> Trained:
    return cornering_tire.observed_and_trained()[1]
