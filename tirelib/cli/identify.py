"""``tirelib identify``: the tire's parameters from a campaign, with intervals and flags."""

from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, output, progress_bar, write_json

_EXAMPLE = """\b
Examples:
  tirelib rig --plan straight --out build/out/straight
  tirelib identify build/out/straight --out build/out/M.toml --json build/out/identified.json
  tirelib simulate --model build/out/M.toml --load 4000 --speed 80 --out build/out/simulated

\b
Intervals are 95 % and hold the structural misfit of the ring; "not_identifiable" marks numbers
whose interval is wider than 25 % to either side, with the test that would tell them. Exit code 1:
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
    """Fit the base model to the straight runs of DIR."""
    from tirelib.identify.document import identification_document, model_file
    from tirelib.identify.identify import identify as identify_tire
    from tirelib.identify.identify import start_file
    from tirelib.identify.routes import follow_routes, routes_document
    from tirelib.parameters import read_tire, write_tire

    start = read_tire(tire_file) if tire_file is not None else None
    campaign = read_campaign(folder)
    with progress_bar("identifying") as progress:
        found = identify_tire(campaign, start, progress=progress)
        first = start_file(campaign.header, found.runs, start)
        routes = follow_routes(found.runs, first, progress=progress)
    document = identification_document(campaign, found) | routes_document(routes)
    write_tire(model_file(found, routes.damping), out, "tirelib-model/1")
    console = output()
    console.print(
        f"{campaign.header.name}: {len(document['runs'])} straight runs, "
        f"{len(document['gages'])} gages averaged; strain rms left {document['rms_ustrain']:.0f} "
        f"of {document['strain_rms_ustrain']:.0f} microstrain"
    )
    console.print(_table(document["parameters"]))
    for entry in document["parameters"]:
        if entry["helps"]:
            console.print(
                f"  {entry['name']}: {', '.join(entry['flags'])}; would help: {entry['helps']}"
            )
    stiffness = document["vertical_stiffness"]
    if stiffness["measured"] is not None:
        console.print(
            f"  vertical stiffness at {stiffness['load_N']:.0f} N: model "
            f"{stiffness['model']:.1f}, measured {stiffness['measured']:.1f} N/mm"
        )
    damping = routes.damping
    if damping is not None:
        flags = f" ({', '.join(damping.flags)})" if damping.flags else ""
        console.print(
            f"  damping {damping.value:.3f}, 95 % {damping.low:.3f} to {damping.high:.3f}{flags}; "
            "not in the model: `tirelib add sidewall_damping` puts it there"
        )
    for reason in routes.reasons:
        console.print(f"  {reason}")
    console.print(f"written: {out}")
    if json_file is not None:
        write_json(json_file, document)
        console.print(f"written: {json_file}")
    told = any("not_identifiable" not in entry["flags"] for entry in document["parameters"])
    context.exit(0 if told else 1)


def _table(parameters: list[dict[str, Any]]) -> Table:
    table = Table(box=SIMPLE_HEAD)
    for column in ("parameter", "value", "95 % from", "to", "unit", "flags"):
        words = column in ("parameter", "unit", "flags")
        table.add_column(column, justify="left" if words else "right")
    for entry in parameters:
        table.add_row(
            entry["name"], *(f"{entry[key]:.4g}" for key in ("value", "low", "high")),
            entry["unit"], ", ".join(entry["flags"]),
        )  # fmt: skip
    return table
