"""The main job from end to end, as a user would type it: ``make demo``.

The numerical rig measures a virtual tire; its campaigns are checked, calibrated and held against a
day that the calibration has not seen. Everything lands in ``build/out/demo``.
"""

import argparse
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.rule import Rule

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(sys.executable).with_name("tirelib")
PLANS = {
    "set1": ("set1", 1),
    "set1-unseen": ("set1", 2),
    "set2": ("set2", 3),
    "brake_drive": ("brake_drive", 4),
    "brake_drive-unseen": ("brake_drive", 5),
    "set3": ("set3", 6),
}
"""Folder of a campaign: the rig's plan, and the day (seed)."""
CALIBRATED = ("set1", "set2", "brake_drive")
"""Campaigns that the calibration sees, where they exist."""


class Steps:
    """Run commands one after the other, show them, and remember them for the page."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.commands: list[tuple[str, str]] = []

    def run(self, what: str, *arguments: str | Path) -> None:
        """Run ``tirelib`` with arguments; stop the demonstration where it fails."""
        shown = _shown(arguments)
        self.commands.append((what, shown))
        self.console.print(Rule(what, align="left", style="dim"))
        self.console.print(f"[bold]$ {shown}[/]", highlight=False, soft_wrap=True)
        started = time.monotonic()
        done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=ROOT, check=False)
        if done.returncode:
            self.console.print(f"[bold red]tirelib ended with exit code {done.returncode}[/]")
            sys.exit(done.returncode)
        self.console.print(f"[dim]{time.monotonic() - started:.0f} s[/]", highlight=False)


def _shown(arguments: Sequence[str | Path]) -> str:
    """Say a command as it is typed at the root of the repository."""
    return shlex.join(["tirelib", *(_short(argument) for argument in arguments)])


def _short(argument: str | Path) -> str:
    """Say a path inside the repository relative to its root."""
    if isinstance(argument, Path) and argument.is_absolute() and argument.is_relative_to(ROOT):
        return str(argument.relative_to(ROOT))
    return str(argument)


def measure(steps: Steps, folder: Path, fresh: bool) -> dict[str, Path]:
    """Let the rig measure every campaign that is not there yet."""
    data = {}
    for name, (plan, seed) in PLANS.items():
        target = folder / name
        what = f"Measure {name} on the numerical rig"
        words = ("rig", "--plan", plan, "--seed", str(seed), "--out", target, "--force")
        if fresh or not (target / "truth.csv").exists():  # the rig writes it last
            steps.run(what, *words)
        else:
            steps.commands.append((what, _shown(words)))
            steps.console.print(f"{name}: measured before, used again (--fresh measures anew)")
        data[name] = target
    return data


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
        "--data", type=Path, metavar="DIR",
        help=f"use ready campaigns in folders named {', '.join(PLANS)} instead of the rig",
    )  # fmt: skip
    given = parser.parse_args()
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
    page = draw(console, out, data, calibration, steps, reports)
    console.print(Rule(f"done in {time.monotonic() - started:.0f} s", style="green"))
    for title, file in [("everything", page), *((t, out / f) for t, f in reports)]:
        console.print(f"open  {_short(Path(file))}   ({title})", highlight=False, soft_wrap=True)


def draw(
    console: Console,
    out: Path,
    data: dict[str, Path],
    calibration: Path,
    steps: Steps,
    reports: list[tuple[str, str]],
) -> Path:
    """Draw every figure of chapter 4 and write the page."""
    from tirelib.estimators.calibration_file import read_calibration
    from tirelib.report.demo import write_demo_page

    console.print(Rule("Draw the figures of chapter 4", align="left", style="dim"))
    with console.status("drawing") as status:
        return write_demo_page(
            out,
            data,
            read_calibration(calibration),
            commands=steps.commands,
            reports=reports,
            progress=status.update,
        )


if __name__ == "__main__":
    main()
