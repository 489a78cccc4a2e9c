"""``tirelib compare``: where a model fails."""

from pathlib import Path

import click

from tirelib.campaign import read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    NEW_FOLDER,
    output,
    progress_bar,
    write_json,
)
from tirelib.cli.options import effects_option, json_option, model_option, quantity_option

_EXAMPLE = """\b
Examples:
  tirelib rig --plan straight --out build/out/straight
  tirelib identify build/out/straight --out build/out/M.toml
  tirelib compare build/out/straight --model build/out/M.toml --out build/out/compared
  tirelib compare build/out/set1 --model build/out/M.toml --quantity Fy --json build/out/Fy.json

\b
DIR/index.html holds everything in one file; comparison.md and comparison.json hold the same as
text and as numbers. Errors are in units of the noise between repeated runs. Exit code 2: bad input.
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
@json_option()
def compare(
    folder: Path,
    model_name: str,
    quantity: str | None,
    effect_files: tuple[Path, ...],
    out: Path | None,
    json_file: Path | None,
) -> None:
    """Compare a model with CAMPAIGN and show where it fails."""
    from tirelib.compare import compare as compare_model
    from tirelib.compare.document import comparison_document
    from tirelib.model.registration import registered_effects
    from tirelib.parameters import read_tire

    catalogue = registered_effects(effect_files)
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    with progress_bar("comparing") as progress:
        found = compare_model(campaign, file, quantity, effects=catalogue, progress=progress)
    document = comparison_document(found)
    console = output()
    console.print(_answer(document))
    for line in (*document["statements"], *document["messages"]):
        console.print(f"  {line}")
    targets = [path for path in (json_file, out and out / "comparison.json") if path]
    if out is not None:
        from tirelib.report.comparison import write_comparison

        for path in write_comparison(found, out):
            console.print(f"written: {path}")
    for path in targets:
        write_json(path, document)
        console.print(f"written: {path}")


def _answer(document: dict[str, object]) -> str:
    unit, error, noise = document["unit"], document["error"], document["noise"]
    numbers = (
        f"{document['residual_rms']:.4g} of {document['measured_rms']:.4g} {unit} rms are not "
        "explained"
    )
    if isinstance(error, float) and error == error:
        numbers += f"; error {error:.2f} in units of the noise ({noise:.3g} {unit})"
    return f"{document['campaign']}, {document['quantity']}: {document['verdict']}; {numbers}"
