"""The page of a comparison: one self-contained HTML file; and the same in Markdown."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.inference.compare.document import comparison_document
from tirelib.inference.compare.force_curves import curves_of
from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.sentences import millimetres
from tirelib.inference.compare.strain import Comparison
from tirelib.report.comparison_tables import (
    force_tables,
    gage_tables,
    number_table,
    point_table,
    sector_tables,
    track_table,
)
from tirelib.report.figures.compare_forces import curve_plots, force_plots, force_trends
from tirelib.report.figures.compare_heat import gage_plots, heat_maps
from tirelib.report.figures.compare_trends import set_point_plot, track_plots, trend_plots
from tirelib.report.figures.compare_waveforms import waveform_plots
from tirelib.report.page import Part, Table, number, numbers, unit_name
from tirelib.report.parts_page import write_parts_page

SENTENCE_NOTE = (
    "Only significant differences are listed. Against noise and set-point errors the chance is 1 "
    "% that any statement of a kind (mean strain, contact and deflection, single gages) is false, "
    "and each explains at least 2 % of the summed squares of the difference. The differences are "
    "means."
)
RING = (
    "Flexible ring on an elastic foundation with inner pressure and unilateral radial tread "
    "springs, strain of the innerliner: the dissertation that this library implements, chapters "
    "5 and 6, with the corrections that its documentation lists.",
    "E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, Zeitschrift "
    "f\u00fcr angewandte Mathematik und Physik 23 (1972) 795-804: the ring at large displacements.",
)
METHOD = (
    "G. K. Robinson, That BLUP is a good thing: the estimation of random effects, Statistical "
    "Science 6 (1991) 15-32: prediction of the random errors of the set points.",
    "M. C. Kennedy, A. O'Hagan, Bayesian calibration of computer models, Journal of the Royal "
    "Statistical Society B 63 (2001) 425-464: the smooth misfit behind the floor.",
)
BRUSH = (
    "Brush with a parabolic pressure, Eq. (3) to (5) of the dissertation as corrected; contact "
    "length from the ring.",
)


def write_comparison(found: Comparison | ForceComparison, folder: Path) -> tuple[Path, Path]:
    """Write ``index.html`` and ``comparison.md``; return their paths."""
    told = comparison_document(found)
    if isinstance(found, ForceComparison):
        parts = force_parts(found)
        summary = f"Campaign {found.name}, model {found.model}; {found.measured.size} points."
    else:
        parts, chosen = strain_parts(found), found.chosen
        lateral = [millimetres(chosen.waves.header.gage_lateral[g]) for g in chosen.gages]
        effects = ", ".join(u.effect.name for u in found.model.used) or "none"
        summary = (
            f"Campaign {told['campaign']}, model {told['model']}, effects: {effects}. "
            f"{len(found.run)} runs, {int(chosen.straight.sum())} of them counted; mean over the "
            f"gages at y = {', '.join(lateral)}."
        )
    return write_parts_page(
        folder,
        "index",
        parts,
        words="comparison",
        title=f"Model against measurement: {found.quantity}",
        summary=summary,
        answer=_answer(told),
        messages=found.messages,
        sentences=found.sentences,
        sentence_note=SENTENCE_NOTE,
    )


def _answer(told: Mapping[str, Any]) -> str:
    """Return the result of a ``tirelib-comparison/1`` as a sentence."""
    left = (
        f"model and measurement differ by {number(told['residual_rms_raw'], 3)} of "
        f"{number(told['measured_rms'], 4)} {unit_name(told['unit'])} rms"
    )
    if told["quantity"] == "strain":
        left += ", errors of the set points included"
    noise = f"its error is {number(told['error'], 3)} times the noise of the repeats; {left}."
    if told["verdict"] == "fits" and told["statements"]:
        noise += " Single gages, the contact or the deflection differ; see below."
    return {
        "fits": f"The model fits: {noise}",
        "lack_of_fit": f"The model does not fit to within the noise: {noise}",
        "does_not_fit": f"The model does not fit: {left}.",
        "noise_unknown": f"The noise is unknown: {left}; whether that exceeds the noise is open.",
    }[told["verdict"]]


def _floor(told: Mapping[str, Any]) -> str:
    """Return a sentence on the structural floor."""
    strain = told["quantity"] == "strain"
    entry = "last entry of" if strain else f"last entry for {told['quantity']} in"
    text = f"The model's history states no floor for {told['quantity']} on these data."
    if strain:
        text = "The model's history states no floor for these data."
    if np.isfinite(told["floor"]):
        text = (
            f"Noise and the {'tire' if strain else 'brush'}'s structure explain an error of "
            f"{number(told['floor'], 3)} (the floor, from the {entry} the model's history)."
        )
    if told["smooth_share"] is None or np.isnan(told["smooth_share"]):
        return text
    return (
        f"{text} A smooth misfit of angle, load and pressure explains "
        f"{100 * told['smooth_share']:.0f} % of what exceeds the noise; without it the error would "
        f"be {number(told['smooth_floor'], 3)}."
    )


def strain_parts(found: Comparison) -> list[Part]:
    """Return the parts of a page on strain."""
    told = comparison_document(found)
    return [
        Part("Noise, error, floor", "noise", _floor(told), tables=[number_table(told)]),
        Part(
            "Where: angle and condition",
            "maps",
            "Model minus measurement, after correction of set-point errors. Angle 0 is below the "
            "axle; the entry has negative angles.",
            plots=heat_maps(found),
        ),
        Part("Gages", "gages", tables=gage_tables(found), plots=gage_plots(found)),
        Part("Best, median and worst run", "waveforms", plots=waveform_plots(found)),
        Part("Trends", "trends", plots=trend_plots(found)),
        Part(
            "Contact and deflection",
            "tracks",
            tables=[track_table(found)],
            plots=track_plots(found),
        ),
        Part("Table", "table", tables=sector_tables(found)),
        Part("Set points", "points", tables=[point_table(found)], plots=[set_point_plot(found)]),
        Part("Sources", "sources", tables=_provenance(found), sources=_bibliography(found)),
    ]


def force_parts(found: ForceComparison) -> list[Part]:
    """Return the parts of a page on a force."""
    curves, told = curves_of(found), comparison_document(found)
    table, listed = force_tables(found, curves)
    effects = [f"{used.effect.name}: {used.effect.source}" for used in found.used]
    return [
        Part("Noise, error, floor", "noise", _floor(told), tables=[number_table(told)]),
        Part("Where: slip and condition", "where", plots=force_plots(found)),
        Part(
            "Best, median and worst curve",
            "curves",
            tables=[listed] if curves else (),
            text="" if curves else "No curve can be drawn: no set point has three points or more.",
            plots=curve_plots(found, curves),
        ),
        Part("Trends", "trends", plots=force_trends(found)),
        Part("Table", "table", tables=[table]),
        Part("Sources", "sources", sources=[*effects, *BRUSH]),
    ]


def _provenance(found: Comparison) -> list[Table]:
    tire, used = found.model.sources.items(), found.model.used
    parameters = Table(
        "Parameters of the tire", ["number", "kind and source"], [*tire], texts=2, folded=True
    )
    effects = Table.of(
        "Effects in the model",
        used,
        {
            "effect": lambda u: u.effect.name,
            "what": lambda u: u.effect.title,
            "strength": lambda u: f"{numbers(u.components, 4)} {u.effect.unit}",
            "source": lambda u: u.effect.source,
        },
        texts=4,
    )
    return [effects, parameters] if used else [parameters]


def _bibliography(found: Comparison) -> list[str]:
    base = RING if found.model.large else RING[:1]
    effects = [f"{u.effect.name}: {u.effect.source}" for u in found.model.used]
    return [*effects, *base, *METHOD]
