"""Strain tires of the synthetic campaign, loaded once for a file."""

from collections.abc import Iterator

import pytest

from tests.fmu import live
from tirelib.fmu.run import LoadedFmu


@pytest.fixture(scope="module", params=[1, 10])
def fmu(request: pytest.FixtureRequest) -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(request.param)) as loaded:
        yield loaded


@pytest.fixture(scope="module")
def ten() -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(10)) as loaded:
        yield loaded
