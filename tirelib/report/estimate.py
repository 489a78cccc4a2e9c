"""The report of a campaign that was estimated with a calibration."""

from collections.abc import Callable
from math import isnan
from pathlib import Path

from tirelib.core.flags import flag_names
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.estimate import Estimates
from tirelib.measured.observations import Observations
from tirelib.report import figures
from tirelib.report.accuracy import QUANTITIES, SAID, Accuracy, accuracies
from tirelib.report.page import DASH, Part, Picture, Table, draw_all, number, write_page
from tirelib.report.style import AXES_NAME


def write_estimate_report(
    observations: Observations, estimates: Estimates, calibration: Calibration, folder: str | Path
) -> Path:
    """Write ``index.html`` and its figures; return the page."""
    folder = Path(folder)
    names = ", ".join(header.name for header in observations.headers)
    rows = accuracies(observations, estimates)
    drawings = []
    if rows:
        drawings.append(
            Picture(
                "accuracy",
                "Estimated against measured, turn by turn",
                "Top: estimate against measurement; bottom: the residual with its 95 % interval.",
                lambda: figures.figure_accuracy(observations, estimates),
            )
        )
    if any(row.quantity == "alpha" for row in rows):
        drawings.append(
            Picture(
                "figure_4_8",
                "Slip angle turn after turn (Fig. 4-8)",
                "Steps are measured, dots are estimated; each load has its own panel.",
                lambda: figures.figure_4_8(observations, estimates),
            )
        )
    sections = [
        Part(
            "Accuracy",
            "accuracy",
            "" if rows else "The campaign holds no measured forces or slip to compare with.",
            [accuracy_table(rows)] if rows else [],
            pictures=draw_all(folder, drawings),
        ),
        Part(
            "Validity",
            "validity",
            "A turn with faulty data, or outside the calibrated range, gets a flag and no valid "
            "estimate; no value is clamped.",
            [_validity(estimates, calibration), _flags(estimates)],
        ),
    ]
    return write_page(
        folder,
        "base.html",
        title=f"Estimates: {names}",
        summary=f"Tire {calibration.tire}; campaigns {names}; {len(observations)} turns, "
        f"{int(estimates.turn_valid.sum())} of them valid; calibrated gages at y = "
        f"{', '.join(number(1e3 * y, 3) for y in calibration.lateral)} mm ({AXES_NAME}).",
        sections=sections,
    )


def accuracy_table(
    rows: list[Accuracy], title: str = "Accuracy against the rig", names: list[str] | None = None
) -> Table:
    """Return the accuracy table; `names` adds a first column, the campaign of each row."""
    named = list(zip(names or [""] * len(rows), rows, strict=True))
    first: dict[str, Callable[[tuple[str, Accuracy]], str]] = {"campaign": lambda of: of[0]}
    return Table.of(
        title,
        named,
        {
            **(first if names is not None else {}),
            "quantity": lambda of: of[1].title,
            "unit": lambda of: of[1].unit,
            "rmse": lambda of: number(of[1].rmse),
            "% of range": lambda of: _known(of[1].percent_of_range, 2),
            "R\u00b2": lambda of: _known(of[1].r2, 5),
            "turns in 95 % interval": lambda of: f"{100.0 * of[1].coverage:.0f} %",
            "runs": lambda of: str(of[1].runs),
            "valid turns": lambda of: str(of[1].turns),
            "measured turns": lambda of: str(of[1].turns_measured),
        },
        texts=2 if names is None else 3,
        note="Errors refer to the mean of a run's valid turns (in a sweep to each turn); the "
        "share in the 95 % interval refers to single turns. A dash: the quantity was not varied, "
        "so that a percentage of its range is meaningless.",
    )


def _known(value: float, decimals: int) -> str:
    return DASH if isnan(value) else f"{value:.{decimals}f}"


def _validity(estimates: Estimates, calibration: Calibration) -> Table:
    chain = calibration.chains[-1]
    total = estimates.turn_valid.size
    return Table(
        "Valid turns",
        ("quantity", "valid turns", "of"),
        [
            (
                SAID[q].title,
                str(int(estimates.valid[q].sum())) if chain.has(q) else "not calibrated",
                str(total),
            )
            for q in QUANTITIES
        ],
    )


def _flags(estimates: Estimates) -> Table:
    counts: dict[str, int] = {}
    for value, notes in zip(estimates.flags, estimates.notes, strict=True):
        for name in (*flag_names(int(value)), *notes):
            counts[name] = counts.get(name, 0) + 1
    ordered = sorted(counts.items(), key=lambda item: -item[1])
    return Table(
        "Flags and notes",
        ("flag", "turns"),
        [(name.replace("_", " "), str(count)) for name, count in ordered] or [("none", "0")],
    )
