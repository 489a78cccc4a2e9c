"""A scheduler and its workers: those of an address, or a cluster of this machine's processes."""

import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager

import dask.config
from distributed import Client, LocalCluster, WorkerPlugin

from tirelib import __version__
from tirelib.errors import FormatError

CONNECT = 20.0
"""Time in which a scheduler must answer, [s]."""
NO_PROFILER = {"distributed.worker.profile.enabled": False}
"""Dask's profiler keeps call stacks of the last 1,000 seconds in each worker, 0.4 MB a second with
the short tasks of a fleet, and takes part of the processor (``build/fleet_proof.py memory``)."""
PATIENT = {"distributed.deploy.lost-worker-timeout": "1 hour"}
"""Time in which a killed worker of this machine may come back. Dask would give it up for ever after
15 s, and a machine with much else to do starts it later (``build/fleet_proof.py endurance``)."""


class _OnlyTheClientIsInterrupted(WorkerPlugin):
    """A terminal sends `Ctrl-C` to workers as well, which would end with a traceback each."""

    def setup(self, worker: object) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def cluster(address: str | None, workers: int | None) -> Iterator[Client]:
    """Yield a client of a scheduler by address, or of a cluster of this machine's processes.

    Raises
    ------
    FormatError
        If there is no scheduler at the address, or its workers have another version of tirelib.
    """
    if address is None:
        with (
            dask.config.set(NO_PROFILER | PATIENT),
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                silence_logs=logging.ERROR,
            ) as local,
            Client(local) as client,
        ):
            client.register_plugin(_OnlyTheClientIsInterrupted())
            yield client
        return
    try:
        client = Client(address, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise FormatError(
            f"--scheduler {address}: no scheduler answers ({error}); start one with `dask "
            "scheduler`, or leave the option out for a cluster on this machine"
        ) from None
    with client:
        versions = client.run(_version)
        odd = {worker: found for worker, found in versions.items() if found != __version__}
        if odd:
            raise FormatError(
                f"--scheduler {address}: worker {next(iter(odd))} has tirelib "
                f"{next(iter(odd.values()))}, this is {__version__}; all need the same version"
            )
        yield client


def _version() -> str:
    return __version__
