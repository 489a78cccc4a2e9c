"""The tables of a comparison's page."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tirelib.inference.compare.force_curves import Curve
from tirelib.inference.compare.forces import UNITS as FORCE_UNITS
from tirelib.inference.compare.forces import ForceComparison, range_of
from tirelib.inference.compare.sectors import SECTORS, Cell
from tirelib.inference.compare.sentences import millimetres, told
from tirelib.inference.compare.set_points import NAMES
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.compare.track_words import track_fit
from tirelib.report.figures.compare_heat import NAMES as CONDITIONS
from tirelib.report.figures.compare_heat import unit_of
from tirelib.report.page import Table, number, unit_name


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
        title = "All straight, freely rolling runs" if by == "all" else f"By {CONDITIONS[by]}"
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
    scaled, tolerance = found.points.scaled, found.points.tolerance
    rows = []
    for k, name in enumerate(NAMES):
        unit, factor = ("mrad", 1e3) if name == "angle" else ("%", 100.0)
        worst = int(np.argmax(np.abs(scaled[:, k])))
        rows.append(
            [
                "angle zero" if name == "angle" else name,
                f"{number(factor * float(np.median(tolerance[:, k])), 3)} {unit}",
                number(float(np.sqrt(np.mean(scaled[:, k] ** 2))), 3),
                number(float(scaled[worst, k]), 3),
                str(found.run[worst]),
            ]
        )
    return Table(
        "Random errors of the set points",
        ["set point", "tolerance (1 sigma)", "rms [tolerance]", "largest [tolerance]", "in run"],
        rows,
        texts=2,
        note="An rms far above 1 is a misfit of the model that looks like a set-point error; far "
        "below 1, the misfit hides the set-point errors.",
    )


def force_tables(found: ForceComparison, curves: tuple[Curve, ...]) -> tuple[Table, Table]:
    """Return a force's differences by condition, and its curves."""
    unit = FORCE_UNITS[found.quantity]
    table = Table.of(
        "Difference, model minus measurement (slips by magnitude)",
        found.table,
        {
            "by": lambda cell: CONDITIONS.get(cell.by, "all points"),
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
