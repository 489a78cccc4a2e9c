"""``tirelib identify``: the tire's parameters from a campaign, with intervals and flags."""

import os
import shlex
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from tirelib.campaign import Campaign, read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FILE,
    NEW_FOLDER,
    new_table,
    output,
    say_written,
    write_document,
)
from tirelib.cli.options import json_option
from tirelib.cli.progress import is_verbose, progress_bar, progress_options

if TYPE_CHECKING:
    from tirelib.core.parameters import TireFile
    from tirelib.inference.identify.whole import Whole

BASES = ("plain", "dissertation")
GIVES_WAY = 10
"""By how much an identification gives way, after its first ring is written, to programs that work
with that ring (`os.nice`). By the weights of Linux such a program gets 90 % of a processor that
both want; with half (5) it gets 75 %, with double (19 at most) 99 %. No number depends on it."""

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml --report identified --json identified.json
  tirelib simulate --model M.toml --load 4000 --speed 80 --out simulated

\b
The ring is fitted to straight runs with strain, the brush to forces over slip; either alone is
enough. Intervals are 95 % and include the structural misfit. "not_identifiable" marks parameters
whose interval is wider than 25 % to either side, with the test that would determine them. Exit code
1: no parameter could be identified, or the straight runs gave no ring.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="DIR", type=CAMPAIGN)
@click.option(
    "--tire",
    "tire_file",
    metavar="T.toml|NAME",
    help="Tire file with start values and priors. Default: the campaign's geometry and literature "
    "values.",
)
@click.option(
    "--base",
    type=click.Choice(BASES),
    default="plain",
    show_default=True,
    help="Base model: `plain` includes belt shear, section inertia and a tread that sticks and "
    "hardens; in the dissertation's ring these are effects to be found.",
)
@click.option(
    "--out",
    "out",
    metavar="M.toml",
    type=NEW_FILE,
    required=True,
    help="File for the identified model, which the other commands read.",
)
@click.option(
    "--first",
    "first",
    metavar="FIRST.toml",
    type=NEW_FILE,
    help="File for the ring as soon as it is fitted, before intervals, advice and forces. `tirelib "
    "compare` reads it and gives what it gives of M.toml.",
)
@click.option(
    "--report",
    "report",
    metavar="DIR",
    type=NEW_FOLDER,
    help="Folder for identification.html and identification.md.",
)
@json_option()
@progress_options
@click.pass_context
def identify(
    context: click.Context,
    folder: Path,
    tire_file: str | None,
    base: str,
    out: Path,
    first: Path | None,
    report: Path | None,
    json_file: Path | None,
) -> None:
    """Fit the base model, ring and brush, to DIR."""
    from tirelib.core.parameters import read_tire, write_tire
    from tirelib.inference.identify.document import whole_document
    from tirelib.inference.identify.whole import identify_whole

    start = read_tire(tire_file) if tire_file is not None else None
    campaign = read_campaign(folder)

    def found(ring: "TireFile") -> None:
        progress("the ring is fitted; its intervals follow")
        if first is not None:
            new = first.with_name(f".{first.name}.new")
            write_tire(ring, new, "tirelib-model/1")
            new.replace(first)  # whoever waits for it never reads a part
            if hasattr(os, "nice"):
                os.nice(GIVES_WAY)

    with progress_bar("identifying") as progress:
        whole = identify_whole(campaign, start, base=base, progress=progress, found=found)
    document = whole_document(campaign, whole) | _errors(campaign, whole)
    write_tire(whole.file, out, "tirelib-model/1")
    console = output()
    if whole.ring_failed:
        click.echo(f"Warning: the straight runs gave {whole.ring_failed}", err=True)
    warned = whole.ring.notes if whole.ring is not None else ()
    for note in warned:
        click.echo(f"Warning: {note}", err=True)
    if whole.ring is not None:
        _say_ring(console, document, len(campaign.header.gage_lateral))
    if document["brush"] is not None:
        _say_brush(console, document)
    if document["ring_pressure"] is not None:
        _say_pressure(console, document["ring_pressure"])
    for reason in document["reasons"]:
        if reason not in warned:
            console.print(f"  {reason}")
    say_written(out)
    write_document(document, json_file)
    following = [
        shlex.join(["tirelib", verb, str(folder), "--model", str(out), "--out", f"{verb}d"])
        for verb in ("compare", "diagnose")
    ]
    if report is not None:
        from tirelib.report.identification import write_identification

        say_written(*write_identification(document, report, commands=following))
    console.print(f"next: {following[0]}")
    console.print(f"      {following[1]}")
    brush = document["brush"]
    every = [*document["parameters"], *(brush["parameters"] if brush else [])]
    told = any("not_identifiable" not in entry["flags"] for entry in every)
    context.exit(0 if told and not whole.ring_failed else 1)


def _errors(campaign: Campaign, whole: "Whole") -> dict[str, Any]:
    """Return the errors of the identified model, computed as in every other command."""
    from tirelib.inference.compare.error import error_of
    from tirelib.inference.compare.forces import compare_forces
    from tirelib.inference.compare.model import model_of

    told: dict[str, Any] = {}
    if whole.ring is not None:
        told |= error_of(whole.ring.runs, model_of(whole.file)).told
    if whole.brush is not None:
        every = [compare_forces(campaign, whole.file, name) for name in whole.brush.fit.rmse]
        told["force_errors"] = {found.quantity: found.told for found in every}
    return told


def _say_ring(console: Console, document: dict[str, Any], gages: int) -> None:
    console.print(
        f"{document['campaign']}: {len(document['runs'])} straight runs, {len(document['gages'])} "
        f"of {gages} gages averaged; the residual is {document['rms_ustrain']:.0f} of "
        f"{document['strain_rms_ustrain']:.0f} microstrain rms; error {document['error']:.3g} "
        f"{'times the noise' if document['error_unit'] == 'noise' else 'microstrain'}"
    )
    _say_parameters(console, document["parameters"])
    stiffness = document["vertical_stiffness"]
    if stiffness["measured"] is not None:
        console.print(
            f"  vertical stiffness at {stiffness['load_N']:.0f} N: model "
            f"{stiffness['model']:.1f}, measured {stiffness['measured']:.1f} N/mm"
        )


def _say_brush(console: Console, document: dict[str, Any]) -> None:
    brush, forces = document["brush"], document["forces"]
    left = ", ".join(
        f"{name} {entry['rmse']:.3g} {entry['unit']} ({entry['rmse_percent_of_peak']:.1f} % of the "
        f"peak, R2 {entry['r2']:.4f})"
        for name, entry in forces.items()
        if isinstance(entry, dict)
    )
    console.print(
        f"{document['campaign']}: brush fitted to {forces['points']} points; residuals: {left}"
    )
    _say_parameters(console, brush["parameters"])
    table = new_table(
        *("stiffness over", "load N", "bar", "value", "95 % from", "to", "unit"),
        words=("stiffness over", "unit"),
    )
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
    ring = "the ring" if document["parameters"] else "the ring of the given tire"
    where = {"ring": ring, "Mz": "Mz", "assumed": "an assumption"}[brush["half_length_from"]]
    console.print(
        f"  contact length from {where}; the values hold at the median load, "
        f"{brush['reference']['load_N']:.0f} N"
    )
    for note in brush["notes"]:
        console.print(f"  {note}")


def _say_pressure(console: Console, found: dict[str, Any]) -> None:
    console.print(
        "lateral force with the ring's pressure and with a parabola, rms error in N (held-out "
        "points in brackets)"
    )
    table = new_table(
        *("by", "from", "to", "points", "ring", "parabola", "better"), words=("by", "better")
    )
    for row in found["table"]:
        ends = ("", "") if row["by"] == "all" else (f"{row['low']:.4g}", f"{row['high']:.4g}")
        unit = f" {row['range_unit']}" if row["range_unit"] else ""
        table.add_row(
            row["by"].replace("_", " ") + unit,
            *ends,
            str(row["points"]),
            *(
                f"{row[f'{k}_rmse']:.0f} ({row[f'{k}_rmse_unseen']:.0f})"
                for k in ("ring", "parabola")
            ),
            row["better"],
        )
    console.print(table)


def _say_parameters(console: Console, parameters: list[dict[str, Any]]) -> None:
    """Print what the runs determine; what they do not is named, and printed with ``-v``."""
    known = [entry for entry in parameters if "not_identifiable" not in entry["flags"]]
    console.print(_table(known if not is_verbose() else parameters))
    unknown = [entry for entry in parameters if entry not in known]
    if unknown:
        names = ", ".join(entry["name"] for entry in unknown)
        console.print(
            f"  {len(unknown)} parameters are not determined (the 95 % interval reaches further "
            f"than 25 % to either side, or is hardly narrower than the prior): {names}"
        )
    helped = [entry for entry in parameters if entry["helps"]]
    if is_verbose():
        for entry in helped:
            console.print(
                f"  {entry['name']}: {', '.join(entry['flags'])}; would help: {entry['helps']}"
            )
    elif helped:
        console.print(
            "  -v prints their values, and the test that would help; --report DIR draws them"
        )


def _table(parameters: list[dict[str, Any]]) -> Table:
    table = new_table(
        *("parameter", "value", "95 % from", "to", "unit", "flags"),
        words=("parameter", "unit", "flags"),
    )
    for entry in parameters:
        table.add_row(
            entry["name"],
            *(f"{entry[key]:.4g}" for key in ("value", "low", "high")),
            entry["unit"],
            ", ".join(entry["flags"]),
        )
    return table
