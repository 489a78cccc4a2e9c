"""The core is compiled once."""

import ctypes

import pytest

from tests.native.core import compiled, loaded
from tests.once import once


@pytest.fixture(scope="session")
def core() -> ctypes.CDLL:
    return loaded(once("core", compiled))
