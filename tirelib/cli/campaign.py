"""``tirelib campaign``: checks a folder of measurements, and shows its content."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.model import Run
from tirelib.campaign.read import Campaign, read_campaign
from tirelib.cli.common import NEW_FILE, NEW_FOLDER, write_json
from tirelib.cli.options import json_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import CalibrationError, FormatError

CHECK_FORMAT = "tirelib-campaign-check/1"
SHOW_FORMAT = "tirelib-campaign-show/1"

_WIDE = 145


@click.group()
def campaign() -> None:
    """Validate a folder of measurements, or show its content."""


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a callback (done, total) that shows progress as every verb does."""
    with progress_bar(what) as advance:
        yield lambda done, total: advance(f"run {done} of {total}")


_CHECK_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --out straight
  tirelib campaign check straight --json check.json

\b
Exit code: 0 no error (warnings are allowed), 1 errors were found,
2 DIR is not a readable folder.
"""


@campaign.command(epilog=_CHECK_EXAMPLE)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@json_option("the problems")
@progress_options
@click.pass_context
def check(context: click.Context, folder: Path, json_file: Path | None) -> None:
    """List all problems of the campaign in DIR at once."""
    from tirelib.campaign.check import check_campaign

    try:
        with _progress("checking") as progress:
            problems = check_campaign(folder, progress=progress)
    except FormatError as error:
        click.echo(f"Error: {error}", err=True)
        context.exit(2)
    errors = sum(problem.severity == "error" for problem in problems)
    _print_problems(folder, problems, errors)
    if json_file is not None:
        write_json(json_file, check_document(folder, problems))
    context.exit(1 if errors else 0)


def _print_problems(folder: Path, problems: list[CampaignFault], errors: int) -> None:
    console = Console(highlight=False, soft_wrap=True)
    for problem in problems:
        colour = "red" if problem.severity == "error" else "yellow"
        console.print(f"[bold {colour}]{problem.severity:>7}[/]  ", end="")
        console.print(str(problem), markup=False)
    warnings = len(problems) - errors
    if errors:
        verdict = "[bold red]not usable until the errors are corrected[/]"
    elif warnings:
        verdict = "[bold yellow]usable, but read the warnings[/]"
    else:
        verdict = "[bold green]sound[/]"
    counts = f"{_count(errors, 'error')}, {_count(warnings, 'warning')}"
    console.print(f"{folder}: {counts}: ", markup=False, end="")
    console.print(verdict)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def check_document(folder: Path, problems: list[CampaignFault]) -> dict[str, Any]:
    """Return what ``check --json`` writes."""
    errors = sum(problem.severity == "error" for problem in problems)
    return {
        "format": CHECK_FORMAT,
        "campaign": str(folder),
        "errors": errors,
        "warnings": len(problems) - errors,
        "problems": [
            {
                "severity": problem.severity,
                "where": problem.where,
                "given": problem.given,
                "allowed": problem.allowed,
                "remedy": problem.remedy,
            }
            for problem in problems
        ],
    }


_SHOW_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --out straight
  tirelib campaign show straight --out shown
"""


@campaign.command(epilog=_SHOW_EXAMPLE)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "--out",
    metavar="DIR",
    type=NEW_FOLDER,
    help="Folder for the overview plot. Default: show-NAME.",
)
@click.option("--no-plot", "no_plot", is_flag=True, help="Draw no overview plot: faster.")
@click.option(
    "--data",
    "data_file",
    metavar="FILE.npz",
    type=NEW_FILE,
    help="File for what was measured as arrays: waveforms over the wheel angle, or forces.",
)
@json_option("header and runs")
@progress_options
def show(
    folder: Path, out: Path | None, no_plot: bool, data_file: Path | None, json_file: Path | None
) -> None:
    """Show header, runs with set points and measured means, and an overview plot of DIR."""
    from tirelib.campaign.overview import RunRow, representative_plans, run_row

    data = read_campaign(folder)
    chosen = set() if no_plot else {plan.run for plan in representative_plans(data.plans)}
    rows: list[RunRow] = []
    drawn: list[Run] = []
    with _progress("reading") as progress:

        def seen() -> Iterator[Run]:
            for done, run in enumerate(data.runs(), start=1):
                rows.append(run_row(run))
                drawn.extend([run] if run.plan.run in chosen else [])
                progress(done, len(data.plans))
                yield run

        if data_file is not None:
            _write_measured(data, seen(), data_file)
        if not rows:
            deque(seen(), maxlen=0)
    terminal = Console(highlight=False)
    console = terminal if terminal.is_terminal else Console(highlight=False, width=_WIDE)
    _print_header(console, data)
    _print_runs(console, data, rows)
    picture = None
    if not no_plot:
        from tirelib.report.campaign_overview import overview_figure, save_figure

        target = out or Path(f"show-{folder.resolve().name}")
        picture = save_figure(overview_figure(data.header, rows, drawn), target / "overview.png")
        console.print(f"overview plot: {picture}", markup=False, soft_wrap=True)
    if json_file is not None:
        write_json(json_file, _show_document(data, rows, picture))


def _write_measured(data: Campaign, runs: Iterator[Run], file: Path) -> None:
    """Write what was measured, or say why there is nothing to be drawn."""
    from tirelib.inference.compare.plot_data import measured_data, write_plot_data

    try:
        write_plot_data(file, measured_data(data, runs))
    except CalibrationError as error:
        click.echo(f"Warning: {file} is not written: {error}", err=True)


def _print_header(console: Console, data: Campaign) -> None:
    from tirelib.campaign.overview import header_lines

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name, value in header_lines(data.header):
        table.add_row(name, value)
    console.print(table)


def _print_runs(console: Console, data: Campaign, rows: list[Any]) -> None:
    """Print a run a line where there is room, else set point over mean."""
    from tirelib.campaign.overview import COLUMNS

    wide = console.width >= _WIDE
    between = " / " if wide else "\n"
    table = Table(
        title=f"{len(rows)} runs: set point {'/' if wide else 'over'} measured mean, axes iso",
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1) if wide else (0, 1, 0, 0),
    )
    table.add_column("run", justify="right", no_wrap=True)
    table.add_column("kind", no_wrap=True)
    for column in COLUMNS:
        table.add_column(column.heading, justify="right", no_wrap=True)
    table.add_column("strain\nsamples", justify="right", no_wrap=True)
    for row in rows:
        cells = [column.cell(row, between) for column in COLUMNS]
        table.add_row(str(row.run), row.kind, *cells, str(row.samples) if row.samples else "-")
    console.print(table)


def _show_document(data: Campaign, rows: list[Any], picture: Path | None) -> dict[str, Any]:
    from tirelib.campaign.overview import header_document, row_document

    return {
        "format": SHOW_FORMAT,
        "campaign": str(data.path),
        "axes": "iso",
        "header": header_document(data.header),
        "content_hash": data.content_hash(),
        "runs": [row_document(row) for row in rows],
        "plot": None if picture is None else str(picture),
    }
