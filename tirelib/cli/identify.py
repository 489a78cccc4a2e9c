"""``tirelib identify``: the tire's parameters from a campaign, with intervals and flags."""

from math import isnan
from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, output, progress_bar, write_json

_EXAMPLE = """\b
Examples:
  tirelib rig --plan straight --out build/out/straight
  tirelib identify build/out/straight --out build/out/M.toml --json build/out/identified.json
  tirelib simulate --model build/out/M.toml --load 4000 --speed 80 --out build/out/simulated

\b
The ring is fitted to straight runs with strain, the brush to forces over slip; either alone will
do. Intervals are 95 % and hold the structural misfit; "not_identifiable" marks numbers whose
interval is wider than 25 % to either side, with the test that would tell them. Exit code 1:
nothing could be identified.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="DIR", type=CAMPAIGN)
@click.option("--tire", "tire_file", metavar="T.toml|NAME",
              help="Start and priors (default: the campaign's geometry, literature).")  # fmt: skip
@click.option("--out", "out", metavar="M.toml", type=FILE, required=True,
              help="The identified model; the other verbs read it.")  # fmt: skip
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write the numbers as JSON.")
@click.pass_context
def identify(
    context: click.Context,
    folder: Path,
    tire_file: str | None,
    out: Path,
    json_file: Path | None,
) -> None:
    """Fit the base model, ring and brush, to DIR."""
    from tirelib.identify.forces_document import whole_document
    from tirelib.identify.whole import identify_whole
    from tirelib.parameters import read_tire, write_tire

    start = read_tire(tire_file) if tire_file is not None else None
    campaign = read_campaign(folder)
    with progress_bar("identifying") as progress:
        whole = identify_whole(campaign, start, progress=progress)
    document = whole_document(campaign, whole)
    write_tire(whole.file, out, "tirelib-model/1")
    console = output()
    if whole.ring is not None:
        _say_ring(console, document)
    if document["brush"] is not None:
        _say_brush(console, document)
    if document["ring_pressure"] is not None:
        _say_pressure(console, document["ring_pressure"])
    for reason in document["reasons"]:
        console.print(f"  {reason}")
    console.print(f"written: {out}")
    if json_file is not None:
        write_json(json_file, document)
        console.print(f"written: {json_file}")
    brush = document["brush"]
    every = [*document["parameters"], *(brush["parameters"] if brush else [])]
    context.exit(0 if any("not_identifiable" not in entry["flags"] for entry in every) else 1)


def _say_ring(console: Console, document: dict[str, Any]) -> None:
    console.print(
        f"{document['campaign']}: {len(document['runs'])} straight runs, "
        f"{len(document['gages'])} gages averaged; strain rms left {document['rms_ustrain']:.0f} "
        f"of {document['strain_rms_ustrain']:.0f} microstrain"
    )
    _say_parameters(console, document["parameters"])
    stiffness = document["vertical_stiffness"]
    if stiffness["measured"] is not None:
        console.print(
            f"  vertical stiffness at {stiffness['load_N']:.0f} N: model "
            f"{stiffness['model']:.1f}, measured {stiffness['measured']:.1f} N/mm"
        )
    damping = document["damping"]
    if damping is not None:
        flags = f" ({', '.join(damping['flags'])})" if damping["flags"] else ""
        console.print(
            f"  damping {damping['value']:.3f}, 95 % {damping['low']:.3f} to "
            f"{damping['high']:.3f}{flags}; "
            "not in the model: `tirelib add sidewall_damping` puts it there"
        )


def _say_brush(console: Console, document: dict[str, Any]) -> None:
    brush, forces = document["brush"], document["forces"]
    left = ", ".join(
        f"{name} {entry['rmse']:.3g} {entry['unit']} ({entry['rmse_percent_of_peak']:.1f} % of the "
        f"peak, R2 {entry['r2']:.4f})"
        for name, entry in forces.items()
        if isinstance(entry, dict)
    )
    console.print(f"{document['campaign']}: brush from {forces['points']} points; left: {left}")
    _say_parameters(console, brush["parameters"])
    table = Table(box=SIMPLE_HEAD)
    for column in ("stiffness over", "load N", "bar", "value", "95 % from", "to", "unit"):
        words = column in ("stiffness over", "unit")
        table.add_column(column, justify="left" if words else "right")
    for entry in brush["stiffness"]:
        bar = entry["pressure_bar"]
        table.add_row(
            entry["slip"].replace("_", " "),
            f"{entry['load_N']:.0f}",
            "" if isnan(bar) else f"{bar:.2f}",
            *(f"{entry[k]:.4g}" for k in ("value", "low", "high")),
            entry["unit"],
        )
    console.print(table)
    where = {"ring": "the ring", "Mz": "Mz", "assumed": "an assumption"}[brush["half_length_from"]]
    console.print(f"  contact length from {where}; values hold at the median load, "
                  f"{brush['reference']['load_N']:.0f} N")  # fmt: skip
    for note in brush["notes"]:
        console.print(f"  {note}")


def _say_pressure(console: Console, found: dict[str, Any]) -> None:
    console.print("lateral force by the ring's pressure against the parabola, rms error N "
                  "(unseen points in brackets)")  # fmt: skip
    table = Table(box=SIMPLE_HEAD)
    for column in ("by", "from", "to", "points", "ring", "parabola", "better"):
        words = column in ("by", "better")
        table.add_column(column, justify="left" if words else "right")
    for row in found["table"]:
        ends = ("", "") if row["by"] == "all" else (f"{row['low']:.4g}", f"{row['high']:.4g}")
        unit = f" {row['range_unit']}" if row["range_unit"] else ""
        table.add_row(
            row["by"].replace("_", " ") + unit, *ends, str(row["points"]),
            *(f"{row[f'{k}_rmse']:.0f} ({row[f'{k}_rmse_unseen']:.0f})"
              for k in ("ring", "parabola")),
            row["better"],
        )  # fmt: skip
    console.print(table)


def _say_parameters(console: Console, parameters: list[dict[str, Any]]) -> None:
    table = Table(box=SIMPLE_HEAD)
    for column in ("parameter", "value", "95 % from", "to", "unit", "flags"):
        words = column in ("parameter", "unit", "flags")
        table.add_column(column, justify="left" if words else "right")
    for entry in parameters:
        table.add_row(
            entry["name"], *(f"{entry[key]:.4g}" for key in ("value", "low", "high")),
            entry["unit"], ", ".join(entry["flags"]),
        )  # fmt: skip
    console.print(table)
    for entry in parameters:
        if entry["helps"]:
            console.print(
                f"  {entry['name']}: {', '.join(entry['flags'])}; would help: {entry['helps']}"
            )
