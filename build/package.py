"""The wheel, installed into an empty environment and used in an empty folder: ``make package``.

First the core alone: the verbs of a campaign must work, and what needs an extra must say which.
Then the extra of the bench. With ``--examples``, also every example of every ``--help``, one after
the other in a folder of each verb (half an hour). The exit code is 1 if anything differs from what
is expected.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import venv
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
CONSTRAINTS = ROOT / ".ci" / "constraints.txt"
TOP = {"tirelib", "tirebench"}
"""What the wheel may install at the top."""
CORE: Sequence[tuple[str, int, str]] = (
    ("tirelib --version", 0, "tirelib, version"),
    ("tirelib --help", 0, "Commands:"),
    ("tirelib rig --plan brake_drive --out campaign --seed 1", 0, "campaign"),
    ("tirelib rig --plan set3 --out straight --seed 1", 0, "straight"),
    ("tirelib campaign check campaign", 0, ""),
    ("tirelib calibrate campaign straight --out cal.toml --quick", 0, "cal.toml"),
    ("tirelib estimate campaign --calibration cal.toml --json estimates.json", 0, ""),
    ("tirelib identify straight --out M.toml", 0, "M.toml"),
    ("tirelib simulate --model M.toml --load 4000", 0, ""),
    ("tirelib fmu build --calibration cal.toml --out X.fmu", 0, "X.fmu"),
    ("tirelib fmu build --calibration cal.toml --out P.fmu --python", 2, "'tirelib[fmu]'"),
    ("tirelib studio --no-browser", 2, "pip install 'tirelib[studio]'"),
    ("tirebench --help", 0, "Commands:"),
    ("tirebench run --port /dev/null --fmu X.fmu", 2, "pip install 'tirelib[bench]'"),
)
"""Command, exit code, and what the output must contain."""
OWN = ("mine.py", "cornering.mat", "cornering.map", "commute", "Foreign", "s3://", "studio")
"""What marks an example that cannot run by itself: files of one's own, and a server that stays."""
BENCH: Sequence[tuple[str, int, str]] = (
    ("tirebench --version", 0, "tirebench, version"),
    ("tirebench ports", 0, ""),
    ("tirebench load --help", 0, "Usage:"),
)


def main() -> None:
    """Build, install, use."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--python", default=sys.executable, help="Interpreter of the environment.")
    parser.add_argument("--core-only", action="store_true", help="Leave out the bench's extra.")
    parser.add_argument("--examples", action="store_true", help="Run the examples of each --help.")
    parser.add_argument(
        "--keep", type=Path, metavar="DIR", help="Copy the wheel there if all is good."
    )
    given = parser.parse_args()
    with TemporaryDirectory(prefix="tirelib-package-") as folder:
        if not _used(Path(folder), given.python, given.core_only, given.examples):
            sys.exit(1)
        if given.keep is not None:
            given.keep.mkdir(parents=True, exist_ok=True)
            for wheel in Path(folder).glob("*.whl"):
                shutil.copy(wheel, given.keep)


def _used(folder: Path, python: str, core_only: bool, examples: bool) -> bool:
    _run([sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder), str(ROOT)])
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as content:
        top = {name.partition("/")[0] for name in content.namelist()}
    good = _said({name for name in top if not name.endswith(".dist-info")} == TOP, f"{wheel.name}")
    environment, place = folder / "environment", folder / "empty"
    place.mkdir()
    if python == sys.executable:
        venv.create(environment, with_pip=True)
    else:
        _run([python, "-m", "venv", str(environment)])
    _install(environment, str(wheel))
    commands = [_as_expected(environment, place, *each) for each in CORE]
    if not core_only:
        _install(environment, f"{wheel}[bench]")
        commands += [_as_expected(environment, place, *each) for each in BENCH]
    if examples:
        _install(environment, f"{wheel}[fmu,fleet]")
        commands += list(_examples(environment, place))
    return good and all(commands)


def _examples(environment: Path, place: Path) -> Iterator[bool]:
    """Run what the help of each verb shows, verb by verb."""
    for verb in _verbs(environment, "tirelib"):
        inside = place / verb.replace(" ", "-")
        inside.mkdir()
        for line in _shown(environment, verb):
            if not any(word in line for word in OWN):
                yield _as_expected(environment, inside, line, 0, "")


def _verbs(environment: Path, group: str) -> Iterator[str]:
    yield group
    for line in _help(environment, group).partition("\nCommands:\n")[2].splitlines():
        if not line.startswith("  "):
            break
        if line[2] != " ":
            yield from _verbs(environment, f"{group} {line.split()[0]}")


def _shown(environment: Path, verb: str) -> list[str]:
    text = _help(environment, verb).partition("\n  Example")[2].partition("\n\n")[0]
    joined = re.sub(r"\\\n\s*", "", text)
    return [line.partition("#")[0].strip() for line in joined.splitlines()[1:]]


def _help(environment: Path, verb: str) -> str:
    program, *words = verb.split()
    command = [str(environment / "bin" / program), *words, "--help"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _install(environment: Path, what: str) -> None:
    pip = [str(environment / "bin" / "python"), "-m", "pip", "install", "-q"]
    _run([*pip, "--constraint", str(CONSTRAINTS), what])


def _as_expected(environment: Path, place: Path, command: str, code: int, holds: str) -> bool:
    program, *words = shlex.split(command)
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [str(environment / "bin" / program), *words],
        cwd=place,
        env=clean,
        capture_output=True,
        text=True,
        check=False,
    )
    output = done.stdout + done.stderr
    good = done.returncode == code and holds in output and "Traceback" not in output
    return _said(good, command, "" if good else f"exit code {done.returncode}\n{output}")


def _said(good: bool, what: str, why: str = "") -> bool:
    sys.stdout.write(f"{'good' if good else 'WRONG':5s}  {what}\n{why}")
    sys.stdout.flush()
    return good


def _run(command: Sequence[str]) -> None:
    subprocess.run(command, check=True, cwd="/")


if __name__ == "__main__":
    main()
