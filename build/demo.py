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
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.rule import Rule

if TYPE_CHECKING:
    from tirelib.campaign import RunPlan
    from tirelib.report.live import LiveFiles

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
LIVE_ANGLES = (-3.0, 4.0, 0.0, -5.0, 2.0, -4.0)
"""Slip angles [deg] of the runs that go over the line, the loads growing from one to the next."""
PATIENCE = 30.0
"""How long a program in the background gets to begin or to end, [s]."""
NO_TERMINAL = (
    "Error: make demo: this platform has no pseudo-terminal ({reason}); the part with the serial "
    "line needs one, as Linux and macOS have; run it there, or leave that part out with --no-live"
)


class Steps:
    """Run commands one after the other, show them, and remember them for the page."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.commands: list[tuple[str, str]] = []

    def run(self, what: str, *arguments: str | Path, program: str = "tirelib") -> None:
        """Run a program with arguments; stop the demonstration where it fails."""
        self._announce(what, _shown(program, arguments))
        started = time.monotonic()
        done = subprocess.run(_command(program, arguments), cwd=ROOT, check=False)
        self._end(program, done.returncode)
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
                _command(program, arguments), cwd=ROOT, stdin=subprocess.DEVNULL, stdout=file,
                stderr=subprocess.STDOUT,
            )  # fmt: skip
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
    data = {}
    for name, (plan, seed, repeats) in PLANS.items():
        target = folder / name
        what = f"Measure {name} on the numerical rig"
        words: tuple[str | Path, ...] = (
            "rig", "--plan", plan, "--seed", str(seed), "--repeats", str(repeats),
            "--out", target, "--force",
        )  # fmt: skip
        program = "tirelib"
        if plan in SHORTENED:
            what += ", some of its slip angles"
            program, words = "python", (ROOT / "build/demo.py", "--measure", name, target)
        if fresh or not (target / "truth.csv").exists():  # the rig writes it last
            steps.run(what, *words, program=program)
        else:
            steps.commands.append((what, _shown(program, words)))
            steps.console.print(f"{name}: measured before, used again (--fresh measures anew)")
        data[name] = target
    return data


def measure_shortened(name: str, target: Path) -> None:
    """Measure the runs of a plan whose slip angles are asked for."""
    from bench.rig.campaign import run_plan
    from bench.rig.plans import Plan, plan
    from bench.rig.tire import tire

    plan_name, seed, repeats = PLANS[name]
    whole = plan(plan_name)
    angles = SHORTENED[plan_name]
    kept = tuple(c for c in whole.conditions if round(np.rad2deg(c.slip_angle)) in angles)
    short = Plan(whole.name, f"{whole.about}, {len(kept)} of its runs", kept)
    truths = run_plan(short, tire("reference"), target, seed=seed, repeats=repeats, jobs=2,
                      overwrite=True)  # fmt: skip
    said = f"{len(truths)} runs of {plan_name} in {_short(target)} (axes iso, seed {seed})"
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


def choose_runs(plans: "Sequence[RunPlan]") -> list[int]:
    """Return runs over all loads, each nearest to its own slip angle."""
    straight = [plan for plan in plans if not plan.camber and not plan.slip_ratio]
    loads = sorted({plan.load for plan in straight})
    chosen: dict[int, None] = {}
    places = np.linspace(0, len(loads) - 1, len(LIVE_ANGLES)).round().astype(int)
    for place, angle in zip(places, LIVE_ANGLES, strict=True):
        left = [p for p in straight if p.load == loads[place] and p.run not in chosen]
        if left:
            chosen[min(left, key=lambda p: abs(np.rad2deg(p.slip_angle) - angle)).run] = None
    return list(chosen)


def go_live(steps: Steps, out: Path, data: Path, calibration: Path, library: Path) -> "LiveFiles":
    """Calibration to FMU, runs of a campaign over a serial line to the bench, and once more."""
    from tirelib.campaign import read_campaign
    from tirelib.report.live import LiveFiles

    fmu, folder = out / "StrainTire.fmu", out / "live"
    folder.mkdir(parents=True, exist_ok=True)
    files = LiveFiles(library, out / "fmu.json", folder / "live.json", folder / "replay.json",
                      folder / "conditions.json", folder / "device.toml")  # fmt: skip
    port_file, record = folder / "port", folder / "live.mcap"
    for old in (port_file, record, files.fmu, files.live, files.replay, files.conditions):
        old.unlink(missing_ok=True)
    campaign = read_campaign(data)
    write_device(files.device, campaign.header.gage_lateral)
    runs = [word for run in choose_runs(campaign.plans) for word in ("--run", str(run))]
    steps.run("Build the FMU", "fmu", "build", "--calibration", calibration, "--out", fmu,
              "--samples-per-step", "16")  # fmt: skip
    steps.run("Estimate set1-unseen with the FMU", "fmu", "run", fmu, data, "--json", files.fmu)
    with steps.beside(
        "Play runs of it as a wheel on a serial port, in the background",
        *("emulate", "--campaign", data, *runs, "--device", files.device),
        *("--port-file", port_file, "--conditions", files.conditions),
        program="tirebench", log=folder / "emulate.log",
    ) as wheel:  # fmt: skip
        port = wait_for_port(port_file, wheel, folder / "emulate.log")
        steps.run(
            "Read the port, step the FMU, record",
            *("run", "--port", port, "--fmu", fmu, "--conditions", files.conditions),
            *("--device", files.device, "--record", record, "--json", files.live),
            *("--silence", "1", "--no-page"),
            program="tirebench",
        )
    steps.run("Replay the recording", "run", "--replay", record, "--fmu", fmu, "--json",
              files.replay, "--no-page", program="tirebench")  # fmt: skip
    return files


def write_device(file: Path, lateral: Sequence[float]) -> None:
    """Write a device file whose count is the rig's own step of strain, so that nothing is lost."""
    from bench.rig.measure import Chain

    step = 2.0 * Chain().gage_range / 2 ** Chain().gage_bits
    file.write_text(
        'format = "tirebench-device/1"\nname = "numerical rig"\n\n'
        f"[gages]\nlateral_m = {[float(y) for y in lateral]}\n\n"
        f"[scale]\nstrain_per_count = {step!r}  # {Chain().gage_bits} bit over "
        f"+-{1e6 * Chain().gage_range:.0f} microstrain\n",
        encoding="utf-8",
    )


def wait_for_port(file: Path, wheel: "subprocess.Popen[bytes]", log: Path) -> str:
    """Return the port that the emulator announces; stop where it does not."""
    end = time.monotonic() + PATIENCE
    while not file.exists():
        if wheel.poll() is not None or time.monotonic() > end:
            how = "still runs" if wheel.poll() is None else f"ended with {wheel.returncode}"
            sys.exit(
                f"Error: tirebench emulate: no port after {PATIENCE:.0f} s at most, it {how}; it "
                f"should write {_short(file)}; it said:\n{log.read_text(errors='replace')}"
            )
        time.sleep(0.05)
    return file.read_text(encoding="utf-8").strip()


def require_terminal() -> None:
    """Stop with a message where there is no pseudo-terminal."""
    try:
        for end in os.openpty():
            os.close(end)
    except (AttributeError, OSError) as error:
        sys.exit(NO_TERMINAL.format(reason=str(error)))


def judge(console: Console, live: "LiveFiles", data: Path) -> None:
    """Stop loudly if library, FMU and bench do not tell the same numbers."""
    from tirelib.campaign import read_campaign
    from tirelib.report.live import find_faults

    faults = find_faults(live, read_campaign(data))
    if faults:
        console.print(Rule("NOT EQUAL: library, FMU and bench differ", style="bold red"))
        for fault in faults:
            console.print(fault, style="bold red", highlight=False, markup=False, soft_wrap=True)
        sys.exit(1)
    console.print("[green]library = FMU = bench[/]: see the section Live", highlight=False)


def main() -> None:
    """Run the demonstration."""
    parser = argparse.ArgumentParser(description="The main job from end to end.")
    parser.add_argument("--fresh", action="store_true", help="measure again what is there")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/demo", metavar="DIR")
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help=f"use ready campaigns in folders named {', '.join(PLANS)} instead of the rig",
    )  # fmt: skip
    parser.add_argument("--no-live", action="store_true", help="leave out FMU and serial line")
    parser.add_argument(
        "--measure", nargs=2, metavar=("NAME", "DIR"),
        help=f"only measure a shortened plan ({', '.join(SHORTENED)}) into a folder",
    )  # fmt: skip
    given = parser.parse_args()
    if given.measure:
        measure_shortened(given.measure[0], Path(given.measure[1]).resolve())
        return
    if not given.no_live:
        require_terminal()
    console, started = Console(), time.monotonic()
    steps, out = Steps(console), given.out.resolve()
    data = ready(given.data.resolve()) if given.data else measure(steps, out / "data", given.fresh)
    for name, folder in data.items():
        steps.run(f"Check {name}", "campaign", "check", folder)
    steps.run("Read the features of every turn", "features", data["set1"], "--out",
              out / "features.parquet")  # fmt: skip
    calibration = out / "calibration.toml"
    steps.run(
        "Calibrate",
        "calibrate",
        *[data[name] for name in CALIBRATED if name in data],
        "--out",
        calibration,
        "--report",
        out / "calibration",
    )
    reports = [("calibration", "calibration/index.html")]
    for name in [name for name in data if name.endswith("-unseen")]:
        steps.run(
            f"Estimate {name}",
            *("estimate", data[name], "--calibration", calibration),
            *("--json", out / f"{name}.json", "--report", out / name),
        )
        reports.append((f"estimates of {name}", f"{name}/index.html"))
    live = None
    if not given.no_live:
        live = go_live(steps, out, data["set1-unseen"], calibration, out / "set1-unseen.json")
    page = draw(console, out, data, calibration, live, steps, reports)
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
    from tirelib.estimators.calibration_file import read_calibration
    from tirelib.report.demo import write_demo_page

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
    main()
