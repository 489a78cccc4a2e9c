"""The report of a calibration: statistics, residuals, cross-validation, and what is missing."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.errors import CalibrationError
from tirelib.estimators.cornering import CorneringTrend
from tirelib.estimators.train import Trained
from tirelib.report import figures
from tirelib.report.accuracy import QUANTITIES, SAID
from tirelib.report.page import Part, Picture, draw_all, number, write_page
from tirelib.report.statistics import (
    estimator_tables,
    held_out_table,
    in_use_table,
    refused_table,
    regression_tables,
)
from tirelib.report.style import AXES_NAME


def write_calibration_report(
    trained: Trained,
    folder: str | Path,
    *,
    held_out: Sequence[Mapping[str, Any]],
) -> Path:
    """Write ``index.html`` and its figures.

    Parameters
    ----------
    folder : path
        Made if needed; an earlier report in it is overwritten.
    held_out : sequence of mappings
        Cross-validation by level: ``held_out, level, quantity, unit, dissertation, in_use`` and
        optionally ``inside, n``.

    Returns
    -------
    page : Path
        The ``index.html``.
    """
    folder = Path(folder)
    calibration = trained.calibration
    sections = [
        Part(
            "Estimators that this calibration uses",
            "in-use",
            "Each estimator is a polynomial in a few regressors. Its terms were selected by "
            "cross-validation over held-out conditions.",
            [in_use_table(trained), *estimator_tables(trained)],
        ),
        Part(
            "Residuals",
            "residuals",
            "Each point is one independent measurement (a run, or a turn of a sweep), estimated "
            "by a fit from which its condition was held out. Below: the dissertation's "
            "regression.",
            pictures=draw_all(folder, _residuals(trained)),
        ),
    ]
    if held_out:
        sections.append(
            Part("Errors at held-out levels", "held-out", tables=[held_out_table(list(held_out))])
        )
    sections.append(
        Part(
            "The dissertation's regressions",
            "regressions",
            "Ordinary least squares on run means, as in section 4.1 of the dissertation. Lengths "
            "in mm, strains in microstrain, forces in N, angles in deg, signs ISO 8855 (the "
            "dissertation prints SAE: Fy, slip angle and left and right change sign).",
            regression_tables(trained.regressions),
            pictures=draw_all(folder, regression_drawings(trained)),
        )
    )
    if trained.links.refused:
        sections.append(Part("Not calibrated", "refused", tables=[refused_table(trained)]))
    gages = ", ".join(number(1e3 * y, 3) for y in calibration.lateral)
    low_pass = f"order {number(calibration.order)} of the turn rate"
    if calibration.cut_off:
        low_pass = f"{number(calibration.cut_off)} Hz"
    return write_page(
        folder,
        "base.html",
        title=f"Calibration: {calibration.tire}",
        summary=f"Tire {calibration.tire}; gages at y = {gages} mm ({AXES_NAME}); "
        f"{trained.links.unit.size} independent measurements at "
        f"{np.unique(trained.links.groups).size} conditions; low-pass {low_pass}.",
        sections=sections,
    )


def _residuals(trained: Trained) -> list[Picture]:
    return [
        Picture(
            f"residuals_{quantity}",
            f"Residuals of the {SAID[quantity].title}",
            "Against the estimate, the load and the slip angle; right: compared with a normal "
            "distribution. Each row has its own scale.",
            partial(figures.figure_residuals, trained, quantity),
        )
        for quantity in QUANTITIES
        if quantity in trained.links.held_out
    ]


_FIGURES: tuple[tuple[str, str, str, Callable[[Trained], Figure]], ...] = (
    (
        "4-3",
        "Contact length over slip angle",
        "The off-centre lengths follow the slip angle. The centre length hardly does, so it "
        "indicates the load.",
        lambda trained: figures.figure_4_3(trained.means),
    ),
    (
        "4-4",
        "Load from the centre contact length",
        "Left: the quadratic; middle: its residuals; right: held-out residuals of the estimator "
        "in use, on the same scale.",
        figures.figure_4_4,
    ),
    (
        "4-5",
        "Slip angle from the in/out ratio of peak rates",
        "Thin lines are fits to one load each: the ratio also depends on the load.",
        figures.figure_4_5,
    ),
    (
        "4-7",
        "Slip angle from the slope of peak rates",
        "Thin lines are fits to one load each. Right: the estimator in use, held out, on the same "
        "scale.",
        figures.figure_4_7,
    ),
    (
        "4-12",
        "Lateral force by load",
        "Left: the regression with six regressors; right: the estimator in use, held out; below: "
        "their residuals.",
        figures.figure_4_12,
    ),
    (
        "4-14",
        "Lateral force under camber",
        "Six regressors fitted at each camber, one fit for all cambers, and the estimator in use.",
        figures.figure_4_14,
    ),
    (
        "4-20",
        "Cornering curves",
        "Run means, and the Magic Formula fitted to them.",
        lambda trained: figures.figure_4_20(trained.means, _trend(trained)),
    ),
    (
        "4-23",
        "Cornering stiffness and peak force over contact length",
        "Bars are 95 % intervals; a hollow ring is an extrapolated peak beyond the measured slip "
        "angles.",
        lambda trained: figures.figure_4_23(_trend(trained)),
    ),
)
"""Number, title and caption of the figures of section 4.1, and how each is drawn."""


def regression_drawings(trained: Trained) -> list[Picture]:
    """Return the figures of section 4.1 that a calibration's data can inform."""
    cambers = any(r.source == "Table 4-2" for r in trained.regressions)
    return [
        Picture(
            f"figure_{number.replace('-', '_')}",
            f"{title} (Fig. {number})",
            caption,
            partial(draw, trained),
        )
        for number, title, caption, draw in _FIGURES
        if cambers or number != "4-14"
    ]


def _trend(trained: Trained) -> CorneringTrend:
    if trained.cornering is None:
        raise CalibrationError(
            "the figure needs three loads with at least six slip angles each, without camber"
        )
    return trained.cornering
