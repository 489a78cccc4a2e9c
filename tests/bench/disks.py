"""A disk with room for little."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

ROOM = 4096
"""What a file may have, [bytes]."""


@contextmanager
def little_room() -> Iterator[None]:
    """Let this process write no file longer than `ROOM`; the system refuses what is beyond."""
    resource = pytest.importorskip("resource", reason="this system limits no files")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
