"""``tirelib compare``: where a model fails."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FILE,
    NEW_FOLDER,
    output,
    say_written,
    write_document,
)
from tirelib.cli.options import effects_option, json_option, model_option, quantity_option
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import ParameterError

if TYPE_CHECKING:
    from tirelib.inference.compare.forces import ForceComparison
    from tirelib.inference.compare.strain import Comparison

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml
  tirelib compare straight --model M.toml --out compared
  tirelib compare straight --model M.toml --trace sidewall_load=0.2 --data traces.npz
  tirelib rig --plan set1 --out cornering
  tirelib identify cornering --out M-forces.toml
  tirelib compare cornering --model M-forces.toml --quantity Fy --json Fy.json

\b
DIR/index.html holds everything in one file; comparison.md and comparison.json hold the same as
text and as numbers. Errors are in units of the noise between repeated runs. Exit code 2: bad input.
A trace is the difference, model less measured, that an effect of this strength would leave if the
measured tire had it and the model did not.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@model_option
@quantity_option
@effects_option
@click.option(
    "--out",
    "out",
    metavar="DIR",
    type=NEW_FOLDER,
    help="Folder for index.html, comparison.md and comparison.json.",
)
@click.option(
    "--data",
    "data_file",
    metavar="FILE.npz",
    type=NEW_FILE,
    help="Write what the plots are drawn from: arrays in the units of the plots (numpy).",
)
@click.option(
    "--trace",
    "traces",
    metavar="EFFECT=STRENGTH",
    multiple=True,
    help="With --data: also the trace of an effect at a strength; several components of a "
    "strength are separated by commas. May be given several times.",
)
@json_option()
@progress_options
def compare(
    folder: Path,
    model_name: str,
    quantity: str | None,
    effect_files: tuple[Path, ...],
    out: Path | None,
    data_file: Path | None,
    traces: tuple[str, ...],
    json_file: Path | None,
) -> None:
    """Compare a model with CAMPAIGN and show where it fails."""
    from tirelib.core.parameters import read_tire
    from tirelib.journey import compare as compare_model
    from tirelib.model.registration import registered_effects

    catalogue = registered_effects(effect_files)
    planted = [_trace(given) for given in traces]
    if planted and data_file is None:
        raise ParameterError("--trace is written by --data FILE.npz only; give both")
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    with progress_bar("comparing") as progress:
        found = compare_model(campaign, file, quantity, effects=catalogue, progress=progress)
        if data_file is not None:
            from tirelib.inference.compare.plot_data import plot_data, write_plot_data

            data = plot_data(found, campaign, file, planted, catalogue, progress=progress)
    if quantity is None and found.quantity != "strain":
        output().print(
            f"{found.quantity} is compared: of the forces that were measured it has the largest "
            "error; --quantity chooses another"
        )
    write_told(found, out, json_file)
    if data_file is not None:
        write_plot_data(data_file, data)
        say_written(data_file)


def write_told(
    found: "Comparison | ForceComparison", out: Path | None, json_file: Path | None
) -> dict[str, Any]:
    """Say a comparison, write its page and its numbers, and return these."""
    from tirelib.inference.compare.document import comparison_document

    document = comparison_document(found)
    console = output()
    console.print(_answer(document))
    for line in (*document["statements"], *document["messages"]):
        console.print(f"  {line}")
    if out is not None:
        from tirelib.report.comparison import write_comparison

        say_written(*write_comparison(found, out))
    write_document(document, json_file, out and out / "comparison.json")
    return document


def _trace(given: str) -> tuple[str, tuple[float, ...]]:
    """Return name and strength of an effect."""
    name, _, numbers = given.partition("=")
    try:
        return name, tuple(float(number) for number in numbers.split(","))
    except ValueError:
        raise ParameterError(
            f"--trace {given}: EFFECT=STRENGTH is needed, for instance sidewall_load=0.2; correct "
            "the strength"
        ) from None


def _answer(document: dict[str, object]) -> str:
    unit, noise = document["unit"], document["noise"]
    numbers = (
        f"{document['residual_rms_raw']:.4g} of {document['measured_rms']:.4g} {unit} rms are left"
    )
    if document["quantity"] == "strain":
        numbers += ", errors of the set points included"
    if document["error_unit"] == "noise":
        error = f"error {document['error']:.4g} times the noise ({noise:.3g} {unit})"
        numbers = f"{error}; {numbers}"
    return f"{document['campaign']}, {document['quantity']}: {document['verdict']}; {numbers}"
