"""The part of the demonstration that goes over a serial line: wheel, port, bench.

Nothing here depends on how fast the machine is: the wheel sends when the bench is ready, the bench
skips no turn, and it ends when it has read all that the wheel sent.
"""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.rule import Rule

if TYPE_CHECKING:
    from demo import Steps
    from pages.live import LiveFiles

    from tirelib.campaign import RunPlan

LIVE_ANGLES = (-3.0, 4.0, 0.0, -5.0, 2.0, -4.0)
"""Slip angles [deg] of the runs that go over the line, the loads growing from one to the next."""
RECORDING = "live.mcap"
PATIENCE = 600.0
"""How long a program in the background gets to begin or to end on a busy machine, [s]."""
A_TURN = r"\n +\d+ +\d+ +[\d.]+ "
"""A line that `tirebench run` prints of a turn: wheel, run, time."""
PLAYED = "\nplayed: "
"""What `tirebench emulate` says when its reader has taken all of it."""
NO_TERMINAL = (
    "Error: make demo: this platform has no pseudo-terminal ({reason}); the part with the serial "
    "line needs one, as Linux and macOS have; run it there, or leave that part out with --no-live"
)


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


def go_live(steps: "Steps", out: Path, data: Path, fmu: Path, library: Path) -> "LiveFiles":
    """Send runs of a campaign over a serial line to the bench, which steps the FMU and records."""
    from pages.live import LiveFiles

    from tirelib.campaign import read_campaign

    folder = out / "live"
    folder.mkdir(parents=True, exist_ok=True)
    files = LiveFiles(
        library,
        out / "fmu.json",
        folder / "live.json",
        folder / "replay.json",
        folder / "conditions.json",
        folder / "device.toml",
    )
    port_file, go, record = folder / "port", folder / "go", folder / RECORDING
    said, sent = folder / "run.log", folder / "emulate.log"
    for old in (port_file, go, record, files.fmu, files.live, files.replay, files.conditions):
        old.unlink(missing_ok=True)
    campaign = read_campaign(data)
    write_device(files.device, campaign.header.gage_lateral)
    runs = [word for run in choose_runs(campaign.plans) for word in ("--run", str(run))]
    with steps.beside(
        "Play runs of it as a wheel on a serial port, in the background",
        *("emulate", "--campaign", data, *runs, "--device", files.device),
        *("--port-file", port_file, "--conditions", files.conditions, "--after", go),
        *("--wait", f"{PATIENCE:.0f}"),
        program="tirebench",
        log=sent,
    ) as wheel:
        port = wait_for_port(port_file, wheel, sent)
        with (
            steps.beside(
                "Read the port, step the FMU, record",
                *("run", "--port", port, "--fmu", fmu, "--conditions", files.conditions),
                *("--device", files.device, "--record", record, "--json", files.live),
                *("--every-turn", "--no-page"),
                program="tirebench",
                log=said,
            ) as run,
            steps.console.status("starting") as status,
        ):
            go.touch()
            end_when_played(run, said, wheel, sent, status.update)
    return files


def end_when_played(
    run: "subprocess.Popen[bytes]",
    said: Path,
    wheel: "subprocess.Popen[bytes]",
    sent: Path,
    show: Callable[[str], None],
) -> None:
    """Let a run go on until it has read all that the wheel sent, then end it as Ctrl-C does.

    Parameters
    ----------
    run, wheel : Popen
    said, sent : Path
        Their logs.
    show : callable
        Gets the newest line of the run.
    """
    asked, before, end = False, "", time.monotonic() + PATIENCE
    while run.poll() is None:
        text = said.read_text(errors="replace")
        newest = "".join(text.rstrip().splitlines()[-1:]).strip()
        show(newest)
        if newest != before:
            before, end = newest, time.monotonic() + PATIENCE
        over = wheel.poll() is not None or PLAYED in sent.read_text(errors="replace")
        if over and not asked and re.search(A_TURN, text):
            run.send_signal(signal.SIGINT)
            asked = True
        if time.monotonic() > end:
            sys.exit(f"Error: tirebench run: nothing new for {PATIENCE:.0f} s; it said:\n{text}")
        time.sleep(0.1)


def write_device(file: Path, lateral: Sequence[float]) -> None:
    """Write a device file whose count is the rig's own step of strain, so that nothing is lost."""
    from tirelib.rig.measure import MeasuringChain

    step = 2.0 * MeasuringChain().gage_range / 2 ** MeasuringChain().gage_bits
    file.write_text(
        'format = "tirebench-device/1"\nname = "numerical rig"\n\n'
        f"[gages]\nlateral_m = {[float(y) for y in lateral]}\n\n"
        f"[scale]\nstrain_per_count = {step!r}  # {MeasuringChain().gage_bits} bit over "
        f"+-{1e6 * MeasuringChain().gage_range:.0f} microstrain\n",
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
                f"should write {file}; it said:\n{log.read_text(errors='replace')}"
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
    from pages.live import find_faults

    from tirelib.campaign import read_campaign

    faults = find_faults(live, read_campaign(data))
    if faults:
        console.print(Rule("NOT EQUAL: library, FMU and bench differ", style="bold red"))
        for fault in faults:
            console.print(fault, style="bold red", highlight=False, markup=False, soft_wrap=True)
        sys.exit(1)
    console.print("[green]library = FMU = bench[/]: see the section Live", highlight=False)
