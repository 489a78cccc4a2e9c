"""``tirelib estimate``: Fz, alpha, kappa and Fy of every turn, with standard deviations."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from tirelib.campaign import read_campaign
from tirelib.campaign.recording import FILE as RECORDING
from tirelib.campaign.recording import read_recording
from tirelib.cli.common import (
    CAMPAIGN,
    FILE,
    NEW_FILE,
    NEW_FOLDER,
    new_table,
    output,
    say_written,
    write_document,
)
from tirelib.cli.limits import extrapolated, not_checked, not_given, outside, weakly_checked
from tirelib.cli.options import json_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.documents import file_hash
from tirelib.core.errors import CalibrationError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.continuous import estimate_recording
from tirelib.estimators.continuous_document import Totals, TurnsInJson
from tirelib.estimators.costs import costs_of
from tirelib.estimators.result import estimate_document
from tirelib.estimators.turn_table import TurnTable
from tirelib.measured.observations import geometry_of, observe
from tirelib.measured.signal import LowPass

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib rig --plan set1 --seed 2 --out day2
  tirelib calibrate day1 --out cal.toml
  tirelib estimate day2 --calibration cal.toml --json estimates.json --report estimated
  tirelib estimate commute --calibration cal.toml --out turns.parquet

\b
DIR is a campaign, or a continuous recording (a folder with a recording.toml): hours of driving, one
or several wheels, in bounded memory; then --report is not available.

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
@click.option(
    "--out",
    "table",
    metavar="FILE.parquet",
    type=NEW_FILE,
    help="Write every turn as a table, one row each; of a recording they are then not in --json.",
)
@json_option("every turn")
@progress_options
@click.pass_context
def estimate(
    context: click.Context,
    folder: Path,
    calibration_file: Path,
    report: Path | None,
    table: Path | None,
    json_file: Path | None,
) -> None:
    """Estimate every turn of DIR, and compare with the forces that the rig measured."""
    calibration = read_calibration(calibration_file)
    if (folder / RECORDING).is_file():
        if report is not None:
            raise CalibrationError(
                f"{folder}: a recording has no forces of a rig to compare with, so there is no "
                "--report; use --out or --json"
            )
        document = _estimate_recording(folder, calibration, calibration_file, table, json_file)
        context.exit(0 if document["valid_turns"] else 1)
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
    print_document(campaign.header.name, document, calibration)
    if table is not None:
        with TurnTable(table, file_hash(calibration_file)) as turns:
            turns.write("", observations.run, observations.features, estimates)
        say_written(table)
    write_document(document, json_file)
    if report is not None:
        from tirelib.report.estimate import write_estimate_report

        page = write_estimate_report(observations, estimates, calibration, report)
        say_written(page)
    context.exit(exit_code(document))


def _estimate_recording(
    folder: Path,
    calibration: Calibration,
    calibration_file: Path,
    table: Path | None,
    json_file: Path | None,
) -> dict[str, Any]:
    """Write the turns of a continuous recording as they come, and return the document's head."""
    recording = read_recording(folder)
    console = output()
    with ExitStack() as stack:
        rows = stack.enter_context(TurnTable(table, file_hash(calibration_file))) if table else None
        turns = stack.enter_context(TurnsInJson(json_file)) if json_file else None
        total = Totals(recording, calibration)
        progress = stack.enter_context(progress_bar("estimating"))
        for part in estimate_recording(recording, calibration):
            total.add(part)
            if rows is not None:
                rows.write(part.wheel.name, 0, part.features, part.estimates)
            if turns is not None and rows is None:
                turns.write(part)
            progress(f"{part.wheel.name} {part.until:.0f} s")
        document = total.document()
        if turns is not None:
            turns.end(document)
    console.print(
        f"{recording.name}: {document['duration_s'] / 3600:.2f} h, "
        f"{len(document['wheels'])} wheels, {document['turn_count']} turns, "
        f"{document['valid_turns']} valid (ISO 8855 axes)"
    )
    for name, wheel in document["wheels"].items():
        console.print(
            f"  {name}: {wheel['turns']} turns, {wheel['valid']} valid, {wheel['gaps']} long gaps, "
            f"{wheel['missing_samples']} samples missing"
        )
        for flag, count in sorted(wheel["flags"].items(), key=lambda item: -item[1]):
            console.print(f"    {count:6d} turns flagged {flag}")
        other = wheel["other_tire"]
        if other and other["suspected"]:
            console.print(
                f"    another tire? {other['turns']} of {other['judged']} turns in range have a "
                f"strain pattern that the calibrated {calibration.tire!r} does not show"
            )
    say_written(*filter(None, (table, json_file)))
    return document


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
    limits = (
        outside(turns, calibration),
        extrapolated(turns, calibration),
        weakly_checked(other),
        *not_checked(calibration),
    )
    for sentence in (not_given(document["not_given"]), *limits):
        if sentence:
            console.print(sentence)


def _summary_table(summary: dict[str, Any]) -> Table:
    table = new_table(
        *("quantity", "rmse", "unit", "% of range", "R2", "runs", "in 95 % interval"),
        words=("quantity", "unit"),
    )
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
