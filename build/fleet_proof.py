"""Measure a fleet: throughput by workers, memory by number and by length, the scheduler's limit.

    python build/fleet_proof.py recording --hours 0.1 2
    python build/fleet_proof.py memory --counts 10 100 1000
    python build/fleet_proof.py scheduler --counts 10000
    python build/fleet_proof.py workers --counts 60
    python build/fleet_proof.py endurance --minutes 10

Each prints one line of numbers a case; docs/howto/fleet.md holds them. Campaigns and recordings
are of the tests' made-up tire. On a machine that others use, wall times say little: each line gives
the processor time of the workers too.
"""

import argparse
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from threading import Thread

import numpy as np
import psutil
from distributed import Client
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.fleet.recordings import describe, write_drive
from tests.synthetic import cornering_runs, synthetic_run, write
from tirelib.campaign import read_campaign
from tirelib.cli.fleet import run_verb
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration_file import write_calibration
from tirelib.estimators.train import train
from tirelib.fleet import engine, work
from tirelib.fleet.cluster import cluster
from tirelib.fleet.dataset import DataSet
from tirelib.fleet.recipes import recipe_of
from tirelib.fleet.sources import Source, find_sources
from tirelib.measured.observations import observe

ROOT = Path(__file__).parents[1]
SAY = Console(highlight=False, soft_wrap=True).print
PEAK = """
import resource, sys
from tirelib.cli.fleet import run_verb
code, said = run_verb(sys.argv[1:])
own = resource.getrusage(resource.RUSAGE_SELF)
print(said.splitlines()[0])
print(f"peak {own.ru_maxrss / 1024:.0f} MiB, {own.ru_utime + own.ru_stime:.1f} s of processor")
"""


def main() -> None:
    """Run the measurement that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "what", choices=("recording", "memory", "scheduler", "workers", "endurance")
    )
    parser.add_argument("--hours", type=float, nargs="+", default=(0.1, 2.0))
    parser.add_argument("--counts", type=int, nargs="+", default=(10, 100, 1000))
    parser.add_argument("--minutes", type=float, default=10.0)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fleet-proof-") as name:
        folder = Path(name)
        if chosen.what == "recording":
            recording(folder, chosen.hours)
        elif chosen.what == "memory":
            memory(folder, chosen.counts)
        elif chosen.what == "scheduler":
            scheduler(folder, chosen.counts)
        elif chosen.what == "workers":
            workers(folder, chosen.counts[0])
        else:
            endurance(folder, chosen.minutes)


def calibration(folder: Path) -> Path:
    """Return a calibration of the made-up tire."""
    write(folder / "calibration", cornering_runs())
    path = folder / "cal.toml"
    trained = train(observe([read_campaign(folder / "calibration")]))
    write_calibration(trained.calibration, path, {})
    return path


def recording(folder: Path, hours: Sequence[float]) -> None:
    """Peak memory of `tirelib estimate` over the length of a recording of two wheels."""
    known = calibration(folder)
    for length in hours:
        drive = describe(folder / f"drive-{length}", ("FL", "FR"))
        write_drive(
            drive / "a.mf4",
            seconds=3600.0 * length,
            wheels=("FL", "FR"),
            loads=(4000.0, 5000.0),
            gaps=[(40.0, 40.01), (100.0, 110.0)],
        )
        size = (drive / "a.mf4").stat().st_size / 2**20
        table = drive / "turns.parquet"
        command = ["estimate", str(drive), "--calibration", str(known), "--out", str(table)]
        done = subprocess.run(
            [sys.executable, "-c", PEAK, *command], capture_output=True, text=True, cwd=ROOT
        )
        if done.returncode:
            raise SystemExit(done.stderr)
        SAY(f"{length} h, {size:.0f} MiB of recording: {'; '.join(done.stdout.splitlines())}")
        shutil.rmtree(drive)


def campaigns(folder: Path, count: int) -> Path:
    """Write campaigns of one short run: the same samples, each with a name of its own."""
    target = folder / "campaigns"
    first = folder / "first"
    if not first.exists():
        write(first, [synthetic_run(1, turns=3.2)])
    header = (first / "campaign.toml").read_text()
    for number in range(count):
        place = target / f"{number:06d}"
        if place.exists():
            continue
        (place / "runs").mkdir(parents=True)
        (place / "campaign.toml").write_text(header.replace("synthetic", f"day {number}"))
        os.link(first / "runs.csv", place / "runs.csv")
        for run in (first / "runs").iterdir():
            os.link(run, place / "runs" / run.name)
    return target


class Peak(Thread):
    """Watch the memory of this process and of the workers."""

    def __init__(self, client: Client) -> None:
        super().__init__(daemon=True)
        self._pids = [os.getpid(), *client.run(os.getpid).values()]
        self.peak = [0] * len(self._pids)
        self.going = True

    def run(self) -> None:
        """Look twice a second."""
        while self.going:
            for k, pid in enumerate(self._pids):
                self.peak[k] = max(self.peak[k], psutil.Process(pid).memory_info().rss)
            time.sleep(0.5)


def _check(sources: list[Source], out: Path, client: Client) -> engine.Counts:
    data = DataSet(str(out))
    data.open()
    recipe = recipe_of("check", data, files={})
    return engine.run(sources, data, recipe, client, run_verb)


def memory(folder: Path, counts: Sequence[int]) -> None:
    """Peak memory of client with scheduler, and of a worker, over the number of campaigns."""
    for count in counts:
        paths = campaigns(folder, count)
        with cluster(None, 2) as client:
            watch = Peak(client)
            watch.start()
            began = time.monotonic()
            counts = _check(find_sources([str(paths)]), folder / f"out-{count}", client)
            wall = time.monotonic() - began
            watch.going = False
        peaks = ", ".join(f"{peak / 2**20:.0f}" for peak in watch.peak)
        SAY(
            f"{count} campaigns, {counts.done} done in {wall:.0f} s: peak memory of client with "
            f"scheduler and of each worker {peaks} MiB"
        )


def light(
    source: Source, mark: str, recipe: work.Recipe, address: str, verb: work.Verb
) -> work.Outcome:
    """Return an outcome of one row without any work."""
    container = work.container_of(recipe, mark)
    row = {
        "container_id": container,
        "name": source.url,
        "fingerprint": mark,
        "tirelib": "",
        "recipe": recipe.hash,
    }
    return work.Outcome(container, "", {"container_metrics": [row]})


def scheduler(folder: Path, counts: Sequence[int]) -> None:
    """Tasks a second when a task itself takes no time: client, scheduler, and adding the rows."""
    engine.process = light
    engine.fingerprint = lambda source: source.url
    for count in counts:
        sources = [Source(f"/nowhere/{k:06d}", True) for k in range(count)]
        with cluster(None, 2) as client:
            workers_before, before, began = _processor(client), _spent(), time.monotonic()
            counts = _check(sources, folder / f"out-{count}", client)
            wall, own = time.monotonic() - began, _spent() - before
            theirs = _processor(client) - workers_before
        SAY(
            f"{count} tasks, {counts.done} done in {wall:.0f} s ({count / wall:.0f} a second): "
            f"client with scheduler {1e3 * own / count:.2f} ms of processor a task, workers "
            f"{1e3 * theirs / count:.2f} ms"
        )


def _spent() -> float:
    own = resource.getrusage(resource.RUSAGE_SELF)
    return own.ru_utime + own.ru_stime


def _processor(client: Client) -> float:
    return float(sum(client.run(_spent).values()))


def workers(folder: Path, count: int) -> None:
    """Throughput with one worker and with two in turns, by the clock and as processor time."""
    known = calibration(folder)
    paths = campaigns(folder, count)
    walls: dict[int, list[float]] = {1: [], 2: []}
    for number in (1, 2, 2, 1, 1, 2):
        out = folder / f"out-{number}-{time.monotonic_ns()}"
        with cluster(None, number) as client:
            data = DataSet(str(out))
            data.open()
            recipe = recipe_of("estimate", data, files={"calibration": str(known)})
            first = ["estimate", str(paths / "000000"), "--calibration", str(known)]
            client.run(run_verb, first)  # every worker has its imports behind it
            before, own, began = _processor(client), _spent(), time.monotonic()
            counts = engine.run(find_sources([str(paths)]), data, recipe, client, run_verb)
            wall, spent = time.monotonic() - began, _processor(client) - before
            own = _spent() - own
        walls[number].append(wall)
        SAY(
            f"{number} worker(s): {counts.done} done in {wall:.1f} s, {counts.done / wall:.2f} a "
            f"second; {1e3 * spent / counts.done:.0f} ms of processor a task, client with "
            f"scheduler {1e3 * own / counts.done:.1f} ms; load {os.getloadavg()[0]:.1f}"
        )
    one, two = (float(np.median(walls[number])) for number in (1, 2))
    SAY(f"parallel efficiency of two workers, by the clock: {one / (2.0 * two):.0%}")


def endurance(folder: Path, minutes: float) -> None:
    """Kill a worker every ten seconds; in the end everything is there once."""
    paths = campaigns(folder, 400)
    until, kills, rounds = time.monotonic() + 60.0 * minutes, 0, 0
    while time.monotonic() < until:
        out = folder / f"out-{rounds}"
        with cluster(None, 2) as client:
            last = time.monotonic()

            def kill(counts: engine.Counts, client: Client = client) -> None:
                nonlocal last, kills
                if time.monotonic() - last > 10.0:
                    last, kills = time.monotonic(), kills + 1
                    os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)

            data = DataSet(str(out))
            data.open()
            recipe = recipe_of("check", data, files={})
            engine.run(find_sources([str(paths)]), data, recipe, client, run_verb, report=kill)
        found = data.table("container_metrics")["container_id"].to_pylist()
        rounds += 1
        SAY(
            f"round {rounds}: {kills} kills so far; {len(set(found))} of 400 campaigns, "
            f"{len(found) - len(set(found))} twice"
        )


if __name__ == "__main__":
    with one_thread():
        main()
