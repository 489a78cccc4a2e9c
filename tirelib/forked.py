"""Calls that do not depend on each other, shared between this process and a copy of it.

Python runs one thread at a time, and effects are functions that no other process can be sent. A
copy of this process (fork) has them already; what it computes comes back through a pipe. Objects
that both processes have come back as the very same objects. Where processes cannot be copied, where
there is one processor, or where a result cannot be sent, calls run here, with the same results.
"""

import io
import os
import pickle
import signal
import warnings
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

T = TypeVar("T")


def forked(calls: Sequence[Callable[[], T]], shared: Sequence[object] = ()) -> list[T]:
    """Return what calls return, every other one computed by a copy of this process.

    Parameters
    ----------
    calls : sequence of callable
        They change nothing that others need, and write nothing: another thread of this process may
        hold the terminal while it is copied.
    shared : sequence of object
        That both processes have; they are recognised by identity.

    Raises
    ------
    Exception
        What a call raises.
    """
    if len(calls) < 2 or _processors() < 2 or not hasattr(os, "fork"):
        return [call() for call in calls]
    back, out = os.pipe()
    with warnings.catch_warnings():
        # the copy computes and takes no lock that another thread may have held
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        os.close(back)
        _answer(calls[1::2], shared, out)
    os.close(out)
    try:
        own = [call() for call in calls[::2]]
        with os.fdopen(back, "rb", closefd=False) as pipe:
            text = pipe.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        os.close(back)
        os.waitpid(child, 0)
    # a copy that was ended from outside leaves nothing
    others: Any = _Reader(io.BytesIO(text), shared).load() if text else [c() for c in calls[1::2]]
    if isinstance(others, BaseException):
        raise others
    results: list[T] = [*own, *others]
    results[::2], results[1::2] = own, others
    return results


def _answer(calls: Sequence[Callable[[], Any]], shared: Sequence[object], out: int) -> None:
    """Compute in the copy, write the results and end it at once."""
    code = 1
    try:
        try:
            found: Any = [call() for call in calls]
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
