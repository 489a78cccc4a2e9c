"""The core is compiled once."""

import ctypes

import pytest

from tests.native.core import compiled


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled(tmp_path_factory.mktemp("core"))
