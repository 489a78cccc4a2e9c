"""``tirelib diagnose``: which effect a model lacks."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.table import Table

from tirelib.campaign import Campaign, read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    new_table,
    output,
    say_written,
    write_document,
)
from tirelib.cli.options import (
    effects_option,
    false_alarm_option,
    json_option,
    model_option,
    quantity_option,
    report_option,
)
from tirelib.cli.progress import progress_bar, progress_options
from tirelib.core.errors import TirelibError

if TYPE_CHECKING:
    from tirelib.core.parameters import TireFile
    from tirelib.effects import Effect
    from tirelib.inference.diagnose.assess import Assessment, ForceAssessment

_EXAMPLE = """\b
Examples:
  tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
  tirelib identify straight --out M.toml
  tirelib diagnose straight --model M.toml --out diagnosed
  tirelib diagnose straight --model M.toml --effects mine.py --json D.json
  tirelib rig --plan set1 --out cornering
  tirelib identify cornering --out M-forces.toml
  tirelib diagnose cornering --model M-forces.toml --quantity Fy --out diagnosed-Fy

\b
Verdicts: none, named, form_inadequate (right effect, wrong law), indistinguishable (several would
do), unknown (something that no effect of the catalogue explains). An effect is an alarm if it is
named, and a hint if it may stand in the place of one that is.
Exit code: 0 whatever the verdict, 2 bad input.
"""
SHOWN = 8


@click.command(epilog=_EXAMPLE)
@click.argument("folder", metavar="CAMPAIGN", type=CAMPAIGN)
@model_option
@quantity_option
@effects_option
@false_alarm_option
@report_option("diagnosis")
@json_option()
@progress_options
def diagnose(
    folder: Path,
    model_name: str,
    quantity: str | None,
    effect_files: tuple[Path, ...],
    false_alarm: float,
    out: Path | None,
    json_file: Path | None,
) -> None:
    """Tell which physical effect the model lacks in CAMPAIGN."""
    from tirelib.core.parameters import read_tire
    from tirelib.model.registration import registered_effects

    catalogue = registered_effects(effect_files)
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    with progress_bar("diagnosing") as progress:
        told, document = diagnosed(campaign, file, catalogue, quantity, false_alarm, progress)
    write_told(told, document, model_name, folder, file, out, json_file, effect_files)


def write_told(
    told: "Assessment | ForceAssessment",
    document: dict[str, Any],
    model_name: str,
    folder: Path,
    file: "TireFile",
    out: Path | None,
    json_file: Path | None,
    effect_files: Sequence[Path] = (),
) -> None:
    """Say a diagnosis of a model in four lines and more, and write its page and its numbers."""
    from tirelib.report.explanation import explained, titled

    document["explanation"] = explained(document, model_name, str(folder), effect_files)._asdict()
    _say(document, titled(document["explanation"]))
    if out is not None:
        from tirelib.report.diagnosis import write_diagnosis

        say_written(*write_diagnosis(told, document, out, file.extra.get("history", [])))
    write_document(document, json_file, out and out / "diagnosis.json")


def diagnosed(
    campaign: Campaign,
    file: "TireFile",
    catalogue: Mapping[str, "Effect"],
    quantity: str | None,
    false_alarm: float,
    progress: Callable[[str], None],
) -> tuple["Assessment | ForceAssessment", dict[str, Any]]:
    """Return a diagnosis, and its document with the run that distinguishes what it cannot."""
    from tirelib.inference.diagnose.assess import Assessment
    from tirelib.inference.diagnose.document import diagnosis_document
    from tirelib.inference.planning.document import next_test_document
    from tirelib.journey import diagnose as diagnose_model

    told = diagnose_model(
        campaign, file, quantity, effects=catalogue, false_alarm=false_alarm, progress=progress
    )
    document = diagnosis_document(told)
    if isinstance(told, Assessment) and document["verdict"] == "indistinguishable":
        hypotheses = told.diagnosis.verdict.hypotheses
        try:
            document["next_test"] |= next_test_document(
                document, hypotheses, catalogue, progress=progress
            )
        except TirelibError as error:
            document["messages"].append(f"no next test: {error}")
    return told, document


def _say(document: dict[str, Any], lines: Sequence[tuple[str, str]]) -> None:
    from tirelib.report.page import unit_name

    console = output()
    named = document["named"]
    unit = unit_name(document["error_unit"])
    fall = f" -> {document['error_after']:.3g}" if named else ""
    console.print(
        f"{document['campaign']}, {document['quantity']}: {document['verdict']}"
        f"{': ' + ', '.join(named) if named else ''}; error {document['error_before']:.3g}"
        f"{fall} [{unit}], floor {document['floor']:.3g}"
    )
    for what, said in lines:
        console.print(f"  {what}: {said}")
    for place, step in enumerate(document.get("steps", [])):
        console.print(
            f"  {'then +' if place else 'with'} {step['effect']}: error {step['error']:.3g}, held "
            f"out {step['heldout_error']:.3g}"
        )
    for line in document["messages"]:
        console.print(f"  {line}")
    console.print(_table(document))


def _table(document: dict[str, Any]) -> Table:
    from tirelib.report.explanation import mark_of

    every = document["candidates"]
    candidates = [
        entry
        for place, entry in enumerate(every)
        if place < SHOWN or mark_of(document, entry) != entry["level"]
    ]
    table = new_table(
        *("effect", "level", "score / threshold", "strength", "std", "unit", "in range"),
        *("error after", "held out", "twins"),
        words=("effect", "level", "unit", "in range", "twins"),
    )
    # a name that is cut short cannot be added
    table.columns[0].min_width = max((len(entry["effect"]) for entry in candidates), default=0)
    for entry in candidates:
        held = entry["heldout_error_after"]
        table.add_row(
            entry["effect"],
            mark_of(document, entry),
            f"{entry['score'] / entry['threshold']:.2f}",
            _numbers(entry["strength"]),
            _numbers(entry["std"]),
            entry["unit"],
            "yes" if entry["in_range"] else "no",
            f"{entry['error_after']:.3g}",
            f"{held:.3g}" if np.isfinite(held) else "-",
            ", ".join(f"{t['effect']} {t['angle_deg']:.0f} deg" for t in entry["twins"]),
        )
    return table


def _numbers(value: float | list[float]) -> str:
    return ", ".join(f"{x:.3g}" for x in (value if isinstance(value, list) else [value]))
