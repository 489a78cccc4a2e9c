"""The page of a whole journey: before and after, the errors of each run, links and commands."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.strain import Comparison
from tirelib.report.error_sentences import fold_name
from tirelib.report.explanation import titled
from tirelib.report.figures.before_after import force_maps, maps, part_errors, run_errors
from tirelib.report.figures.compare_forces import force_curves
from tirelib.report.figures.compare_waveforms import waveforms
from tirelib.report.figures.waterfall import waterfall_of
from tirelib.report.page import Part, Table, number, unit_name
from tirelib.report.parts_page import write_parts_page

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
    links = [(page["title"], page["path"]) for page in told["pages"]]
    return write_parts_page(
        folder,
        "index",
        parts_of(journey),
        title=TITLE,
        summary=_summary(told),
        messages=told["messages"],
        lines=titled(told["explanation"]),
        links=links,
        commands=told["commands"],
    )


def _summary(told: Mapping[str, Any]) -> str:
    added = ", ".join(told["added"]) or "nothing"
    return f"Campaign {told['campaign']}, {told['quantity']}. Added to the model: {added}."


def parts_of(journey: Journey) -> list[Part]:
    """Return the parts of the page."""
    before, after = journey.before, journey.after
    if isinstance(before, ForceComparison) or isinstance(after, ForceComparison):
        assert isinstance(before, ForceComparison)  # noqa: S101 - both are of one quantity
        assert isinstance(after, ForceComparison)  # noqa: S101
        curves, where, errors = (
            force_curves(before, after),
            force_maps(before, after),
            part_errors(journey.document),
        )
    else:
        curves, where = waveforms(before, after), maps(before, after)
        errors = run_errors(journey.steps, before.error.unit)
    fall = waterfall_of(journey.history, journey.document["quantity"])
    return [
        Part(
            "The error, step by step",
            "error",
            tables=[_table(journey)],
            plots=[fall] if fall is not None else [],
        ),
        Part(
            "Each part of the measurements, before and after",
            "runs",
            tables=_held_out(journey),
            plots=errors,
        ),
        Part("Measured, before and after", "curves", plots=curves),
        Part("Where the model fails, before and after", "maps", plots=where),
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
