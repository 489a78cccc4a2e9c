"""``tirelib diagnose``: which effect a model lacks."""

from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.campaign import read_campaign
from tirelib.cli.common import CAMPAIGN, FILE, output, progress_bar, write_json
from tirelib.errors import ParameterError

_EXAMPLE = """\b
Examples:
  tirelib rig --plan straight --out build/out/straight
  tirelib identify build/out/straight --out build/out/M.toml
  tirelib diagnose build/out/straight --model build/out/M.toml --out build/out/diagnosed
  tirelib diagnose build/out/straight --model build/out/M.toml --effects mine.py --json D.json

\b
Verdicts: none, named, form_inadequate (right effect, wrong law), indistinguishable (several would
do), unknown (something that no effect of the catalogue explains). An effect is an alarm when its
score is three times the largest of variants of the model without any effect; a hint from once on.
Exit code: 0 whatever the verdict, 2 bad input.
"""
SHOWN = 8


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@click.option("--model", "model_name", metavar="M.toml|NAME", required=True,
              help="Model that `tirelib identify` or `tirelib add` wrote.")  # fmt: skip
@click.option("--quantity", metavar="strain", default="strain", show_default=True,
              help="Measured quantity to explain.")  # fmt: skip
@click.option("--effects", "effect_files", metavar="FILE.py", type=FILE, multiple=True,
              help="Effects of your own; may be given again.")  # fmt: skip
@click.option(
    "--members",
    metavar="N",
    type=click.IntRange(min=4),
    default=100,
    show_default=True,
    help="Variants of the model that the threshold is from.",
)
@click.option("--seed", metavar="N", type=int, default=0, show_default=True,
              help="Of the variants.")  # fmt: skip
@click.option("--out", "out", metavar="DIR", type=click.Path(path_type=Path, file_okay=False),
              help="Write diagnosis.html, diagnosis.md and diagnosis.json.")  # fmt: skip
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write the numbers as JSON.")
def diagnose(
    folder: Path,
    model_name: str,
    quantity: str,
    effect_files: tuple[Path, ...],
    members: int,
    seed: int,
    out: Path | None,
    json_file: Path | None,
) -> None:
    """Tell which physical effect the model lacks in CAMPAIGN."""
    from tirelib.compare.model import model_of
    from tirelib.diagnose.diagnose import diagnose as diagnose_model
    from tirelib.diagnose.document import assess, diagnosis_document
    from tirelib.effects.load import all_effects
    from tirelib.identify.campaign_data import straight_runs
    from tirelib.parameters import read_tire
    from tirelib.waveforms import measure_waveforms

    strain_only(quantity)
    catalogue = all_effects(effect_files)
    model = model_of(read_tire(model_name), catalogue)
    used = [each for each in model.used if each.effect.hook != "brush"]
    campaign = read_campaign(folder)
    with progress_bar("diagnosing") as progress:
        runs = straight_runs(measure_waveforms(campaign, progress=progress))
        found = diagnose_model(
            runs, model.values, list(catalogue.values()),
            effects=[each.effect for each in used],
            strengths=[np.atleast_1d(np.asarray(each.strength, dtype=float)) for each in used],
            members=members, seed=seed, progress=progress,
        )  # fmt: skip
        told = assess(found, seed=seed, progress=progress)
    document = diagnosis_document(told)
    console = output()
    unit = "noise" if told.unit.known else "microstrain"
    console.print(
        f"{document['campaign']}, strain: {told.verdict}"
        f"{': ' + ', '.join(told.named) if told.named else ''}; error {told.error_before:.3g}"
        f"{f' -> {told.error_after:.3g}' if told.named else ''} [{unit}], floor {told.floor:.3g}"
    )
    for line in document["messages"]:
        console.print(f"  {line}")
    console.print(_table(document["candidates"][:SHOWN]))
    console.print(f"  next: {document['next_test']['what']}")
    targets = [path for path in (json_file, out and out / "diagnosis.json") if path]
    if out is not None:
        from tirelib.report.diagnosis import write_diagnosis

        for path in write_diagnosis(told, out):
            console.print(f"written: {path}")
    for path in targets:
        write_json(path, document)
        console.print(f"written: {path}")


def strain_only(quantity: str) -> None:
    """Refuse a quantity that cannot be diagnosed.

    Raises
    ------
    ParameterError
        For any quantity but strain.
    """
    if quantity != "strain":
        raise ParameterError(
            f"--quantity {quantity}: not available; only strain can be diagnosed; leave the "
            "option out, or look at forces with `tirelib compare --quantity`"
        )


def _table(candidates: list[dict[str, Any]]) -> Table:
    table = Table(box=SIMPLE_HEAD)
    for column in ("effect", "level", "score/threshold", "strength", "std", "unit", "in range",
                   "error after", "held out", "twins"):  # fmt: skip
        words = column in ("effect", "level", "unit", "in range", "twins")
        table.add_column(column, justify="left" if words else "right")
    for entry in candidates:
        held = entry["heldout_error_after"]
        table.add_row(
            entry["effect"], entry["level"], f"{entry['score'] / entry['threshold']:.2f}",
            _numbers(entry["strength"]), _numbers(entry["std"]), entry["unit"],
            "yes" if entry["in_range"] else "no", f"{entry['error_after']:.3g}",
            f"{held:.3g}" if np.isfinite(held) else "-",
            ", ".join(f"{t['effect']} {t['angle_deg']:.0f} deg" for t in entry["twins"]),
        )  # fmt: skip
    return table


def _numbers(value: float | list[float]) -> str:
    return ", ".join(f"{x:.3g}" for x in (value if isinstance(value, list) else [value]))
