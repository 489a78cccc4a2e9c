"""One thread for the array libraries: theirs cost more than they bring with matrices of this size.

BLAS starts a thread for each processor and lets it wait in a loop for its part of every product.
On a machine that has other work the parts come late, and the waiting takes the processor from
whoever could finish them.

A program of ours bounds its libraries at its start, through the environment, which reaches
libraries that are loaded later and processes that are started (`bound_process`). A function that a
user's program calls bounds them while it runs (`one_thread`), and leaves everything as it was.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from threadpoolctl import LibController, ThreadpoolController

VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
"""What the libraries read when they are loaded."""


def bound_process() -> None:
    """Let this process and all that it starts use one thread; call it before numpy is imported."""
    os.environ.update(dict.fromkeys(VARIABLES, "1"))


@contextmanager
def one_thread() -> Iterator[None]:
    """Bound the libraries' threads for a while; also a decorator.

    Examples
    --------
    >>> import numpy as np
    >>> from threadpoolctl import threadpool_info
    >>> with one_thread():
    ...     {pool["num_threads"] for pool in threadpool_info()}
    {1}
    """
    changed = []
    try:
        for pool in _pools(len(sys.modules)):
            before = pool.get_num_threads()
            if before is not None and before > 1:
                changed.append((pool, before))
                pool.set_num_threads(1)
        yield
    finally:
        for pool, before in changed:
            pool.set_num_threads(before)


@lru_cache(maxsize=1)
def _pools(modules: int) -> list[LibController]:
    """Return the libraries that have threads; searched again when modules were imported."""
    return list(ThreadpoolController().lib_controllers)
