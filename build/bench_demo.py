"""The bench from end to end, as a user would type it: ``make bench-demo``.

A day on the numerical rig calibrates the estimator and identifies a model. Runs of the next day go
from the emulator through a pseudo-terminal to `tirebench run`, which steps the FMU, records, and
shows the live page. The recording is replayed, exported as a campaign, and that campaign is checked
and held against the model. Everything lands in ``build/out/bench-demo``; nothing is drawn from an
earlier start but the two days of the rig.
"""

import argparse
import os
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bench_page import Look, Seen, address_of
from demo import (
    PATIENCE,
    ROOT,
    Steps,
    end_when_played,
    judge,
    require_terminal,
    wait_for_port,
    write_device,
)
from rich.console import Console
from rich.rule import Rule

from tirelib.core.threads import one_thread

if TYPE_CHECKING:
    from pages.live import LiveFiles

    from tirelib.rig.plans import Plan

DAYS = {"calibrated": (11, 5.1), "played": (12, 15.1)}
"""Campaign: the day (seed), and turns of the wheel in each run."""
ESTIMATES = ("library", "fmu", "live", "replay")
LOOKED = 0.5
"""Share of the runs after which the picture of the live page is taken."""


def plan(name: str) -> "Plan":
    """Return what the rig measures on a day: a calibration, or runs to be played.

    The played day has every straight load twice: without repeats no noise is known, and
    `tirelib compare` would have nothing to say.
    """
    from tirelib.rig.plans import BAR, DEG, KMH, REFERENCE_LOAD, Plan
    from tirelib.rig.tire import Condition

    def at(percent: float, angle: float = 0.0, slip: float | None = None) -> Condition:
        load = REFERENCE_LOAD * percent / 100.0
        return Condition(load, 2.3 * BAR, 65.0 * KMH, angle * DEG, 0.0, slip)

    if name == "calibrated":
        grid = [at(p, a) for p in (50, 75, 100, 125, 150) for a in (-2, 0, 2, 4, -4)]
        slips = [at(100, 0.0, s) for s in (-0.03, -0.01, 0.01, 0.03)]
        return Plan("bench-demo", "5 loads x 5 slip angles, 4 slip ratios", (*grid, *slips), 4)
    straight = [at(p) for p in (70, 100, 130)]
    others = [at(100, -3.0), at(130, 1.5), at(100, 3.0), at(100, 0.0, -0.01)]
    return Plan(
        "bench-demo-live", "3 loads twice, 3 slip angles, braking", (*straight, *others, *straight)
    )


def measure(name: str, target: Path) -> None:
    """Let the rig measure one day."""
    from tirelib.rig.campaign import run_plan
    from tirelib.rig.measure import MeasuringChain
    from tirelib.rig.tire import tire

    (seed, turns), day, console = DAYS[name], plan(name), Console()
    with console.status("solving the rig") as status:
        truths = run_plan(
            day,
            tire("reference"),
            target,
            seed=seed,
            jobs=2,
            chain=MeasuringChain(turns=turns),
            overwrite=True,
            progress=lambda done, all_: status.update(f"run {done} of {all_}"),
        )
    console.print(
        f"{len(truths)} runs in {name}: {day.about} (axes iso, day {seed})", highlight=False
    )


def campaigns(steps: Steps, out: Path, data: Path | None, fresh: bool) -> dict[str, Path]:
    """Return the campaigns, measured where they are not there yet."""
    found = {name: (out / "data" if data is None else data) / name for name in DAYS}
    for name, folder in found.items():
        if data is not None:
            if not (folder / "campaign.toml").exists():
                sys.exit(
                    f"Error: {data}: no campaign {name}; {', '.join(DAYS)} are needed; put "
                    "the folders there"
                )
        elif fresh or not (folder / "truth.csv").exists():  # the rig writes it last
            steps.run(
                f"Measure the day '{name}' on the numerical rig",
                ROOT / "build/bench_demo.py",
                "--measure",
                name,
                folder,
                program="python",
            )
        else:
            steps.console.print(f"{name}: measured before, used again (--fresh measures anew)")
    return found


def prepare(steps: Steps, out: Path, day: Path, model: str | None) -> tuple[Path, Path | str]:
    """Calibrate, build the FMU, identify a model; return the FMU and the model."""
    calibration, fmu = out / "calibration.toml", out / "StrainTire.fmu"
    steps.run("Calibrate", "calibrate", day, "--quick", "--out", calibration)
    steps.run(
        "Build the FMU",
        "fmu",
        "build",
        "--calibration",
        calibration,
        "--out",
        fmu,
        "--samples-per-step",
        "16",
    )
    if model is not None:
        return fmu, model
    steps.run("Identify a model from the same day", "identify", day, "--out", out / "model.toml")
    return fmu, out / "model.toml"


def ready_fmu(steps: Steps, out: Path, samples: int = 16) -> tuple[Path, Path]:
    """Return an FMU of so many samples a step, and the played day, for other proofs.

    The days are measured where they are missing.
    """
    demo = ROOT / "build/out/bench-demo"
    days = campaigns(steps, demo, None, fresh=False)
    calibration, fmu = out / "calibration.toml", out / "StrainTire.fmu"
    if not calibration.exists():
        steps.run("Calibrate", "calibrate", days["calibrated"], "--quick", "--out", calibration)
    steps.run(
        "Build the FMU",
        "fmu",
        "build",
        "--calibration",
        calibration,
        "--out",
        fmu,
        "--samples-per-step",
        str(samples),
    )
    return fmu, days["played"]


def play(
    steps: Steps, out: Path, day: Path, fmu: Path, look: Look, pace: float
) -> tuple["LiveFiles", Seen]:
    """Play a day over the serial line to the bench while somebody looks at its page.

    The day begins when the page is open, and the bench ends when it has read all of it.
    """
    from pages.live import LiveFiles

    from tirelib.campaign import read_campaign

    library, fmu_run, live, replay = (out / f"{name}.json" for name in ESTIMATES)
    files = LiveFiles(library, fmu_run, live, replay, out / "conditions.json", out / "device.toml")
    campaign = read_campaign(day)
    write_device(files.device, campaign.header.gage_lateral)
    port_file, go, said, sent = out / "port", out / "go", out / "run.log", out / "emulate.log"
    with steps.beside(
        "Play the day as a wheel on a serial port, in the background",
        *("emulate", "--campaign", day, "--all", "--device", files.device),
        *("--port-file", port_file, "--conditions", files.conditions, "--speedup", f"{pace:g}"),
        *("--after", go, "--wait", f"{PATIENCE:.0f}"),
        program="tirebench",
        log=sent,
    ) as wheel:
        port = wait_for_port(port_file, wheel, sent)
        with (
            steps.beside(
                "Read the port, step the FMU, record, show the live page",
                *("run", "--port", port, "--fmu", fmu, "--conditions", files.conditions),
                *("--device", files.device, "--record", out / "live.mcap", "--json", files.live),
                "--every-turn",
                program="tirebench",
                log=said,
            ) as run,
            steps.console.status("starting") as status,
        ):
            url = address_of(said, run)
            seen = look(url, LOOKED * turns_of(day), status.update, go.touch)
            end_when_played(run, said, wheel, sent, status.update)
    steps.console.print(f"{seen.words}", highlight=False, markup=False, soft_wrap=True)
    return files, seen


def turns_of(day: Path) -> float:
    """Return how many estimates a campaign will give, about."""
    from tirelib.campaign import read_campaign

    found = read_campaign(day)
    seconds = sum(run.strain.shape[1] / run.rate for run in map(found.load, found.plans))
    return 8.0 * seconds - 2.0 * len(found.plans)  # 65 km/h are 9 turns a second


def use(steps: Steps, out: Path, fmu: Path, files: "LiveFiles", model: Path | str) -> None:
    """Replay and export the recording, and do with the campaign what one does with campaigns."""
    record, exported = out / "live.mcap", out / "exported"
    calibration = out / "calibration.toml"
    steps.run(
        "Replay the recording",
        "replay",
        record,
        "--fmu",
        fmu,
        "--json",
        files.replay,
        program="tirebench",
    )
    steps.run(
        "Export it as a campaign (MDF4)", "export", record, "--out", exported, program="tirebench"
    )
    steps.run("Check the campaign", "campaign", "check", exported)
    steps.run(
        "Estimate it with the library",
        "estimate",
        exported,
        "--calibration",
        calibration,
        "--json",
        files.direct,
    )
    steps.run("Estimate it with the FMU", "fmu", "run", fmu, exported, "--json", files.fmu)
    steps.run(
        "Where does the model fail?",
        "compare",
        exported,
        "--model",
        model,
        "--out",
        out / "compared",
    )


def draw(steps: Steps, out: Path, day: Path, files: "LiveFiles", seen: Seen) -> Path:
    """Write the page of the demonstration."""
    from pages import DEMO
    from pages.live import live_drawing, live_table, live_text, read_line

    from tirelib.campaign import read_campaign
    from tirelib.estimators.calibration_file import read_calibration
    from tirelib.measured.signal import LowPass
    from tirelib.report.page import Part, Picture, draw_all, write_page

    campaign, calibration = read_campaign(day), read_calibration(out / "calibration.toml")
    line = read_line(files, campaign)
    drawing = live_drawing(files, campaign, LowPass(calibration.order, calibration.cut_off))
    sections = [
        Part(
            "Line",
            "live",
            live_text(line),
            [live_table(files, line)],
            pictures=draw_all(out, [drawing]),
        ),
        Part(
            "Live page",
            "page",
            seen.words,
            pictures=[
                Picture(
                    "page",
                    "The live page while the wheel sent",
                    "As a browser showed it.",
                    file=seen.picture,
                    vector=seen.picture,
                    reason="" if seen.picture else "no browser was there",
                ),
            ],
        ),
    ]
    reports = [("where the model fails", "compared/index.html")]
    return write_page(
        out,
        DEMO,
        title="From a wheel transmitter to a model",
        lead=f"{len(campaign.plans)} runs of a tire ({calibration.tire}) went over a serial line "
        "to the bench, live, and came back as a campaign.",
        headline=[],
        sections=sections,
        commands=[{"what": what, "command": command} for what, command in steps.commands],
        reports=[{"title": title, "file": file} for title, file in reports],
    )


def clear(out: Path) -> None:
    """Remove what an earlier demonstration left, but for the days of the rig."""
    for old in out.glob("*"):
        if old.is_dir() and old.name in ("exported", "compared", "figures"):
            shutil.rmtree(old)
        elif old.is_file() or old.is_symlink():
            old.unlink()


def main(arguments: Sequence[str] | None = None, steps: Steps | None = None) -> None:
    """Run the demonstration."""
    parser = argparse.ArgumentParser(description="The bench from end to end.")
    parser.add_argument("--fresh", action="store_true", help="measure again what is there")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/bench-demo", metavar="DIR")
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help=f"ready campaigns in folders named {', '.join(DAYS)}",
    )
    parser.add_argument("--model", metavar="M.toml|NAME", help="compare with it, identify none")
    parser.add_argument("--pace", type=float, default=1.0, metavar="X", help="times real time")
    parser.add_argument("--no-browser", action="store_true", help="fetch the page, look not at it")
    parser.add_argument("--measure", nargs=2, metavar=("NAME", "DIR"), help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.measure:
        measure(given.measure[0], Path(given.measure[1]).resolve())
        return
    require_terminal()
    steps, started = steps or Steps(Console()), time.monotonic()
    out = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    clear(out)
    days = campaigns(steps, out, given.data and given.data.resolve(), given.fresh)
    fmu, model = prepare(steps, out, days["calibrated"], given.model)
    look = Look(out / "live-page.png", browser=not given.no_browser)
    files, seen = play(steps, out, days["played"], fmu, look, given.pace)
    use(steps, out, fmu, files, model)
    page = draw(steps, out, days["played"], files, seen)
    said = f"done in {time.monotonic() - started:.0f} s"
    steps.console.print(Rule(said, style="green"))
    judge(steps.console, files, days["played"])
    for what, file in (
        ("everything", page),
        ("where the model fails", out / "compared/index.html"),
        ("recording", out / "live.mcap"),
        ("campaign of the recording", out / "exported"),
    ):
        shown = os.path.relpath(file)
        steps.console.print(f"open  {shown}   ({what})", highlight=False, soft_wrap=True)


if __name__ == "__main__":
    with one_thread():
        main()
