"""``tirelib features``: one row per turn and gage."""

from pathlib import Path
from typing import Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FILE,
    output,
    write_json,
)
from tirelib.cli.options import json_option, low_pass_options
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.documents import new_file
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag
from tirelib.core.version import __version__
from tirelib.measured.observations import Observations, observe
from tirelib.measured.signal import LowPass

FORMAT = "tirelib-features/1"

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --out straight
  tirelib features straight --out features.parquet

\b
One row per turn and gage, SI units, angles in rad from the middle of the centre
gage's contact, ISO 8855 axes. FILE may end in .parquet or .csv.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="DIR", type=CAMPAIGN)
@click.option(
    "--out",
    "target",
    metavar="FILE",
    type=NEW_FILE,
    required=True,
    help="Table to write, .parquet or .csv.",
)
@low_pass_options
@json_option("a summary")
@progress_options
def features(
    folder: Path, target: Path, order: float | None, cut_off: float | None, json_file: Path | None
) -> None:
    """Extract contact edges, peaks and integrals for every turn and gage of DIR."""
    from tirelib.measured.features.table import feature_frame, units  # with pandas

    if target.suffix not in (".parquet", ".csv"):
        raise FormatError(f"{target}: ends in {target.suffix!r}; allowed are .parquet and .csv")
    campaign = read_campaign(folder)
    with progress_bar("reading", len(campaign.plans)) as progress:
        observations = observe(
            [campaign], low_pass=make_low_pass(order, cut_off), progress=progress
        )
    table = feature_frame(observations.features, run=observations.run)
    table.attrs["tirelib"] = __version__  # a Parquet file keeps it
    with new_file(target):
        if target.suffix == ".csv":
            table.to_csv(target, index=False)
        else:
            table.to_parquet(target, index=False)
    summary = _summary(observations)
    console = output()
    console.print(
        f"{len(observations)} turns of {len(campaign.plans)} runs, "
        f"{observations.features.lateral.size} gages; {summary['usable']} turns without a fault"
    )
    for name, count in summary["flags"].items():
        console.print(f"  {count:5d} turns flagged {name}")
    console.print(f"written: {target}")
    if json_file is not None:
        write_json(
            json_file,
            {
                "format": FORMAT,
                "axes": "iso",
                "table": str(target),
                "units": dict(units()),
                **summary,
            },
        )


def make_low_pass(order: float | None, cut_off: float | None) -> LowPass | None:
    """Return the filter that the options ask for; None for the default."""
    if order is None and cut_off is None:
        return None
    return LowPass(cut_off=cut_off) if order is None else LowPass(order, cut_off)


def _summary(observations: Observations) -> dict[str, Any]:
    flags = observations.features.flags
    counts = {
        flag.name.lower(): int(((flags & int(flag)) != 0).sum()) for flag in TurnFlag if flag.name
    }
    return {
        "turns": len(observations),
        "usable": int(observations.usable.sum()),
        "flags": {name: count for name, count in counts.items() if count},
    }
