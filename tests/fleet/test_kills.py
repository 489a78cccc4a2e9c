"""Kill -9 of worker, scheduler and client: the same command goes on, and nothing is there twice."""

import json
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="the extra tirelib[fleet] is not installed")

import dask.config
from distributed import Client, Future, LocalCluster
from distributed.comm.core import CommClosedError
from distributed.core import Status

from tests.synthetic import synthetic_run, write
from tirelib.cli.fleet import run_verb
from tirelib.core.errors import FormatError
from tirelib.fleet import cluster, engine
from tirelib.fleet.dataset import DataSet
from tirelib.fleet.engine import Counts, SchedulerLostError
from tirelib.fleet.recipes import recipe_of
from tirelib.fleet.sources import find_sources

COUNT = 6
PATIENCE = 300.0
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Campaigns of one short run."""
    folder = tmp_path_factory.mktemp("many")
    for day in range(COUNT):
        write(folder / f"day-{day}", [synthetic_run(1, turns=2.2, seed=day)], name=f"day {day}")
    return folder


def run(many: Path, out: Path, client: Client, report: object = None) -> Counts:
    data = DataSet(str(out))
    data.open()
    recipe = recipe_of("check", data, files={})
    said = report or (lambda counts: None)
    return engine.run(find_sources([str(many)]), data, recipe, client, run_verb, report=said)  # type: ignore[arg-type]


def finished(out: Path) -> list[int]:
    return list(DataSet(str(out)).table("container_metrics")["container_id"].to_pylist())


def test_a_killed_worker_loses_nothing(many: Path, tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(counts: Counts) -> None:
        if counts.done and not killed:
            killed.extend(client.run(os.getpid).values())
            os.kill(killed[0], signal.SIGKILL)

    with (
        LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",
            silence_logs=50,
        ) as local,
        Client(local) as client,
    ):
        counts = run(many, tmp_path / "out", client, kill)
    assert killed
    assert (counts.done, counts.failed) == (COUNT, 0)
    assert len(set(finished(tmp_path / "out"))) == len(finished(tmp_path / "out")) == COUNT


@contextmanager
def scheduler(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler and a worker as processes of their own; yields address and scheduler."""
    file = folder / f"{time.monotonic_ns()}.json"
    log = (folder / "log").open("ab")
    dask = [sys.executable, "-m", "dask"]
    also = ["--scheduler-file", str(file), "--no-dashboard"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    told = {"stdout": log, "stderr": log, "env": environment, "cwd": folder}
    first = subprocess.Popen([*dask, "scheduler", "--port", "0", *also], **told)  # type: ignore[call-overload]
    worker = subprocess.Popen([*dask, "worker", "--nthreads", "1", "--no-nanny", *also], **told)  # type: ignore[call-overload]
    try:
        until = time.monotonic() + PATIENCE
        while not file.exists() or not file.read_text().strip():
            assert time.monotonic() < until, (folder / "log").read_text()
            time.sleep(0.2)
        yield json.loads(file.read_text())["address"], first
    finally:
        for process in (worker, first):
            process.kill()
            process.wait()
        log.close()


def test_a_killed_scheduler_and_then_the_same_again(
    many: Path, tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, handler = tmp_path / "out", logging.StreamHandler()
    monkeypatch.setattr(logging.getLogger("distributed"), "handlers", [handler])
    with scheduler(tmp_path) as (address, process):

        def kill(counts: Counts) -> None:
            if counts.done:
                process.kill()

        with cluster.cluster(address, None) as first:
            assert handler.level == logging.CRITICAL, "Dask would say it with tracebacks"
            first.wait_for_workers(1, timeout=PATIENCE)
            with pytest.raises(SchedulerLostError, match="the scheduler went away"):
                run(many, out, first, kill)
    assert 0 < len(finished(out)) < COUNT
    counts = run(many, out, client)
    assert counts.failed == 0
    assert len(set(finished(out))) == len(finished(out)) == COUNT


def test_a_scheduler_that_goes_while_a_result_is_on_its_way_is_lost(
    many: Path, tmp_path: Path, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(*_: object, **__: object) -> None:
        raise CommClosedError("ConnectionPool.gather: Connection reset by peer")

    monkeypatch.setattr(Future, "result", cut)
    with pytest.raises(SchedulerLostError, match="the scheduler went away"):
        run(many, tmp_path / "out", client)


def test_a_killed_client_and_then_the_same_again(
    many: Path, tmp_path: Path, client: Client
) -> None:
    out = tmp_path / "out"
    program = [sys.executable, "-m", "tirelib", "fleet", "check", str(many), "--out", str(out)]
    with (tmp_path / "log").open("wb") as log:
        process = subprocess.Popen(
            [*program, "--workers", "1"], cwd=ROOT, stdout=log, stderr=log, start_new_session=True
        )
        until = time.monotonic() + PATIENCE
        while not any(out.glob("documents/check/*.json")):
            assert time.monotonic() < until
            assert process.poll() is None, (tmp_path / "log").read_text()
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)  # the client and the cluster in it
        process.wait()
    counts = run(many, out, client)
    assert counts.failed == 0
    assert len(set(finished(out))) == len(finished(out)) == COUNT


@pytest.fixture(scope="module")
def own() -> Iterator[Client]:
    """A cluster of this machine; Dask by itself would give up a worker that starts slowly again."""
    with (
        dask.config.set({"distributed.deploy.lost-worker-timeout": "0s"}),
        cluster.cluster(None, 1) as client,
    ):
        yield client


def test_a_worker_keeps_no_call_stacks_of_what_it_did(own: Client) -> None:
    """The profiler of Dask would let it grow by the second."""

    def stacks(dask_worker: object) -> tuple[bool, int]:
        callbacks = dask_worker.periodic_callbacks  # type: ignore[attr-defined]
        return "profile" in callbacks, len(dask_worker.io_loop.profile)  # type: ignore[attr-defined]

    (found,) = own.run(stacks).values()
    assert found == (False, 0)


def test_an_interrupt_ends_no_worker_and_a_killed_one_that_starts_slowly_is_not_given_up(
    own: Client,
) -> None:
    (first,) = own.run(os.getpid).values()
    os.kill(first, signal.SIGINT)
    assert own.submit(os.getpid, pure=False).result(timeout=PATIENCE) == first
    os.kill(first, signal.SIGKILL)
    second = own.submit(os.getpid, pure=False).result(timeout=PATIENCE)
    assert second != first
    os.kill(second, signal.SIGINT)
    assert own.submit(os.getpid, pure=False).result(timeout=PATIENCE) == second


def test_an_interrupt_while_the_cluster_starts_ends_it_when_it_is_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[LocalCluster] = []

    def start(**given: object) -> LocalCluster:
        os.kill(os.getpid(), signal.SIGINT)
        started.append(LocalCluster(**given))
        return started[0]

    monkeypatch.setattr(cluster, "LocalCluster", start)
    # a shell that starts the tests in the background has it ignored
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), cluster.cluster(None, 1):
            pytest.fail("the interrupt was lost")
    finally:
        signal.signal(signal.SIGINT, before)
    assert started[0].status is Status.closed


def test_no_scheduler_at_the_address_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT", 0.5)
    with (
        pytest.raises(FormatError, match="no scheduler answers"),
        cluster.cluster("tcp://127.0.0.1:9", None),
    ):
        pass
