"""Shared by all tests: data outside the repository, one random seed per test."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "default", deadline=None, suppress_health_check=[HealthCheck.too_slow], max_examples=40
)
settings.load_profile("default")
os.environ["TIRELIB_CACHE"] = "off"  # no ensemble of an earlier version, none left behind


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Measurement campaigns beside the repository, where there are any."""
    folder = Path(os.environ.get("TIRELIB_SHARED_DATA", Path(__file__).parents[2] / "shared/data"))
    if not folder.is_dir():
        pytest.skip(f"no measurement campaigns at {folder} (set TIRELIB_SHARED_DATA)")
    return folder
