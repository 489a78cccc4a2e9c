"""The page of a comparison: one self-contained HTML file; and the same in Markdown."""

from pathlib import Path

import numpy as np

from tirelib.inference.compare.force_curves import curves_of
from tirelib.inference.compare.forces import UNITS as FORCE_UNITS
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
from tirelib.report.page import Part, Table, number
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


def answer_of(found: Comparison | ForceComparison) -> str:
    """Return the result as a sentence."""
    verdict = found.verdict if isinstance(found, ForceComparison) else found.fit.verdict
    error = found.error if isinstance(found, ForceComparison) else found.error.value
    left = _left(found)
    but = (
        " Single gages, the contact or the deflection differ; see below." if found.sentences else ""
    )
    return {
        "fits": f"The model fits: its error is {number(error, 3)} times the noise of the repeats; "
        f"{left}." + but,
        "lack_of_fit": "The model does not fit to within the noise: its error is "
        f"{number(error, 3)} times the noise of the repeats; {left}.",
        "does_not_fit": f"The model does not fit: {left}.",
        "noise_unknown": f"The noise is unknown: {left}; whether that exceeds the noise is open.",
    }[verdict]


def _left(found: Comparison | ForceComparison) -> str:
    if isinstance(found, ForceComparison):
        unit = FORCE_UNITS[found.quantity]
        return (
            f"model and measurement differ by {number(found.rms, 3)} of "
            f"{number(found.measured_rms, 4)} {unit} rms"
        )
    return (
        f"model and measurement differ by {number(1e6 * found.error.rms, 3)} of "
        f"{number(1e6 * found.fit.strain_rms, 4)} microstrain rms, errors of the set points "
        "included"
    )


def floor_text(found: Comparison) -> str:
    """Return a sentence on the structural floor."""
    floor, parts = found.floor, []
    if np.isfinite(floor.value):
        parts.append(
            f"Noise and the tire's structure explain an error of {number(floor.value, 3)} (the "
            "floor, from the last entry of the model's history)."
        )
    else:
        parts.append("The model's history states no floor for these data.")
    if np.isfinite(floor.share):
        parts.append(
            f"A smooth misfit of angle, load and pressure explains {100 * floor.share:.0f} % of "
            f"what exceeds the noise; without it the error would be {number(floor.smooth, 3)}."
        )
    return " ".join(parts)


def force_floor_text(found: ForceComparison) -> str:
    """Return a sentence on a force's floor."""
    if np.isfinite(found.floor):
        return (
            f"Noise and the brush's structure explain an error of {number(found.floor, 3)} (the "
            f"floor, from the last entry for {found.quantity} in the model's history)."
        )
    return f"The model's history states no floor for {found.quantity} on these data."


def write_comparison(found: Comparison | ForceComparison, folder: Path) -> tuple[Path, Path]:
    """Write ``index.html`` and ``comparison.md``; return their paths.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    parts = force_parts(found) if isinstance(found, ForceComparison) else strain_parts(found)
    return write_parts_page(
        folder,
        "index",
        parts,
        words="comparison",
        title=f"Model against measurement: {found.quantity}",
        summary=summary_of(found),
        answer=answer_of(found),
        messages=found.messages,
        sentences=found.sentences,
        sentence_note=SENTENCE_NOTE,
    )


def summary_of(found: Comparison | ForceComparison) -> str:
    """Return a sentence on the compared data."""
    if isinstance(found, ForceComparison):
        return f"Campaign {found.name}, model {found.model}; {found.measured.size} points."
    chosen = found.chosen
    lateral = ", ".join(millimetres(chosen.waves.header.gage_lateral[g]) for g in chosen.gages)
    effects = ", ".join(u.effect.name for u in found.model.used) or "none"
    return (
        f"Campaign {chosen.waves.header.name}, model {found.model.name}, effects: {effects}. "
        f"{len(found.run)} runs, {int(chosen.straight.sum())} of them counted; mean over the gages "
        f"at y = {lateral}."
    )


def strain_parts(found: Comparison) -> list[Part]:
    """Return the parts of a page on strain."""
    return [
        Part("Noise, error, floor", "noise", floor_text(found), tables=[number_table(found)]),
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
    curves = curves_of(found)
    noise, table, listed = force_tables(found, curves)
    effects = [f"{used.effect.name}: {used.effect.source}" for used in found.used]
    return [
        Part("Noise, error, floor", "noise", force_floor_text(found), tables=[noise]),
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
    rows = [[name, source] for name, source in found.model.sources.items()]
    effects = [
        [u.effect.name, u.effect.title, f"{_strength(u.strength)} {u.effect.unit}", u.effect.source]
        for u in found.model.used
    ]
    out = [
        Table("Parameters of the tire", ["number", "kind and source"], rows, texts=2, folded=True)
    ]
    if effects:
        out.insert(
            0,
            Table(
                "Effects in the model", ["effect", "what", "strength", "source"], effects, texts=4
            ),
        )
    return out


def _strength(value: float | tuple[float, ...]) -> str:
    return ", ".join(number(x, 4) for x in (value if isinstance(value, tuple) else (value,)))


def _bibliography(found: Comparison) -> list[str]:
    base = RING if found.model.large else RING[:1]
    effects = [f"{u.effect.name}: {u.effect.source}" for u in found.model.used]
    return [*effects, *base, *METHOD]
