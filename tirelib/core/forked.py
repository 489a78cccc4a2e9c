"""Calls that do not depend on each other, shared between this process and a copy of it.

Python runs one thread at a time, and effects are functions that no other process can be sent. A
copy of this process (fork) has them already; what it computes comes back through a pipe. Objects
that both processes have come back as the very same objects. Whichever process is free takes the
next call, so that a long one does not keep the others waiting. Where processes cannot be copied,
where there is one processor, or where a result cannot be sent, calls run here, with the same
results.
"""

import io
import os
import pickle
import signal
import warnings
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")
PLACE = np.dtype(np.uint32)
"""Place of a call in the queue, which is a pipe."""


def forked(calls: Sequence[Callable[[], T]], shared: Sequence[object] = ()) -> list[T]:
    """Return what calls return, each computed here or by a copy of this process.

    Parameters
    ----------
    calls : sequence of callable
        Some thousand at most, as the queue is a pipe. They change nothing that others need, and
        write nothing: another thread of this process may hold the terminal while it is copied.
        What they return must not depend on which of them ran before in the same process.
    shared : sequence of object
        That both processes have; they are recognised by identity.

    Raises
    ------
    Exception
        What a call raises.
    """
    if len(calls) < 2 or _processors() < 2 or not hasattr(os, "fork"):
        return [call() for call in calls]
    queue, places = os.pipe()
    os.write(places, np.arange(len(calls), dtype=PLACE).tobytes())
    os.close(places)
    back, out = os.pipe()
    with warnings.catch_warnings():
        # the copy computes and takes no lock that another thread may have held
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        os.close(back)
        _answer(calls, queue, shared, out)
    os.close(out)
    try:
        found = _taken(calls, queue)
        with os.fdopen(back, "rb", closefd=False) as pipe:
            text = pipe.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        os.close(back)
        os.close(queue)
        os.waitpid(child, 0)
    # a copy that was ended from outside leaves nothing
    others: Any = _Reader(io.BytesIO(text), shared).load() if text else {}
    if isinstance(others, BaseException):
        raise others
    found |= others
    return [found[k] if k in found else call() for k, call in enumerate(calls)]


def _taken(calls: Sequence[Callable[[], T]], queue: int) -> dict[int, T]:
    """Return what the calls return whose places this process takes from the queue, by place."""
    found = {}
    while place := os.read(queue, PLACE.itemsize):
        k = int(np.frombuffer(place, PLACE)[0])
        found[k] = calls[k]()
    return found


def _answer(
    calls: Sequence[Callable[[], Any]], queue: int, shared: Sequence[object], out: int
) -> None:
    """Compute in the copy, write the results and end it at once."""
    code = 1
    try:
        try:
            found: Any = _taken(calls, queue)
        except Exception as error:
            found = error
        text = io.BytesIO()
        _Writer(text, shared).dump(found)
        with os.fdopen(out, "wb") as pipe:
            pipe.write(text.getbuffer())
        code = 0
    finally:
        os._exit(code)


def _processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Writer(pickle.Pickler):
    def __init__(self, file: io.BytesIO, shared: Sequence[object]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self.places = {id(each): place for place, each in enumerate(shared)}

    def persistent_id(self, each: object) -> int | None:
        return self.places.get(id(each))


class _Reader(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, shared: Sequence[object]) -> None:
        super().__init__(file)
        self.shared = shared

    def persistent_load(self, place: Any) -> object:
        return self.shared[place]
