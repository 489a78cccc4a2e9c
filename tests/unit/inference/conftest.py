"""Shared by the tests of the inference: each computes in its own process."""

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def one_processor() -> Iterator[None]:
    """Let no test copy its process, which costs more than most of these problems.

    The chain's tests and those of hidden effects compute in copies, as users do.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tirelib.core.forked._processors", lambda: 1)
        yield
