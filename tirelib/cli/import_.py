"""``tirelib import``: measured files of other formats to a campaign."""

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.table import Table as Grid

from tirelib.campaign.importing.delimited import CsvOptions
from tirelib.campaign.importing.importer import ImportReport, import_campaign
from tirelib.campaign.importing.mapfile import parse_map
from tirelib.campaign.importing.suggest import list_columns, suggest_map
from tirelib.cli.common import FILE, NEW_FOLDER, output, write_json
from tirelib.cli.options import json_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import FormatError

PLACE = click.Path(path_type=Path)
FORMAT = "tirelib-import/1"
LIST_FORMAT = "tirelib-import-list/1"

_EXAMPLE = """\b
Examples:
  tirelib import cornering.mat --list
  tirelib import cornering.mat --suggest > cornering.map.toml
  tirelib import cornering.mat --map cornering.map.toml --out cornering

\b
A map:
  format = "tirelib-map/1"
  axes = "sae"                  # of the files: iso, sae or adapted_sae; required
  kind = "sweep"                # or run_column = "RUN", with [set_points]
  [tire]
  free_radius_m = 0.203
  [channels]
  time       = { column = "ET", unit = "s" }
  Fz         = { column = "FZ", unit = "N" }
  slip_angle = { column = "SA", unit = "deg" }

\b
Formats: .mat (5 and 7.3), .csv .tsv .txt .dat, .parquet, .tdx .tyd .tydex (TYDEX 1.3),
.mf4 .mdf (MDF 4). Several files are one run each, in the order given.
Exit code: 0 done, 1 --list could not read some of the files, 2 bad input (all faults are listed,
nothing is written).
"""


@click.command("import", epilog=_EXAMPLE)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PLACE)
@click.option("--map", "map_file", metavar="MAP.toml", type=FILE, help="Import map (TOML).")
@click.option("--out", metavar="DIR", type=NEW_FOLDER, help="Campaign folder.")
@click.option("--force", is_flag=True, help="Replace a campaign that already exists in DIR.")
@click.option("--list", "show_list", is_flag=True, help="List the columns of each FILE and stop.")
@click.option("--suggest", is_flag=True, help="Print a draft of the map for FILE and stop.")
@json_option("a summary")
@progress_options
@click.pass_context
def import_(
    context: click.Context,
    files: tuple[Path, ...],
    map_file: Path | None,
    out: Path | None,
    force: bool,
    show_list: bool,
    suggest: bool,
    json_file: Path | None,
) -> None:
    """Make a campaign from measured files: MATLAB, CSV, Parquet, TYDEX, loose MDF 4."""
    for folder in (file for file in files if file.is_dir()):
        raise click.UsageError(f"{folder} is a folder; name its files, for example {folder}/*.csv")
    layout: CsvOptions | None = None
    if map_file is not None and (suggest or show_list):
        layout = parse_map(map_file, "")[0].csv
    if suggest:
        click.echo(_draft(files, layout), nl=False)
        return
    if show_list:
        document = _listed_files(files, layout)
        if json_file is not None:
            write_json(json_file, document)
        context.exit(1 if document["unreadable"] else 0)
    if map_file is None or out is None:
        missing = " and ".join(
            name for name, given in (("--map", map_file), ("--out", out)) if given is None
        )
        raise click.UsageError(
            f"{missing} is missing; --map and --out are both needed; see --help for a map."
        )
    with progress_bar("reading", len(files)) as progress:
        report = import_campaign(files, map_file, out, overwrite=force, progress=progress)
    for note in report.notes:
        click.echo(f"note: {note}", err=True)
    for warning in report.warnings:
        click.echo(f"warning: {warning}", err=True)
    document = report_document(report)
    output().print(
        f"{out}: {len(report.runs)} run(s), {sum(run.rows for run in report.runs)} rows, files in "
        f"axes {report.header.axes}; view it with `tirelib campaign show {out}`"
    )
    if json_file is not None:
        write_json(json_file, document)


def report_document(report: ImportReport) -> dict[str, Any]:
    """Return what ``--json`` writes."""
    header = report.header
    gages = {"lateral_m": list(header.gage_lateral), "rate_hz": header.rate}
    return {
        "format": FORMAT,
        "campaign": str(report.campaign),
        "name": header.name,
        "axes_of_files": header.axes,
        "axes": "iso",
        "gages": gages if header.gage_lateral else None,
        "runs": [
            {
                "run": run.plan.run,
                "file": run.plan.file,
                "source": run.source,
                "kind": run.plan.kind,
                "rows": run.rows,
                "duration_s": run.duration,
                "channels": list(run.channels),
            }
            for run in report.runs
        ],
        "notes": list(report.notes),
        "warnings": [str(warning) for warning in report.warnings],
    }


def _draft(files: Sequence[Path], layout: CsvOptions | None) -> str:
    """Return the draft of a map for the first file that can be read."""
    for file in files[:-1]:
        with suppress(FormatError):
            return suggest_map(file, layout)
    return suggest_map(files[-1], layout)


def _listed_files(files: Sequence[Path], layout: CsvOptions | None) -> dict[str, Any]:
    """Print and return the columns of the files that can be read, and why others cannot be."""
    listed, unreadable = [], []
    for file in files:
        try:
            listed.append(_listed(file, layout))
        except FormatError as error:
            unreadable.append({"file": str(file), "reason": str(error)})
    if not listed:
        raise FormatError([each["reason"] for each in unreadable])
    for each in unreadable:
        click.echo(f"warning: {each['reason']}", err=True)
    return {"format": LIST_FORMAT, "files": listed, "unreadable": unreadable}


def _listed(file: Path, layout: CsvOptions | None) -> dict[str, Any]:
    """Print the columns of a file and return them as JSON has them."""
    table, columns = list_columns(file, layout)
    grid = Grid(title=f"{file}: {table.form}", title_justify="left", box=SIMPLE_HEAD)
    for heading in ("column", "unit", "rows", "min", "max", "NaN", "taken for"):
        right = heading in ("rows", "min", "max", "NaN")
        grid.add_column(heading, justify="right" if right else "left", no_wrap=True)
    for item in columns:
        low, high = ("-" if math.isnan(v) else f"{v:.6g}" for v in (item.low, item.high))
        grid.add_row(
            item.name,
            item.unit,
            str(item.rows),
            low,
            high,
            str(item.missing) if item.missing else "",
            item.quantity,
        )
    console = output()
    console.print(grid)
    for name, reason in table.left_out.items():
        console.print(f"left out: {name} ({reason})")
    for note in table.notes:
        console.print(f"note: {note}")
    return {
        "file": table.file,
        "form": table.form,
        "columns": [
            {
                "name": item.name,
                "unit": item.unit,
                "rows": item.rows,
                "min": item.low,
                "max": item.high,
                "middle": item.middle,
                "missing": item.missing,
                "quantity": item.quantity or None,
            }
            for item in columns
        ],
        "left_out": dict(table.left_out),
        "notes": list(table.notes),
    }
