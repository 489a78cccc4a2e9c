"""The main job from end to end, as a user would type it: ``make demo``.

The numerical rig measures a virtual tire; its campaigns are checked, calibrated and held against a
day that the calibration has not seen. The calibration becomes an FMU, and runs of that day go over
a serial line to the bench, which must tell the same numbers. Everything lands in
``build/out/demo``.
"""

import argparse
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.rule import Rule

sys.path.insert(0, str(Path(__file__).parent))
from demo_live import (
    PATIENCE,
    RECORDING,
    end_when_played,
    go_live,
    judge,
    require_terminal,
    wait_for_port,
    write_device,
)
from pages.gallery import into_gallery

from tirelib.core.threads import one_thread

if TYPE_CHECKING:
    from pages.live import LiveFiles

    from tirelib.rig.plans import Plan

__all__ = [
    "PATIENCE",
    "ROOT",
    "Steps",
    "end_when_played",
    "judge",
    "require_terminal",
    "wait_for_port",
    "write_device",
]

ROOT = Path(__file__).resolve().parent.parent
PROGRAMS = Path(sys.executable).parent
PLANS = {
    "set1": ("set1", 1, 3),
    "set1-unseen": ("set1", 2, 3),
    "set2": ("set2", 3, 3),
    "brake_drive": ("brake_drive", 4, 0),
    "brake_drive-unseen": ("brake_drive", 5, 0),
    "set3": ("set3", 6, 1),
}
"""Folder of a campaign: the rig's plan, the day (seed), and runs repeated at its end."""
SHORTENED = {"set2": (-15, -12, -8, -6, -4, -2, 0, 2, 4, 6, 9, 12, 15)}
"""Plans of which only these slip angles [deg] are measured: what their figures need."""
CALIBRATED = ("set1", "set2", "brake_drive")
"""Campaigns that the calibration sees, where they exist."""
AT_ONCE = min(2, os.cpu_count() or 1)
"""Commands that run side by side, where they do not need each other."""
ALONE = os.environ | dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)
"""Environment of a command: it computes on one core."""


@dataclass(frozen=True)
class Job:
    """A command to be run beside others.

    `counted` is a folder whose files tell how far the command is, `total` how many it will hold.
    """

    what: str
    words: tuple[str | Path, ...]
    program: str = "tirelib"
    counted: Path | None = None
    total: int | None = None


class Steps:
    """Run commands, show them, and remember them for the page."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.commands: list[tuple[str, str]] = []

    def run(self, what: str, *arguments: str | Path, program: str = "tirelib") -> None:
        """Run a program with arguments; stop the demonstration where it fails."""
        self._announce(what, _shown(program, arguments))
        started = time.monotonic()
        done = subprocess.run(_command(program, arguments), cwd=ROOT, env=ALONE, check=False)
        self._end(program, done.returncode)
        self.console.print(f"[dim]{time.monotonic() - started:.0f} s[/]", highlight=False)

    def together(self, jobs: Sequence[Job]) -> None:
        """Run commands that do not need each other, `AT_ONCE` at a time; show each as it ends."""
        started = time.monotonic()
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
        with (
            TemporaryDirectory() as logs,
            Progress(*columns, TimeElapsedColumn(), console=self.console, transient=True) as bar,
            ThreadPoolExecutor(AT_ONCE) as pool,
        ):
            log = {job.what: Path(logs) / f"{number}.log" for number, job in enumerate(jobs)}
            running = {pool.submit(_watched, bar, job, log[job.what]): job for job in jobs}
            for ended in as_completed(running):
                job = running[ended]
                self._announce(job.what, _shown(job.program, job.words))
                said = log[job.what].read_text(errors="replace").strip()
                self.console.print(said, highlight=False, markup=False, soft_wrap=True)
                if ended.result():
                    pool.shutdown(wait=False, cancel_futures=True)
                self._end(job.program, ended.result())
        self.console.print(f"[dim]{time.monotonic() - started:.0f} s[/]", highlight=False)

    @contextmanager
    def beside(
        self, what: str, *arguments: str | Path, program: str, log: Path
    ) -> Iterator["subprocess.Popen[bytes]"]:
        """Run a program in the background; it must have ended well soon after the block.

        Whatever happens in the block, nothing is left running.
        """
        self._announce(what, f"{_shown(program, arguments)} &")
        with log.open("wb") as file:
            process = subprocess.Popen(
                _command(program, arguments),
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
            )
            try:
                yield process
                try:
                    process.wait(PATIENCE)
                except subprocess.TimeoutExpired:
                    sys.exit(
                        f"Error: {program} still runs {PATIENCE:.0f} s after its reader has left; "
                        f"it should end by itself; see {_short(log)}"
                    )
            finally:
                _stop(process)
        self.console.print(log.read_text(errors="replace").strip(), highlight=False, markup=False)
        self._end(program, process.returncode)

    def _announce(self, what: str, shown: str) -> None:
        self.commands.append((what, shown))
        self.console.print(Rule(what, align="left", style="dim"))
        self.console.print(f"[bold]$ {shown}[/]", highlight=False, soft_wrap=True)

    def _end(self, program: str, code: int) -> None:
        if code:
            self.console.print(f"[bold red]{program} ended with exit code {code}[/]")
            sys.exit(code)


def _watched(bar: Progress, job: Job, log: Path) -> int:
    """Run a command with a line of its own in the bar; return its exit code."""
    task, started = bar.add_task(job.what, total=job.total), time.time()
    with log.open("wb") as file:
        process = subprocess.Popen(
            _command(job.program, job.words),
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            env=ALONE | {"COLUMNS": str(bar.console.width)},
        )
        try:
            while process.poll() is None:
                time.sleep(0.1)
                if job.counted is not None:
                    with suppress(FileNotFoundError):  # a file on its way to its name
                        new = [p.stat().st_mtime >= started for p in job.counted.glob("*")]
                        bar.update(task, completed=sum(new))
        finally:
            _stop(process)
            bar.remove_task(task)
    return process.returncode


def _stop(process: "subprocess.Popen[bytes]") -> None:
    """End a process that still runs, politely first."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _command(program: str, arguments: Sequence[str | Path]) -> list[str]:
    return [str(PROGRAMS / program), *map(str, arguments)]


def _shown(program: str, arguments: Sequence[str | Path]) -> str:
    """Say a command as it is typed at the root of the repository."""
    return shlex.join([program, *(_short(argument) for argument in arguments)])


def _short(argument: str | Path) -> str:
    """Say a path inside the repository relative to its root."""
    if isinstance(argument, Path) and argument.is_absolute() and argument.is_relative_to(ROOT):
        return str(argument.relative_to(ROOT))
    return str(argument)


def measure(steps: Steps, folder: Path, fresh: bool) -> dict[str, Path]:
    """Let the rig measure every campaign that is not there yet."""
    from tirelib.rig.plans import with_repeats

    jobs = []
    for name, (plan, seed, repeats) in PLANS.items():
        target = folder / name
        what = f"Measure {name} on the numerical rig"
        words: tuple[str | Path, ...] = (
            "rig",
            "--plan",
            plan,
            "--seed",
            str(seed),
            "--repeats",
            str(repeats),
            "--jobs",
            "1",
            "--out",
            target,
            "--force",
        )
        program = "tirelib"
        if plan in SHORTENED:
            what += ", some of its slip angles"
            program, words = "python", (ROOT / "build/demo.py", "--measure", name, target)
        if fresh or not (target / "truth.csv").exists():  # the rig writes it last
            runs = len(with_repeats(planned(plan), repeats))
            jobs.append(Job(what, words, program, target / "runs", runs))
        else:
            steps.commands.append((what, _shown(program, words)))
            steps.console.print(f"{name}: measured before, used again (--fresh measures anew)")
    if jobs:
        steps.together(jobs)
    return {name: folder / name for name in PLANS}


def planned(name: str) -> "Plan":
    """Return a plan of the rig with the slip angles that are asked for."""
    from tirelib.rig.plans import Plan, plan

    whole = plan(name)
    if name not in SHORTENED:
        return whole
    angles = SHORTENED[name]
    kept = tuple(c for c in whole.conditions if round(np.rad2deg(c.slip_angle)) in angles)
    return Plan(whole.name, f"{whole.about}, {len(kept)} of its runs", kept)


def measure_shortened(name: str, target: Path) -> None:
    """Measure the runs of a plan whose slip angles are asked for."""
    from tirelib.rig.campaign import run_plan
    from tirelib.rig.tire import tire

    plan, seed, repeats = PLANS[name]
    truths = run_plan(
        planned(plan), tire("reference"), target, seed=seed, repeats=repeats, jobs=1, overwrite=True
    )
    said = f"{len(truths)} runs of {plan} in {_short(target)} (axes iso, seed {seed})"
    Console().print(said, highlight=False, soft_wrap=True)


def ready(folder: Path) -> dict[str, Path]:
    """Return the campaigns of a folder by name."""
    found = {name: folder / name for name in PLANS if (folder / name / "campaign.toml").exists()}
    missing = [name for name in ("set1", "set1-unseen") if name not in found]
    if missing:
        sys.exit(
            f"Error: {folder}: no campaign {', '.join(missing)}; allowed are {', '.join(PLANS)}, "
            "of which set1 and set1-unseen are needed; put the folders there"
        )
    return found


def main() -> None:
    """Run the demonstration."""
    parser = argparse.ArgumentParser(description="The main job from end to end.")
    parser.add_argument("--fresh", action="store_true", help="measure again what is there")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/demo", metavar="DIR")
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help=f"use ready campaigns in folders named {', '.join(PLANS)} instead of the rig",
    )
    parser.add_argument("--gallery", action="store_true", help="renew docs/theory/gallery")
    parser.add_argument("--no-live", action="store_true", help="leave out FMU and serial line")
    parser.add_argument(
        "--measure",
        nargs=2,
        metavar=("NAME", "DIR"),
        help=f"only measure a shortened plan ({', '.join(SHORTENED)}) into a folder",
    )
    given = parser.parse_args()
    if given.measure:
        measure_shortened(given.measure[0], Path(given.measure[1]).resolve())
        return
    if not given.no_live:
        require_terminal()
    console, started = Console(), time.monotonic()
    steps, out = Steps(console), given.out.resolve()
    data = ready(given.data.resolve()) if given.data else measure(steps, out / "data", given.fresh)
    calibration, fmu = out / "calibration.toml", out / "StrainTire.fmu"
    seen = [data[name] for name in CALIBRATED if name in data]
    steps.together(
        [
            Job(
                "Calibrate",
                ("calibrate", *seen, "--out", calibration, "--report", out / "calibration"),
            ),
            *(Job(f"Check {name}", ("campaign", "check", folder)) for name, folder in data.items()),
            Job(
                "Read the features of every turn",
                ("features", data["set1"], "--out", out / "features.parquet"),
            ),
        ]
    )
    unseen = [name for name in data if name.endswith("-unseen")]
    jobs = [
        Job(
            f"Estimate {name}",
            (
                "estimate",
                data[name],
                "--calibration",
                calibration,
                "--json",
                out / f"{name}.json",
                "--report",
                out / name,
            ),
        )
        for name in unseen
    ]
    if not given.no_live:
        jobs.append(
            Job(
                "Build the FMU",
                (
                    "fmu",
                    "build",
                    "--calibration",
                    calibration,
                    "--out",
                    fmu,
                    "--samples-per-step",
                    "16",
                ),
            )
        )
    steps.together(jobs)
    reports = [
        ("calibration", "calibration/index.html"),
        *((f"estimates of {name}", f"{name}/index.html") for name in unseen),
    ]
    live = None
    if not given.no_live:
        day = data["set1-unseen"]
        live = go_live(steps, out, day, fmu, out / "set1-unseen.json")
        record = live.live.with_name(RECORDING)
        steps.together(
            [
                Job(
                    "Estimate set1-unseen with the FMU",
                    ("fmu", "run", fmu, day, "--json", live.fmu),
                ),
                Job(
                    "Replay the recording",
                    ("run", "--replay", record, "--fmu", fmu, "--json", live.replay, "--no-page"),
                    "tirebench",
                ),
            ]
        )
    page = draw(console, out, data, calibration, live, steps, reports)
    if given.gallery:
        into_gallery(out / "figures")
    console.print(Rule(f"done in {time.monotonic() - started:.0f} s", style="green"))
    for title, file in [("everything", page), *((t, out / f) for t, f in reports)]:
        console.print(f"open  {_short(Path(file))}   ({title})", highlight=False, soft_wrap=True)
    if live is not None:
        judge(console, live, data["set1-unseen"])


def draw(
    console: Console,
    out: Path,
    data: dict[str, Path],
    calibration: Path,
    live: "LiveFiles | None",
    steps: Steps,
    reports: list[tuple[str, str]],
) -> Path:
    """Draw every figure of chapter 4 and the live strip, and write the page."""
    from pages.demo import write_demo_page

    from tirelib.estimators.calibration_file import read_calibration

    console.print(Rule("Draw the figures of chapter 4", align="left", style="dim"))
    with console.status("drawing") as status:
        return write_demo_page(
            out,
            data,
            read_calibration(calibration),
            live=live,
            commands=steps.commands,
            reports=reports,
            progress=status.update,
        )


if __name__ == "__main__":
    with one_thread():
        main()
