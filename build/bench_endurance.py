"""Endurance of the bench: ten minutes at full rate, a cable in and out, processes that are killed.

``make endurance``, or ``python build/bench_endurance.py --part plug --cycles 20``. The programs run
as a user starts them and are measured from outside. Results land in ``build/out/bench-endurance``;
a part that is not run keeps its last result.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from bench_demo import ready_fmu
from bench_limits import show
from bench_page import address_of, fetch, launched
from bench_processes import Listener, Meter, alive, end, roles
from demo import PROGRAMS, ROOT, Steps
from rich.console import Console

from tirebench.recording.recording import Recording
from tirelib.core.threads import one_thread

OUT = ROOT / "build/out/bench-endurance"
LINES = {"serial, 1 wheel": ("serial", 1), "slcan FD, 4 wheels": ("RAW16", 4)}
"""What is on the line: format and wheels, each at 10 kHz."""
MANOEUVRE = """format = "tirebench-manoeuvre/1"
tire = "reference"
[[point]]
t_s = 0.0
load_N = 4800.0
speed_kmh = 65.0
[[point]]
t_s = {seconds:.1f}
load_N = 4800.0
speed_kmh = 65.0
"""
AWAY = ((0.8, 0.4), (0.2, 3.0))
"""Share of the cycles and how long the cable is out in them, [s]."""
PLUGGED = 1.5
"""How long the cable is in, [s]."""
PATIENCE = 120.0
LEAVE = 20.0  # [s] for what a run has started to end after it was killed
CHRT = ("chrt", "--rr", "5")
"""Real-time priority for a wheel; a run asks for it itself."""
LOST = ("lost_frames", "lost_samples", "crc_bad", "framing_bad", "overruns", "gaps", "resets")


@dataclass
class Bench:
    """Starts programs in a folder, at real-time priority if asked; whatever is left is ended."""

    out: Path
    fmu: Path
    realtime: bool = False
    started: list["subprocess.Popen[bytes]"] = field(default_factory=list)

    def start(self, log: str, *arguments: object) -> "subprocess.Popen[bytes]":
        """Start ``tirebench`` with its output in a file."""
        before = CHRT if self.realtime and arguments[0] == "emulate" else ()
        with (self.out / log).open("wb") as file:
            process = subprocess.Popen(
                [*before, str(PROGRAMS / "tirebench"), *map(str, arguments)],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        self.started.append(process)
        return process

    def run(self, log: str, port: object, record: Path, *more: object) -> Any:
        """Start ``tirebench run`` on a port."""
        return self.start(
            log,
            "run",
            "--port",
            port,
            "--fmu",
            self.fmu,
            "--trust",
            "--speed",
            65,
            "--pressure",
            2.3,
            "--camber",
            0,
            "--record",
            record,
            *(("--realtime",) if self.realtime else ()),
            *more,
        )

    def emulate(self, port_file: str, seconds: float, *more: object) -> tuple[Any, str]:
        """Start a wheel that rolls straight ahead; return it and its port."""
        file, manoeuvre = self.out / port_file, self.out / "straight.toml"
        file.unlink(missing_ok=True)
        manoeuvre.write_text(MANOEUVRE.format(seconds=seconds), encoding="utf-8")
        wheel = self.start(
            "emulate.log",
            "emulate",
            "--manoeuvre",
            manoeuvre,
            "--port-file",
            file,
            "--wait",
            600,
            *more,
        )
        wait(
            file.exists, f"the port of {file}", wheel, PATIENCE + seconds
        )  # the tape is made first
        return wheel, file.read_text().strip()

    def close(self) -> None:
        """End whatever still runs."""
        for process in self.started:
            if process.poll() is None:
                process.kill()
                process.wait()


def wait(
    true: Callable[[], bool], what: str, process: Any = None, patience: float = PATIENCE
) -> float:
    """Wait until something holds; return how long it took. Stop where it does not come."""
    start = time.monotonic()
    while not true():
        gone = process is not None and process.poll() is not None
        if gone or time.monotonic() - start > patience:
            sys.exit(
                f"Error: endurance: {what}: waited {patience:.0f} s or the program ended; "
                "it should come; see the logs"
            )
        time.sleep(0.005)
    return time.monotonic() - start


@contextmanager
def viewer(url: str) -> Iterator[str]:
    """Keep the page open in a headless browser, where there is one; give its name."""
    try:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as playwright:
            browser = launched(playwright)
            browser.new_page().goto(url)
            yield f"Chromium {browser.version}"
            browser.close()
    except ImportError:
        yield "none"


def hold(bench: Bench, name: str, minutes: float) -> dict[str, Any]:
    """Run a line at full rate for so many minutes with its page open; measure from outside."""
    kind, wheels = LINES[name]
    stem = f"{kind}-{wheels}".lower()
    record, document = bench.out / f"{stem}.mcap", bench.out / f"{stem}.json"
    record.unlink(missing_ok=True)
    numbers = [word for wheel in range(wheels) for word in ("--wheel", wheel)]
    sent = bench.out / "sent.json"
    emulator, port = bench.emulate(
        "port", 60.0 * minutes, "--format", kind, *numbers, "--json", sent
    )
    port = port if kind == "serial" else f"slcan:{port}"
    rates = () if kind == "serial" else ("--data-bitrate", 5_000_000)
    listener = Listener()
    run = bench.run(
        f"{stem}.log",
        port,
        record,
        *rates,
        *numbers,
        "--json",
        document,
        "--silence",
        3,
        "--plotjuggler",
        listener.port,
    )
    log = bench.out / f"{stem}.log"
    url = address_of(log, run)
    listener.wait_after(0.0, PATIENCE)
    meter = Meter(run.pid)
    meter.look()
    begun = time.monotonic(), meter.cpu
    with viewer(url) as browser:
        while run.poll() is None and emulator.poll() is None:
            meter.look()
            time.sleep(1.0)
        lasted, cpu = time.monotonic() - begun[0], meter.cpu - begun[1]
    run.wait(PATIENCE)
    emulator.wait(PATIENCE)
    listener.close()
    seen, told = json.loads(document.read_text()), json.loads(sent.read_text())
    said = log.read_text()
    found = re.search(r"median ([\d.]+) ms, 99 % ([\d.]+) ms", said)
    ages = [moment - ready for moment, _, ready in listener.turns]
    above = 1e3 * (np.array(ages) - min(ages)) if ages else np.array([np.nan])
    tenth = max(1, len(meter.memory) // 10)
    return {
        "line": name,
        "minutes": minutes,
        "browser": browser,
        "frames_sent": told["frames"],
        "unheard": told["unheard"],
        "emulator_late_ms": 1e3 * told["late_s"],
        "frames": seen["line"]["frames"],
        "lost": {key: seen["line"][key] for key in LOST},
        "skipped": re.findall(r".*(?:skipped|started again).*", said)[-3:],
        "turns": len(seen["turns"]),
        "valid": sum(turn["valid"] for turn in seen["turns"]),
        "p50_ms": float(found[1]) if found else None,
        "p99_ms": float(found[2]) if found else None,
        "spread_p50_ms": float(np.median(above)),
        "spread_p99_ms": float(np.percentile(above, 99)),
        "cpu_per_second": cpu / lasted,
        "memory_MB": [
            float(np.median(part)) / 2**20
            for part in (meter.memory[tenth : 2 * tenth + 1], meter.memory[-tenth:])
        ],
        "load_average": float(np.mean(meter.loads)),
    }


def plug(bench: Bench, cycles: int) -> dict[str, Any]:
    """Pull the cable and plug it in, again and again; how long until bytes come."""
    back: list[float] = []
    events = {"reconnects": 0, "cycles": 0}
    for share, away in AWAY:
        count = round(share * cycles)
        record, link = bench.out / f"plug-{away:g}.mcap", bench.out / "cable"
        for old in (record, link):
            old.unlink(missing_ok=True)
        emulator, _ = bench.emulate(
            "port", 20.0, "--loop", "--link", link, "--unplug", PLUGGED, "--replug", away
        )
        run = bench.run("plug.log", link, record, "--no-page", "--json", bench.out / "plug.json")
        wait(lambda r=record: r.exists() and r.stat().st_size > 50_000, "first bytes", run)
        plugged, there = [], True
        while len(plugged) < count and run.poll() is None:
            now = link.is_symlink()
            if now and not there:
                plugged.append(time.monotonic())
            there = now
            time.sleep(0.002)
        time.sleep(2.5)
        end(run)
        end(emulator)
        arrivals = raw_arrivals([record])
        for moment in plugged:
            later = arrivals[np.searchsorted(arrivals, moment) :]
            back.append(float(later[0] - moment) if len(later) else float("inf"))
        line = json.loads((bench.out / "plug.json").read_text())["line"]
        events["reconnects"] += line["reconnects"]
        events["cycles"] += len(plugged)
    return {
        **events,
        "back_p50_s": float(np.median(back)),
        "back_max_s": float(max(back)),
        "not_back": sum(not np.isfinite(x) for x in back),
        "load_average": os.getloadavg()[0],
    }


def raw_arrivals(files: list[Path]) -> np.ndarray:
    """Return when bytes arrived that stand in recordings, [s] on `time.monotonic`."""
    moments = []
    for file in files:
        recording = Recording(file)
        moments += [1e-9 * arrival for arrival, _ in recording.raw()]
        recording.close()
    return np.sort(np.array(moments))


def kill(bench: Bench, kills: int) -> dict[str, Any]:
    """Kill one process of a run after the other; what is lost, and when all is back."""
    listener, done = Listener(), []
    emulator, port = bench.emulate("port", 60.0, "--loop")
    number, run, url = 0, None, ""
    while len(done) < kills:
        if run is None or run.poll() is not None:
            number += 1
            record = bench.out / f"kill-{number}.mcap"
            for old in bench.out.glob(f"kill-{number}*.mcap"):
                old.unlink()
            begun = time.monotonic()
            run = bench.run("kill.log", port, record, "--plotjuggler", listener.port)
            url = address_of(bench.out / "kill.log", run)
            first = listener.wait_after(begun, PATIENCE)
            if done and done[-1]["role"] == "run":
                done[-1]["back_s"] = None if first is None else first - begun
            wait(lambda r=run: len(roles(r.pid)) > 1, "processes of a run", run)
        here = roles(run.pid)
        order = [
            role for role in ("reader", "estimator", "recorder", "page", "run") if role in here
        ]
        time.sleep(2.0)
        done.append(strike(run, order[len(done) % len(order)], here, record, listener, url))
    end(run)
    end(emulator)
    listener.close()
    lost = after(bench, done)
    return {
        "kills": done,
        "processes": sorted({one["role"] for one in done}),
        "readable": lost["readable"],
        "lost_max_s": max(one["lost_s"] for one in done),
        "back_max_s": max(one["back_s"] or 0.0 for one in done),
        "not_back": sum(one["back_s"] is None for one in done[:-1]),
        "load_average": os.getloadavg()[0],
    }


def strike(
    run: Any, role: str, here: dict[str, int], record: Path, listener: Listener, url: str
) -> dict[str, Any]:
    """Kill one process and wait until the run does again what it did."""
    moment = time.monotonic()
    os.kill(here[role], signal.SIGKILL)
    one: dict[str, Any] = {"role": role, "moment": moment, "file": record.name, "back_s": None}
    if role == "run":
        run.wait(PATIENCE)
        one["all_gone_s"] = gone(set(here.values()) - {run.pid})
        return one
    wait(lambda: roles(run.pid).get(role, here[role]) != here[role], f"another {role}", run)
    if role == "page":
        fetch(url)
        one["back_s"] = time.monotonic() - moment
    elif role == "recorder":
        size = recorded(record)
        wait(lambda: recorded(record) > size, "more bytes of the recording", run)
        one["back_s"] = time.monotonic() - moment
    else:
        first = listener.wait_after(moment + 0.3, PATIENCE)
        one["back_s"] = None if first is None else first - moment
    return one


def gone(left: set[int]) -> float | None:
    """Wait until processes have ended; return how long it took. Those that do not are killed."""
    start = time.monotonic()
    while any(map(alive, left)):
        if time.monotonic() - start > LEAVE:
            for pid in filter(alive, left):
                os.kill(pid, signal.SIGKILL)
            return None
        time.sleep(0.01)
    return time.monotonic() - start


def recorded(record: Path) -> int:
    """Return the size of a recording and of what goes on with it, [bytes]."""
    return sum(file.stat().st_size for file in record.parent.glob(f"{record.stem}*.mcap"))


def after(bench: Bench, done: list[dict[str, Any]]) -> dict[str, Any]:
    """Read the recordings again; add to each kill the longest time without bytes around it."""
    files = sorted(bench.out.glob("kill-*.mcap"))
    readable = {}
    for file in files:
        recording = Recording(file)
        readable[file.name] = sum(len(data) for _, data in recording.raw()) > 0
        recording.close()
    ends = [one["moment"] for one in done[1:]] + [np.inf]
    for one, following in zip(done, ends, strict=True):
        arrivals = raw_arrivals(
            [file for file in files if file.stem.startswith(Path(one["file"]).stem)]
        )
        if one["role"] == "run":  # nothing comes after it: what is missing before
            before = arrivals[arrivals <= one["moment"] + 1.0]
            one["lost_s"] = max(0.0, one["moment"] - float(before[-1]))
            continue
        begins = arrivals[:-1]
        near = (begins > one["moment"] - 1.0) & (begins < following)
        one["lost_s"] = float(np.diff(arrivals)[near].max()) if near.any() else float("inf")
        if one["role"] == "reader":  # turns still come of what it had read
            one["back_s"] = one["lost_s"]
    return {"readable": readable}


def main() -> None:
    """Run the parts that are asked for, store and show; fail if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", action="append", choices=("line", "plug", "kill"))
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--cycles", type=int, default=100)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--line", action="append", choices=tuple(LINES))
    parser.add_argument(
        "--realtime", action="store_true", help="at real-time priority, on a busy machine"
    )
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR")
    given = parser.parse_args()
    out, console = given.out.resolve(), Console()
    out.mkdir(parents=True, exist_ok=True)
    parts = given.part or ["line", "plug", "kill"]
    file = out / "endurance.json"
    results: dict[str, Any] = {}
    with ExitStack() as stack:
        bench = Bench(out, ready_fmu(Steps(console), out)[0], given.realtime)
        stack.callback(bench.close)
        jobs: dict[str, Callable[[], dict[str, Any]]] = {}
        if "line" in parts:
            for name in given.line or LINES:
                jobs[name] = lambda name=name: hold(bench, name, given.minutes)
        if "plug" in parts:
            jobs["plug"] = lambda: plug(bench, given.cycles)
        if "kill" in parts:
            jobs["kill"] = lambda: kill(bench, given.kills)
        for name, job in jobs.items():
            with console.status(name):
                results = {**(json.loads(file.read_text()) if file.exists() else {}), name: job()}
            file.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if show(results, set(jobs), console) else 1)


if __name__ == "__main__":
    with one_thread():
        main()
