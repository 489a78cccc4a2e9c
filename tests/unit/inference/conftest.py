"""Shared by the tests of the inference: each computes in its own process."""

import pytest


@pytest.fixture(scope="module", autouse=True)
def in_one_process(one_processor: None) -> None:
    """Use `one_processor` in every module."""
