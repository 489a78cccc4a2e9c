"""``tirelib fmu``: the estimator as an FMU; build it, and play a campaign to it."""

from pathlib import Path

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, output, progress_bar, write_json
from tirelib.cli.estimate import print_document
from tirelib.estimators.result import estimate_document
from tirelib.fmu.build import DEFAULT_RATE, build_fmu, embedded_calibration
from tirelib.fmu.run import LoadedFmu, play_campaign

_BUILD = """\b
Example:
  tirelib fmu build --calibration build/out/cal.toml --out build/out/StrainTire.fmu

\b
FMI 2.0 co-simulation, one wheel. Needs CPython with numpy and scipy where it runs; the rest is
inside. The communication step is samples per step over sample rate.
"""
_RUN = """\b
Example:
  tirelib fmu run build/out/StrainTire.fmu data/another-day --json build/out/f.json

\b
JSON: as `tirelib estimate`. Exit code 1: not one turn is valid.
"""


@click.group()
def fmu() -> None:
    """Export the estimator as an FMU, and run it."""


@fmu.command(epilog=_BUILD)
@click.option("--calibration", metavar="CAL.toml", type=FILE, required=True,
              help="Made by `tirelib calibrate`; it is embedded.")  # fmt: skip
@click.option("--out", metavar="X.fmu", type=FILE, required=True, help="The FMU to write.")
@click.option("--samples-per-step", metavar="K", type=int, default=1, show_default=True,
              help="Samples of every gage that one communication step brings.")  # fmt: skip
@click.option("--sample-rate", metavar="HZ", type=float, default=DEFAULT_RATE, show_default=True,
              help="Start value of the parameter of that name.")  # fmt: skip
def build(calibration: Path, out: Path, samples_per_step: int, sample_rate: float) -> None:
    """Write StrainTire.fmu with a calibration inside."""
    path = build_fmu(calibration, out, samples_per_step=samples_per_step, sample_rate=sample_rate)
    loaded = embedded_calibration(path)
    gages = ", ".join(f"{1e3 * y:+g}" for y in loaded.lateral)
    console = output()
    console.print(f"tire {loaded.tire}, gages at {gages} mm (ISO 8855)")
    console.print(f"communication step {1e3 * samples_per_step / sample_rate:g} ms")
    console.print(f"written: {path} ({path.stat().st_size / 1e3:.0f} kB)")


@fmu.command(epilog=_RUN)
@click.argument("file", metavar="X.fmu", type=FILE)
@click.argument("folder", metavar="DIR", type=CAMPAIGN)
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write every turn as JSON.")
@click.pass_context
def run(context: click.Context, file: Path, folder: Path, json_file: Path | None) -> None:
    """Step the FMU through every run of DIR with FMPy, and compare with the rig."""
    campaign = read_campaign(folder)
    with LoadedFmu(file) as loaded, progress_bar("stepping", len(campaign.plans)) as progress:
        observations, estimates = play_campaign(loaded, campaign, progress)
        document = estimate_document(observations, estimates, loaded.calibration)
    valid = print_document(campaign.header.name, document)
    if json_file is not None:
        write_json(json_file, document)
        output().print(f"written: {json_file}")
    context.exit(0 if valid else 1)
