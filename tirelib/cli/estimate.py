"""``tirelib estimate``: Fz, alpha, kappa and Fy of every turn, with standard deviations."""

from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    FILE,
    NEW_FOLDER,
    output,
    progress_bar,
    write_json,
)
from tirelib.cli.limits import not_checked, not_given, outside, weakly_checked
from tirelib.cli.options import json_option
from tirelib.errors import CalibrationError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.costs import costs_of
from tirelib.estimators.result import estimate_document
from tirelib.observations import geometry_of, observe
from tirelib.signal import LowPass

_EXAMPLE = """\b
Example:
  tirelib estimate data/another-day --calibration build/out/cal.toml --json build/out/e.json

\b
JSON: N, deg, kappa without unit, ISO 8855 axes. A value is null where a quantity has no calibration
or cannot be estimated; not_given lists the accuracy lost to missing conditions; other_tire is null
where the calibration cannot detect another tire. Exit code 1: not one turn is valid, or the tire is
probably another one.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="DIR", type=CAMPAIGN)
@click.option(
    "--calibration",
    "calibration_file",
    metavar="CAL.toml",
    type=FILE,
    required=True,
    help="Calibration file that `tirelib calibrate` wrote.",
)
@click.option(
    "--report", metavar="FOLDER", type=NEW_FOLDER, help="Write the accuracy with figures as HTML."
)
@json_option("every turn")
@click.pass_context
def estimate(
    context: click.Context,
    folder: Path,
    calibration_file: Path,
    report: Path | None,
    json_file: Path | None,
) -> None:
    """Estimate every turn of DIR, and compare with the forces that the rig measured."""
    calibration = read_calibration(calibration_file)
    campaign = read_campaign(folder)
    header = campaign.header
    calibration.check_layout(
        header.tire.name, header.gage_lateral, str(folder), geometry_of(header)
    )
    if not campaign.header.gage_lateral:
        raise CalibrationError(
            f"{folder}: the campaign holds no strain; estimates need strain; choose another "
            "campaign"
        )
    low_pass = LowPass(calibration.order, calibration.cut_off)
    with progress_bar("reading", len(campaign.plans)) as progress:
        observations = observe([campaign], low_pass=low_pass, progress=progress)
    estimates = calibration.estimate(observations.features)
    costs = costs_of(calibration, observations.features, estimates)
    document = estimate_document(observations, estimates, calibration, costs)
    console = output()
    print_document(campaign.header.name, document, calibration)
    if json_file is not None:
        write_json(json_file, document)
        console.print(f"written: {json_file}")
    if report is not None:
        from tirelib.report.calibration import write_estimate_report

        page = write_estimate_report(observations, estimates, calibration, report)
        console.print(f"written: {page}")
    context.exit(exit_code(document))


def exit_code(document: dict[str, Any]) -> int:
    """Return 1 where not one turn is valid or the tire is probably another one, else 0."""
    other = document["other_tire"]
    valid = any(turn["valid"] for turn in document["turns"])
    return 0 if valid and not (other and other["suspected"]) else 1


def print_document(name: str, document: dict[str, Any], calibration: Calibration) -> None:
    """Print summary, flags and limits of an estimate document."""
    console = output()
    turns = document["turns"]
    valid = sum(bool(turn["valid"]) for turn in turns)
    console.print(f"{name}: {len(turns)} turns, {valid} valid (ISO 8855 axes)")
    console.print(_summary_table(document["summary"]))
    counts: dict[str, int] = {}
    for turn in turns:
        for flag in turn["flags"]:
            counts[flag] = counts.get(flag, 0) + 1
    for flag, count in sorted(counts.items(), key=lambda item: -item[1]):
        console.print(f"  {count:5d} turns flagged {flag}")
    other = document["other_tire"]
    if other and other["suspected"]:
        console.print(
            f"another tire? {other['turns']} of {other['judged']} turns in range have a strain "
            f"pattern that the calibrated {document['tire']!r} does not show (by chance one turn "
            "in a thousand would, on a worn tread under a high load one in twenty); check whether "
            "this tire is on the wheel, and whether it is worn or soft; otherwise calibrate again"
        )
    limits = (outside(turns, calibration), weakly_checked(other), *not_checked(calibration))
    for sentence in (not_given(document["not_given"]), *limits):
        if sentence:
            console.print(sentence)


def _summary_table(summary: dict[str, Any]) -> Table:
    table = Table(box=SIMPLE_HEAD)
    for column in ("quantity", "rmse", "unit", "% of range", "R2", "runs", "in 95 % interval"):
        table.add_column(column, justify="left" if column in ("quantity", "unit") else "right")
    for quantity, entry in summary.items():
        if entry is None:
            table.add_row(quantity, "not calibrated", *[""] * 5)
            continue
        if entry["rmse"] is None:
            table.add_row(quantity, "not measured", entry["unit"], *[""] * 4)
            continue
        r2 = "-" if entry["r2"] is None else f"{entry['r2']:.5f}"
        percent = entry["rmse_percent_of_range"]
        table.add_row(
            quantity,
            f"{entry['rmse']:.4g}",
            entry["unit"],
            "-" if percent is None else f"{percent:.2f}",
            r2,
            str(entry["n"]),
            f"{100 * entry['coverage_95']:.0f} %",
        )
    return table
