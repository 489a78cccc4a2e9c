"""``tirelib fmu``: the estimator as an FMU; build it, check it, play a campaign to it."""

import math
import shlex
from pathlib import Path
from typing import Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    FILE,
    NEW_FILE,
    NEW_FOLDER,
    Real,
    Whole,
    output,
    say_written,
    write_document,
)
from tirelib.cli.estimate import exit_code, print_document
from tirelib.cli.fmu_virtual import measure, virtual
from tirelib.cli.options import json_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import FormatError
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.costs import costs_of
from tirelib.estimators.result import estimate_document
from tirelib.fmu.build import build_fmu
from tirelib.fmu.check import check_fmu
from tirelib.fmu.held import not_varied
from tirelib.fmu.native import core_file
from tirelib.fmu.parts import DEFAULT_RATE
from tirelib.fmu.run import LoadedFmu, play_campaign
from tirelib.measured.observations import observe
from tirelib.measured.signal import LowPass

_GROUP = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib calibrate day1 --out cal.toml
  tirelib fmu build --calibration cal.toml --out StrainTire.fmu --samples-per-step 10
  tirelib fmu virtual --out VirtualTire.fmu --samples-per-step 10
  tirelib fmu check StrainTire.fmu --out checked
  tirelib fmu run StrainTire.fmu day1 --json f.json
"""
_BUILD = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib calibrate day1 --out cal.toml
  tirelib fmu build --calibration cal.toml --out StrainTire.fmu
  tirelib fmu build --calibration cal.toml --out X.fmu --samples-per-step 10      # 1 ms at 10 kHz
  tirelib fmu build --calibration cal.toml --out X.fmu --samples-per-step 32 --buffered
  tirelib fmu build --calibration cal.toml --out X.fmu --sealed     # to hand over
  tirelib fmu build --calibration cal.toml --out X.fmu --fmi 3      # strain as an array, a clock
  tirelib fmu build --calibration cal.toml --out X.fmu --python     # computes in Python

\b
FMI 2.0 co-simulation (with --fmi 3: 3.0), one wheel. Inside is the estimator compiled for Linux,
Windows and macOS; it needs nothing else where it runs (with --python: CPython, numpy and scipy).
The communication step is the samples per step divided by the sample rate. With --buffered the step
is free, and the input `samples` gives the number of new samples in the frame; the estimates are
the same.
"""
_TABLE = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib calibrate day1 --out cal.toml
  tirelib fmu table cal.toml --out cal.table

\b
The FMU reads no TOML; its parameter `calibration` takes the path of this file. (One built with
--python takes CAL.toml itself.)
"""
_RUN = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib calibrate day1 --out cal.toml
  tirelib fmu build --calibration cal.toml --out StrainTire.fmu
  tirelib rig --plan set1 --seed 2 --out day2
  tirelib fmu run StrainTire.fmu day2 --json f.json

\b
JSON: as `tirelib estimate`. Exit code 1: not one turn is valid.
"""
_CHECK = """\b
Examples:
  tirelib fmu virtual --out VirtualTire.fmu
  tirelib fmu check VirtualTire.fmu
  tirelib fmu check Foreign.fmu --reference cross-check/Foreign --json check.json --out report

\b
The FMU's code runs in a separate process. Reference signals are read from resources/reference of
the FMU (X_in.csv, X_ref.csv, X_ref.opt). An FMU of another tool without reference signals is
validated and run for a few steps.
Exit code 0: all checks passed; 1: a check failed; 2: the file is not an FMU.
"""


@click.group(epilog=_GROUP)
def fmu() -> None:
    """Export the estimator or the virtual tire as an FMU, check it, and run it."""


fmu.add_command(virtual)
fmu.add_command(measure)


@fmu.command(epilog=_BUILD)
@click.option(
    "--calibration",
    metavar="CAL.toml",
    type=FILE,
    required=True,
    help="Calibration file that `tirelib calibrate` wrote; it is embedded.",
)
@click.option("--out", metavar="X.fmu", type=NEW_FILE, required=True, help="FMU to write.")
@click.option(
    "--samples-per-step",
    metavar="K",
    type=Whole(),
    default=1,
    show_default=True,
    help="Number of samples of each gage in one communication step: the step is K divided by the "
    "sample rate. 1 suits a host that steps once a sample; give the number of VirtualTire.fmu or "
    "of the transmitter's frame where they feed this FMU.",
)
@click.option(
    "--sample-rate",
    metavar="HZ",
    type=Real(),
    default=DEFAULT_RATE,
    show_default=True,
    help="Start value of the FMU's parameter of the same name.",
)
@click.option(
    "--buffered",
    is_flag=True,
    help="Allow communication steps of any length, with up to K samples each.",
)
@click.option(
    "--missing",
    metavar="NUMBER",
    type=float,
    default=math.nan,
    show_default="NaN",
    help="What an output shows where it has no value, for tools that do not take NaN.",
)
@click.option(
    "--python",
    is_flag=True,
    help="Pack the Python estimator instead of the compiled one.",
)
@click.option(
    "--sealed",
    is_flag=True,
    help="Leave out the calibration file: campaign names, statistics and a measured turn.",
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="Version of FMI.",
)
@click.option("--native", is_flag=True, hidden=True, expose_value=False)
@progress_options
def build(
    calibration: Path,
    out: Path,
    samples_per_step: int,
    sample_rate: float,
    buffered: bool,
    missing: float,
    python: bool,
    sealed: bool,
    fmi: str,
) -> None:
    """Write StrainTire.fmu with a calibration inside."""
    with progress_bar("building", 3) as progress:
        path = build_fmu(
            calibration,
            out,
            samples_per_step=samples_per_step,
            sample_rate=sample_rate,
            buffered=buffered,
            missing=missing,
            python=python,
            sealed=sealed,
            fmi=int(fmi),
            progress=progress,
        )
    loaded = read_calibration(calibration)
    first, last = (
        f"strain_{number} = {1e3 * y:+g} mm ({'left' if y > 0.0 else 'right'})"
        for number, y in ((1, loaded.lateral[0]), (len(loaded.lateral), loaded.lateral[-1]))
    )
    step = 1e3 * samples_per_step / sample_rate
    console = output()
    console.print(f"tire {loaded.tire}, {first} .. {last} (ISO 8855)")
    for condition in not_varied(loaded):
        console.print(f"not varied in the calibration: {condition}")
    free = f"of any length, up to {samples_per_step} samples"
    console.print(f"communication step {free if buffered else f'{step:g} ms'}")
    if samples_per_step == 1:
        console.print(
            "one sample a step: behind a VirtualTire.fmu or a transmitter build with its number of "
            "samples (--samples-per-step; `tirelib fmu virtual` takes 10 by default)"
        )
    console.print(f"written: {path} ({path.stat().st_size / 1e3:.0f} kB)")
    console.print(f"next: {shlex.join(['tirelib', 'fmu', 'check', str(path)])}")


@fmu.command(epilog=_TABLE)
@click.argument("calibration", metavar="CAL.toml", type=FILE)
@click.option("--out", metavar="X.table", type=NEW_FILE, required=True, help="File to write.")
def table(calibration: Path, out: Path) -> None:
    """Write a calibration for the parameter `calibration` of an FMU."""
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(core_file(read_calibration(calibration)))
    output().print(f"written: {out} ({out.stat().st_size / 1e3:.0f} kB)")


@fmu.command(epilog=_RUN)
@click.argument("file", metavar="X.fmu", type=FILE)
@click.argument("folder", metavar="DIR", type=CAMPAIGN)
@json_option("every turn")
@progress_options
@click.pass_context
def run(context: click.Context, file: Path, folder: Path, json_file: Path | None) -> None:
    """Step the FMU through every run of DIR with FMPy, and compare with the rig."""
    campaign = read_campaign(folder)
    with LoadedFmu(file) as loaded, progress_bar("stepping", len(campaign.plans)) as progress:
        observations, estimates = play_campaign(loaded, campaign, progress)
        own, told = loaded.calibration, loaded.told.values()
    features = observe([campaign], low_pass=LowPass(own.order, own.cut_off)).features
    costs = costs_of(own, features, own.estimate(features))  # an FMU puts out no features
    document = estimate_document(observations, estimates, own, costs)
    print_document(campaign.header.name, document, own)
    for text in told:
        output().print(f"log of the FMU: {text}", markup=False)
    write_document(document, json_file)
    context.exit(exit_code(document))


@fmu.command(epilog=_CHECK)
@click.argument("file", metavar="X.fmu", type=FILE)
@click.option(
    "--reference",
    metavar="DIR",
    type=CAMPAIGN,
    help="Folder of reference signals, where the FMU holds none.",
)
@click.option("--out", metavar="REPORT", type=NEW_FOLDER, help="Folder for the page.")
@json_option("the result")
@progress_options
@click.pass_context
def check(
    context: click.Context,
    file: Path,
    reference: Path | None,
    out: Path | None,
    json_file: Path | None,
) -> None:
    """Validate X.fmu, play its reference signals, and compare its outputs with them."""
    with progress_bar("checking", 3) as progress:
        document = check_fmu(file, reference=reference, progress=progress)
    _print_check(document)
    kept = {name: part for name, part in document.items() if name not in ("curves", "units")}
    write_document(kept, json_file)
    if out is not None:
        from tirelib.report.fmu_check import write_check

        try:
            page = write_check(document, out)
        except OSError as error:
            raise FormatError(
                f"{out}: cannot be written ({error.strerror}); choose another folder"
            ) from None
        say_written(page)
    context.exit(0 if document["passed"] else 1)


def _print_check(document: dict[str, Any]) -> None:
    from tirelib.report.fmu_check import verdict

    console = output()
    for part in document["parts"]:
        word = "passed" if part["passed"] else "FAILED"
        console.print(f"{word}  {part['name']}: {part['detail']}")
    for row in document["variables"]:
        if not row["passed"]:
            found = row["largest_difference"]
            size = "a number is missing" if found is None else f"{found:.3g} {row['unit']}"
            console.print(
                f"        {row['name']}: {size} at {row['time']:g} s; {row['allowed']:.3g} allowed"
            )
    for message in document["messages"]:
        console.print(f"        log: {message}")
    console.print(verdict(document))
