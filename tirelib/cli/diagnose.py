"""``tirelib diagnose``: which effect a model lacks."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from tirelib.campaign import Campaign, read_campaign
from tirelib.cli.common import (
    CAMPAIGN,
    output,
    write_json,
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
from tirelib.errors import TirelibError
from tirelib.journey import explains_forces

if TYPE_CHECKING:
    from tirelib.effects import Effect
    from tirelib.parameters import TireFile

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
    from tirelib.model.registration import registered_effects
    from tirelib.parameters import read_tire
    from tirelib.report.explanation import explained

    catalogue = registered_effects(effect_files)
    file = read_tire(model_name)
    campaign = read_campaign(folder)
    with progress_bar("diagnosing") as progress:
        if explains_forces(quantity, campaign, file):
            told, document = of_forces(campaign, file, catalogue, quantity, false_alarm, progress)
        else:
            told, document = _of_strain(campaign, file, catalogue, false_alarm, progress)
    explanation = explained(document, model_name, str(folder))
    document["explanation"] = asdict(explanation)
    _say(document, explanation.lines)
    console = output()
    targets = [path for path in (json_file, out and out / "diagnosis.json") if path]
    if out is not None:
        from tirelib.report.diagnosis import write_diagnosis

        for path in write_diagnosis(told, document, out, file.extra.get("history", [])):
            console.print(f"written: {path}")
    for path in targets:
        write_json(path, document)
        console.print(f"written: {path}")


def _of_strain(
    campaign: Campaign,
    file: "TireFile",
    catalogue: Mapping[str, "Effect"],
    false_alarm: float,
    progress: Callable[[str], None],
) -> tuple[Any, dict[str, Any]]:
    from tirelib.compare.model import model_of
    from tirelib.diagnose.diagnose import diagnose as diagnose_model
    from tirelib.diagnose.document import assess, diagnosis_document
    from tirelib.identify.campaign_data import straight_runs
    from tirelib.planning.document import next_test_document
    from tirelib.waveforms import measure_waveforms

    model = model_of(file, catalogue)
    used = [each for each in model.used if each.effect.hook != "brush"]
    runs = straight_runs(measure_waveforms(campaign, progress=progress))
    found = diagnose_model(
        runs,
        model.values,
        list(catalogue.values()),
        effects=[each.effect for each in used],
        strengths=[np.atleast_1d(np.asarray(each.strength, dtype=float)) for each in used],
        false_alarm=false_alarm,
        progress=progress,
    )
    told = assess(found, model, progress=progress)
    document = diagnosis_document(told)
    if document["verdict"] == "indistinguishable":
        try:
            document["next_test"] |= next_test_document(
                document, found.verdict.hypotheses, catalogue, progress=progress
            )
        except TirelibError as error:
            document["messages"].append(f"no next test: {error}")
    return told, document


def of_forces(
    campaign: Campaign,
    file: "TireFile",
    catalogue: Mapping[str, "Effect"],
    quantity: str | None,
    false_alarm: float,
    progress: Callable[[str], None],
) -> tuple[Any, dict[str, Any]]:
    """Return a diagnosis of forces, and its document."""
    from tirelib.diagnose.forces.assess import assess_forces, force_case
    from tirelib.diagnose.forces.document import force_diagnosis_document

    case = force_case(campaign, file, catalogue, quantity)
    told = assess_forces(case, list(catalogue.values()), false_alarm=false_alarm, progress=progress)
    return told, force_diagnosis_document(told)


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
    for step in document.get("steps", []):
        console.print(
            f"  with {step['effect']}: error {step['error']:.3g}, held out "
            f"{step['heldout_error']:.3g}"
        )
    for line in document["messages"]:
        console.print(f"  {line}")
    console.print(_table(document["candidates"][:SHOWN]))


def _table(candidates: list[dict[str, Any]]) -> Table:
    table = Table(box=SIMPLE_HEAD)
    longest = max((len(entry["effect"]) for entry in candidates), default=0)
    for column in (
        "effect",
        "level",
        "score / threshold",
        "strength",
        "std",
        "unit",
        "in range",
        "error after",
        "held out",
        "twins",
    ):
        words = column in ("effect", "level", "unit", "in range", "twins")
        # a name that is cut short cannot be added
        width = longest if column == "effect" else None
        table.add_column(column, justify="left" if words else "right", min_width=width)
    for entry in candidates:
        held = entry["heldout_error_after"]
        table.add_row(
            entry["effect"],
            entry["level"],
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
