"""The page of one effect more or less: the waterfall, the errors of each run, what was held out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirelib.report.error_sentences import error_line, fold_name
from tirelib.report.explanation import said_strength
from tirelib.report.figures.before_after import part_errors, run_errors
from tirelib.report.figures.waterfall import waterfall_of
from tirelib.report.page import Part, Table, number, unit_name
from tirelib.report.parts_page import write_parts_page


def write_extension(told: Mapping[str, Any], folder: Path) -> tuple[Path, Path]:
    """Write ``extension.html`` and ``extension.md`` into a folder; return their paths.

    Parameters
    ----------
    told : mapping
        ``tirelib-extension/1``.
    """
    done = {"add": "Added", "remove": "Removed"}[told["action"]]
    fall = waterfall_of(told["history"], told["quantity"])
    parts = [
        Part(
            "The error, step by step",
            "error",
            tables=[_errors(told)],
            plots=[fall] if fall is not None else [],
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


def _errors(told: Mapping[str, Any]) -> Table:
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
