"""Strain tires of the synthetic campaign, loaded once for a file: compiled ones, and Python's."""

from collections.abc import Iterator

import pytest

from tests.fmu import live
from tirelib.fmu.run import LoadedFmu


@pytest.fixture(scope="module", params=[(1, False), (10, False), (10, True)], ids=live.kind)
def fmu(request: pytest.FixtureRequest) -> Iterator[LoadedFmu]:
    samples, python = request.param
    with LoadedFmu(live.fmu_file(samples, python=python)) as loaded:
        yield loaded


@pytest.fixture(scope="module", params=[(10, False), (10, True)], ids=live.kind)
def ten(request: pytest.FixtureRequest) -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(10, python=request.param[1])) as loaded:
        yield loaded


@pytest.fixture(scope="module")
def python_ten() -> Iterator[LoadedFmu]:
    """The one whose Python a test can reach into."""
    with LoadedFmu(live.fmu_file(10, python=True)) as loaded:
        yield loaded
