"""Pages of effects that are added: of one, and of a whole journey from the first model on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.strain import Comparison
from tirelib.report.error_sentences import error_line, fold_name
from tirelib.report.explanation import said_strength, titled
from tirelib.report.figures.before_after import maps, part_errors, run_errors, waterfall_of
from tirelib.report.figures.compare_forces import curve_plots
from tirelib.report.figures.compare_heat import waveform_plots
from tirelib.report.page import Part, Table, number, unit_name, write_parts_page

TITLE = "What the model lacked"


@dataclass(frozen=True, slots=True)
class Journey:
    """Results of the steps of a journey.

    Attributes
    ----------
    before, after : Comparison or ForceComparison
        Comparisons of the first and of the last model; the same if nothing was added.
    document : mapping
        ``tirelib-explanation/1``.
    steps : sequence of mapping
        ``tirelib-extension/1`` of each effect that was added.
    history : sequence of mapping
        History of the last model.
    """

    before: Comparison | ForceComparison
    after: Comparison | ForceComparison
    document: Mapping[str, Any]
    steps: Sequence[Mapping[str, Any]]
    history: Sequence[Mapping[str, Any]]


def write_journey(journey: Journey, folder: Path) -> tuple[Path, Path]:
    """Write ``index.html`` and ``index.md`` into a folder; return their paths."""
    told = journey.document
    return write_parts_page(
        folder,
        "index",
        parts_of(journey),
        title=TITLE,
        summary=f"Campaign {told['campaign']}, {told['quantity']}. Added to the model: "
        f"{', '.join(told['added']) or 'nothing'}.",
        messages=told["messages"],
        lines=titled(told["explanation"]),
        links=[(page["title"], page["path"]) for page in told["pages"]],
        commands=told["commands"],
    )


def parts_of(journey: Journey) -> list[Part]:
    """Return the parts of the page."""
    before, after = journey.before, journey.after
    if isinstance(before, ForceComparison) and isinstance(after, ForceComparison):
        curves, errors = curve_plots(before, after), part_errors(journey.document)
    elif isinstance(before, Comparison) and isinstance(after, Comparison):
        curves = waveform_plots(before, after)
        errors = run_errors(journey.steps, before.error.unit)
    return [
        Part(
            "The error, step by step",
            "error",
            tables=[_table(journey)],
            plots=waterfall_of(journey.history, journey.document["quantity"]),
        ),
        Part(
            "Each part of the measurements, before and after",
            "runs",
            tables=_held_out(journey),
            plots=errors,
        ),
        Part("Measured, before and after", "curves", plots=curves),
        Part("Where the model fails, before and after", "maps", plots=maps(before, after)),
    ]


def _table(journey: Journey) -> Table:
    told = journey.document
    unit = unit_name(told["error_unit"])
    raw = unit_name(told["residual_rms_unit"])
    return Table.of(
        "The models",
        told["steps"],
        {
            "model": lambda step: step["model"],
            "what it has": lambda step: step["what"],
            f"error [{unit}]": lambda step: number(step["error"], 3),
            f"held out [{unit}]": lambda step: number(step["heldout_error"], 3),
            f"rms left [{raw}]": lambda step: number(step["residual_rms_raw"], 3),
        },
        texts=2,
        note="Held out: the error on runs that were not used in the fit.",
    )


def _held_out(journey: Journey) -> list[Table]:
    """Return what was held out of the fits, of the first model and of the last."""
    told = journey.document
    unit = unit_name(told["error_unit"])
    if not told["held_out"]:
        return []
    return [
        Table.of(
            "Held out of the fit",
            told["held_out"],
            {
                "held out": fold_name,
                f"before [{unit}]": lambda fold: number(fold["error_before"], 3),
                f"after [{unit}]": lambda fold: number(fold["error_after"], 3),
            },
        )
    ]


def write_extension(told: Mapping[str, Any], folder: Path) -> tuple[Path, Path]:
    """Write ``extension.html`` and ``extension.md`` into a folder; return their paths.

    Parameters
    ----------
    told : mapping
        ``tirelib-extension/1``.
    """
    done = {"add": "Added", "remove": "Removed"}[told["action"]]
    parts = [
        Part(
            "The error, step by step",
            "error",
            tables=[_step_errors(told)],
            plots=waterfall_of(told["history"], told["quantity"]),
        ),
        Part(
            "Each part of the measurements, before and after",
            "runs",
            plots=[*part_errors(told), *run_errors([told], told["error_unit"])],
        ),
    ]
    return write_parts_page(
        folder,
        "extension",
        [part for part in parts if part.tables or part.plots],
        title=f"{done}: {told['effect']}",
        summary=f"Campaign {told['campaign']}, {told['quantity']}.",
        messages=told["messages"],
        lines=(
            (
                done,
                f"{told['effect']} ({told['title'].rstrip('.')}), strength {said_strength(told)}.",
            ),
            ("The error", error_line(told)),
        ),
    )


def _step_errors(told: Mapping[str, Any]) -> Table:
    unit = unit_name(told["error_unit"])
    rows = [
        ["given model, fitted runs", number(told["error_before"], 3), ""],
        [
            "parameters fitted again",
            number(told["error_refitted"], 3),
            number(told["error_after"], 3),
        ],
        *(
            [
                f"held out of the fit: {fold_name(fold)}",
                number(fold["error_before"], 3),
                number(fold["error_after"], 3),
            ]
            for fold in told["held_out"]
        ),
        ["explained by noise and structure (floor)", "", number(told["floor"], 3)],
    ]
    return Table("Errors", ["", f"before [{unit}]", f"after [{unit}]"], rows)
