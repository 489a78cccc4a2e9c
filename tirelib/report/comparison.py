"""The page of a comparison: one self-contained HTML file; and the same in Markdown."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.document import comparison_document
from tirelib.inference.compare.force_curves import Curve, curves_of
from tirelib.inference.compare.forces import ForceComparison, range_of
from tirelib.inference.compare.sectors import SECTORS, Cell
from tirelib.inference.compare.sentences import millimetres, told
from tirelib.inference.compare.set_points import SAID
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.compare.tracks import track_fit
from tirelib.report.figures.compare_forces import curve_plots, force_plots, force_trends
from tirelib.report.figures.compare_heat import gage_plots, heat_maps, unit_of, waveform_plots
from tirelib.report.figures.compare_trends import set_point_plot, track_plots, trend_plots
from tirelib.report.page import Part, Table, number, numbers, unit_name, write_parts_page

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
    told, base = comparison_document(found), RING if found.model.large else RING[:1]
    sources = [*(f"{u.effect.name}: {u.effect.source}" for u in found.used), *base, *METHOD]
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
        Part("Sources", "sources", tables=_provenance(found), sources=sources),
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
            plots=curve_plots(found),
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


def number_table(told: Mapping[str, Any]) -> Table:
    """Return noise, error and floor of a ``tirelib-comparison/1``."""
    unit, repeats = unit_name(told["unit"]), told["repeats"]
    error = {f"error [{told['error_unit']}]": number(told["error"], 4)}
    floor = {"floor as far as known [noise]": number(told["floor"], 4)}
    measured = number(told["measured_rms"], 4)
    if told["quantity"] != "strain":
        noise = f"noise of a point, from {repeats} repeated conditions [{unit}]"
        left = {f"rms difference [{unit}]": number(told["residual_rms"], 4)}
        rows = {noise: number(told["noise"], 3)} | error | floor | left
        return Table.listed("Noise and error", rows | {f"rms measured [{unit}]": measured})
    rest, delay = "rms difference, corrected for set points and delay", "corrected for the delay"
    rows = {
        f"noise of a run's waveform, from {repeats} repeated set points [{unit}]": number(
            told["noise"], 3
        ),
        **error,
        "delay of the gages against the trigger, corrected for [microseconds]": (
            f"{number(told['delay_us'], 3)} \u00b1 {number(told['delay_std_us'], 2)}"
        ),
        f"{rest} [noise]": number(told["residual_rms_noise"], 4),
        f"{rest} [{unit}]": number(told["residual_rms"], 4),
        f"rms difference, {delay} only [{unit}]": number(told["residual_rms_raw"], 4),
        f"rms measured strain [{unit}]": measured,
        **floor,
        "error without a smooth misfit [noise]": number(told["smooth_floor"], 4),
    }
    known = told["error_unit"] == "noise"
    note = "The error is that of the straight, freely rolling runs." if known else ""
    return Table.listed("Noise, error and floor", rows, note)


def sector_tables(found: Comparison) -> list[Table]:
    """Return a table for each condition: a row per sector and level."""
    factor, unit = unit_of(found)
    out = []
    names = list(dict.fromkeys(cell.by for cell in found.table))
    for by in names:
        cells = [cell for cell in found.table if cell.by == by]
        cells.sort(key=lambda c: (np.nan_to_num(c.value), SECTORS.index(c.sector)))
        title = "All straight, freely rolling runs" if by == "all" else f"By {QUANTITIES[by].title}"
        out.append(
            Table.of(
                title,
                cells,
                {
                    "level": lambda c: "all" if c.by == "all" else told(c.by, c.value),
                    "sector": lambda c: c.sector,
                    "runs": lambda c: str(c.runs),
                    f"rms [{unit}]": lambda c: number(factor * c.rms, 3),
                    "rms [microstrain]": lambda c: number(1e6 * c.rms, 4),
                    "mean [microstrain]": lambda c: number(1e6 * c.mean, 4),
                    "95 % \u00b1 [microstrain]": lambda c: number(1.96e6 * c.std, 2),
                },
                texts=2,
                folded=by != "all",
                note="Model minus measurement; a positive mean is too much tension.",
            )
        )
    return out


def gage_tables(found: Comparison) -> list[Table]:
    """Return every gage's noise and rms, and its mean difference in every sector."""
    gages = sorted(found.gages, key=lambda g: -g.lateral)
    cells = [{cell.sector: cell for cell in gage.table} for gage in gages]
    means = [
        [name, *(_mean(cell[name]) if name in cell else "" for cell in cells)] for name in SECTORS
    ]
    return [
        Table.of(
            "Difference at each gage, straight and freely rolling runs",
            gages,
            {
                "y (ISO 8855)": lambda g: millimetres(g.lateral),
                "gage": lambda g: str(g.number + 1),
                "noise [microstrain]": lambda g: number(1e6 * g.noise.std, 3),
                "rms [microstrain]": lambda g: number(1e6 * g.rms, 4),
                "rms [noise of the gage]": lambda g: number(g.rms / g.noise.std, 4),
            },
            note="y is positive to the left; corrected for set points.",
        ),
        Table(
            "Mean difference of each gage in each sector [microstrain]",
            ["sector", *(f"y = {millimetres(g.lateral)}" for g in gages)],
            means,
            note="Model minus measurement, with 95 % intervals from the noise of the gage and the "
            "set points. A positive mean is too much tension.",
        ),
    ]


def _mean(cell: Cell) -> str:
    text = number(1e6 * cell.mean, 3)
    return f"{text} \u00b1 {number(1.96e6 * cell.std, 2)}" if np.isfinite(cell.std) else text


def track_table(found: Comparison) -> Table:
    """Return contact length, deflection, entry and exit: how far model and measurement differ."""
    fits = [(track, track_fit(track, found.chosen.straight)) for track in found.tracks]
    return Table.of(
        "Counted runs",
        fits,
        {
            "": lambda of: f"{of[0].name} [{of[0].unit}]",
            "runs": lambda of: str(of[1].runs),
            "noise of a run": lambda of: number(of[0].scale * of[0].noise, 2),
            "mean": lambda of: number(of[0].scale * of[1].mean, 3),
            "95 % \u00b1": lambda of: number(1.96 * of[0].scale * of[1].std, 2),
            "rms": lambda of: number(of[0].scale * of[1].rms, 3),
            "rms [noise]": lambda of: number(of[0].in_noise(of[1].rms), 3),
            "rms about the mean": lambda of: number(of[0].scale * of[1].rms_beside, 3),
        },
        note="Model minus measurement. No number is corrected for a constant offset of the "
        "campaign; the last column is the rms that remains after such a correction.",
    )


def point_table(found: Comparison) -> Table:
    """Return the table of estimated set-point errors."""
    return Table.of(
        "Random errors of the set points",
        found.points.told(found.run),
        {
            "set point": lambda row: SAID[row["name"]][0],
            "tolerance (1 sigma)": lambda row: f"{number(row['tolerance'], 3)} {row['unit']}",
            "rms [tolerance]": lambda row: number(row["rms_in_tolerances"], 3),
            "largest [tolerance]": lambda row: number(row["largest_in_tolerances"], 3),
            "in run": lambda row: str(row["largest_run"]),
        },
        texts=2,
        note="An rms far above 1 is a misfit of the model that looks like a set-point error; far "
        "below 1, the misfit hides the set-point errors.",
    )


def force_tables(found: ForceComparison, curves: tuple[Curve, ...]) -> tuple[Table, Table]:
    """Return a force's differences by condition, and its curves."""
    unit = found.unit
    table = Table.of(
        "Difference, model minus measurement (slips by magnitude)",
        found.table,
        {
            "by": lambda cell: "all points" if cell.by == "all" else QUANTITIES[cell.by].title,
            "range": range_of,
            "points": lambda cell: str(cell.points),
            f"rms [{unit}]": lambda cell: number(cell.rms, 3),
            "rms [noise]": lambda cell: number(cell.rms / found.noise, 3),
            f"mean [{unit}]": lambda cell: number(cell.mean, 3),
            f"magnitude too large by [{unit}]": lambda cell: number(cell.excess, 3),
            f"95 % \u00b1 [{unit}]": lambda cell: number(1.96 * cell.excess_std, 2),
        },
        texts=2,
    )
    listed = Table.of(
        "Curves, the best first",
        curves,
        {
            "set point": lambda curve: curve.words,
            "points": lambda curve: str(curve.points),
            f"rms [{unit}]": lambda curve: number(curve.rms, 3),
            "rms [noise]": lambda curve: number(curve.rms / found.noise, 3),
        },
        folded=len(curves) > 8,
    )
    return table, listed
