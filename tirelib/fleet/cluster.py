"""A scheduler and its workers: those of an address, or a cluster of this machine's processes."""

import logging
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker

import dask.config
from distributed import Client, LocalCluster
from distributed.utils import silence_logging_cmgr

from tirelib.core.errors import FormatError
from tirelib.core.version import __version__

CONNECT = 20.0
"""Time in which a scheduler must answer, [s]: one that is started at the same moment answers after
0.5 s as a program of this machine (five starts, 0.44 to 0.48 s) and after 2 s in a container. Half
of it is still five times that; with double, a wrong address costs 40 s before it is said."""
NO_PROFILER = {"distributed.worker.profile.enabled": False}
"""Dask's profiler keeps call stacks of the last 1,000 seconds in each worker, 0.4 MB a second with
the short tasks of a fleet, and takes part of the processor (``build/fleet_proof.py memory``)."""
PATIENT = {"distributed.deploy.lost-worker-timeout": "1 hour"}
"""Time in which a killed worker of this machine may come back. Dask would give it up for ever after
15 s, and a machine with much else to do starts it later (``build/fleet_proof.py endurance``)."""
QUIET = {"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"}
"""Workers of this machine print nothing of their own. What goes wrong in a task is its outcome; the
rest is a heartbeat that fails, with a traceback, when the cluster closes while one is under way."""


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Let `Ctrl-C` wait for the end of the block: half a cluster cannot be closed.

    A terminal sends it to every process in it. A thread hands the signals that it blocks on to the
    threads and processes that it starts, so a loop that starts in here blocks it for good, and so
    do the workers that the loop starts, now or when it replaces one. Python's tracker of resources
    comes first, because its start would unblock the signal again. Other threads of this process
    may still take it; hence the handler.
    """
    waiting: list[int] = []
    resource_tracker.ensure_running()
    handler = signal.signal(signal.SIGINT, lambda number, _: waiting.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(signal.SIGINT, handler)
    if waiting and callable(handler):
        handler(signal.SIGINT, None)


@contextmanager
def cluster(address: str | None, workers: int | None) -> Iterator[Client]:
    """Yield a client of a scheduler by address, or of a cluster of this machine's processes.

    Raises
    ------
    FormatError
        If there is no scheduler at the address, or its workers have another version of tirelib.
    """
    if address is None:
        with dask.config.set(NO_PROFILER | PATIENT | QUIET), ExitStack() as stack:
            with _interrupts_wait():
                local = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    silence_logs=logging.ERROR,
                )
                stack.callback(_closed, local)
                client = Client(local)
                stack.callback(_closed, client)
            yield client
        return
    with silence_logging_cmgr(logging.CRITICAL):  # that a scheduler went away is said by the engine
        yield from _clients(address)


def _clients(address: str) -> Iterator[Client]:
    """Yield a client of the scheduler at the address."""
    try:
        client = Client(address, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise FormatError(
            f"--scheduler {address}: no scheduler answers ({error}); give the address that `dask "
            "scheduler` prints, tcp://HOST:PORT, or leave the option out for one on this machine"
        ) from None
    with client:
        try:
            versions = client.run(_version)
        except Exception as error:  # whatever an environment of somebody else's raises
            raise FormatError(
                f"--scheduler {address}: a worker cannot run tirelib ({error}); install tirelib "
                f"{__version__} with the extra fleet where the workers start"
            ) from None
        odd = {worker: found for worker, found in versions.items() if found != __version__}
        if odd:
            raise FormatError(
                f"--scheduler {address}: worker {next(iter(odd))} has tirelib "
                f"{next(iter(odd.values()))}, this is {__version__}; all need the same version"
            )
        yield client


def _closed(part: LocalCluster | Client) -> None:
    with _interrupts_wait():
        part.close()


def _version() -> str:
    return __version__
