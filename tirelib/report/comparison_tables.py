"""The tables of a comparison's page."""

import numpy as np

from tirelib.compare.force_curves import Curve
from tirelib.compare.forces import UNITS as FORCE_UNITS
from tirelib.compare.forces import ForceComparison, range_of
from tirelib.compare.sectors import SECTORS, Cell
from tirelib.compare.sentences import millimeters, told
from tirelib.compare.set_points import NAMES
from tirelib.compare.strain import Comparison
from tirelib.compare.track_words import track_fit
from tirelib.report.figures.compare_heat import NAMES as CONDITIONS
from tirelib.report.figures.compare_heat import unit_of
from tirelib.report.page import Table, number


def number_table(found: Comparison) -> Table:
    """Return noise, error and floor."""
    fit, noise = found.fit, found.noise
    rows = [
        [
            f"noise of a run's waveform, from {noise.repeats} repeated set points [microstrain]",
            number(1e6 * noise.std, 3),
        ],
        [f"error [{found.error.unit}]", number(found.error.value, 4)],
        [
            "delay of the gages against the trigger, corrected for [microseconds]",
            f"{number(1e6 * found.error.delay, 3)} \u00b1 {number(1e6 * found.error.delay_std, 2)}",
        ],
        [
            "rms difference, corrected for set points and delay [noise]",
            number(fit.rms / noise.std, 4),
        ],
        [
            "rms difference, corrected for set points and delay [microstrain]",
            number(1e6 * fit.rms, 4),
        ],
        [
            "rms difference, corrected for the delay only [microstrain]",
            number(1e6 * found.error.rms, 4),
        ],
        ["rms measured strain [microstrain]", number(1e6 * fit.strain_rms, 4)],
        ["floor as far as known [noise]", number(found.floor.value, 4)],
        ["error without a smooth misfit [noise]", number(found.floor.smooth, 4)],
    ]
    note = "The error is that of the straight, freely rolling runs." if found.error.known else ""
    return Table("Noise, error and floor", ["", "value"], rows, note=note)


def sector_tables(found: Comparison) -> list[Table]:
    """Return a table for each condition: a row per sector and level."""
    factor, unit = unit_of(found)
    out = []
    names = list(dict.fromkeys(cell.by for cell in found.table))
    for by in names:
        cells = [cell for cell in found.table if cell.by == by]
        cells.sort(key=lambda c: (np.nan_to_num(c.value), SECTORS.index(c.sector)))
        rows = [_row(cell, factor) for cell in cells]
        title = "All straight, freely rolling runs" if by == "all" else f"By {CONDITIONS[by]}"
        out.append(
            Table(
                title,
                [
                    "level",
                    "sector",
                    "runs",
                    f"rms [{unit}]",
                    "rms [microstrain]",
                    "mean [microstrain]",
                    "95 % \u00b1 [microstrain]",
                ],
                rows,
                texts=2,
                folded=by != "all",
                note="Model minus measurement; a positive mean is too much tension.",
            )
        )
    return out


def _row(cell: Cell, factor: float) -> list[str]:
    level = "all" if cell.by == "all" else told(cell.by, cell.value)
    return [
        level,
        cell.sector,
        str(cell.runs),
        number(factor * cell.rms, 3),
        number(1e6 * cell.rms, 4),
        number(1e6 * cell.mean, 4),
        number(1.96e6 * cell.std, 2),
    ]


def gage_tables(found: Comparison) -> list[Table]:
    """Return every gage's noise and rms, and its mean difference in every sector."""
    gages = sorted(found.gages, key=lambda g: -g.lateral)
    rows = [
        [
            millimeters(g.lateral),
            str(g.number + 1),
            number(1e6 * g.noise.std, 3),
            number(1e6 * g.rms, 4),
            number(g.rms / g.noise.std, 4),
        ]
        for g in gages
    ]
    cells = [{cell.sector: cell for cell in gage.table} for gage in gages]
    means = [
        [name, *(_mean(cell[name]) if name in cell else "" for cell in cells)] for name in SECTORS
    ]
    return [
        Table(
            "Difference at each gage, straight and freely rolling runs",
            [
                "y (ISO 8855)",
                "gage",
                "noise [microstrain]",
                "rms [microstrain]",
                "rms [noise of the gage]",
            ],
            rows,
            note="y is positive to the left; corrected for set points.",
        ),
        Table(
            "Mean difference of each gage in each sector [microstrain]",
            ["sector", *(f"y = {millimeters(g.lateral)}" for g in gages)],
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
    rows = []
    for track in found.tracks:
        fit, scale = track_fit(track, found.chosen.straight), track.scale
        rows.append(
            [
                f"{track.name} [{track.unit}]",
                str(fit.runs),
                number(scale * track.noise, 2),
                number(scale * fit.mean, 3),
                number(1.96 * scale * fit.std, 2),
                number(scale * fit.rms, 3),
                number(track.in_noise(fit.rms), 3),
                number(scale * fit.rms_beside, 3),
            ]
        )
    note = (
        "Model minus measurement. No number is corrected for a constant offset of the campaign; "
        "the last column is the rms that remains after such a correction."
    )
    return Table(
        "Counted runs",
        [
            "",
            "runs",
            "noise of a run",
            "mean",
            "95 % \u00b1",
            "rms",
            "rms [noise]",
            "rms about the mean",
        ],
        rows,
        note=note,
    )


def point_table(found: Comparison) -> Table:
    """Return the table of estimated set-point errors."""
    scaled, tolerance = found.points.scaled, found.points.tolerance
    units = (("%", 100.0),) * 3 + (("mrad", 1e3),)
    rows = []
    for k, name in enumerate(NAMES):
        unit, factor = units[k]
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


def force_tables(found: ForceComparison, curves: tuple[Curve, ...]) -> tuple[Table, Table, Table]:
    """Return a force's noise and error, its differences by condition, and its curves."""
    unit = FORCE_UNITS[found.quantity]
    noise = Table(
        "Noise and error",
        ["", "value"],
        [
            [
                f"noise of a point, from {found.repeats} repeated conditions [{unit}]",
                number(found.noise, 3),
            ],
            [f"error [{found.error_unit}]", number(found.error, 4)],
            ["floor as far as known [noise]", number(found.floor, 4)],
            [f"rms difference [{unit}]", number(found.rms, 4)],
            [f"rms measured [{unit}]", number(found.measured_rms, 4)],
        ],
    )
    rows = [
        [
            CONDITIONS.get(cell.by, "all points"),
            range_of(cell),
            str(cell.points),
            number(cell.rms, 3),
            number(cell.rms / found.noise, 3),
            number(cell.mean, 3),
            number(cell.excess, 3),
            number(1.96 * cell.excess_std, 2),
        ]
        for cell in found.table
    ]
    table = Table(
        "Difference, model minus measurement (slips by magnitude)",
        [
            "by",
            "range",
            "points",
            f"rms [{unit}]",
            "rms [noise]",
            f"mean [{unit}]",
            f"magnitude too large by [{unit}]",
            f"95 % \u00b1 [{unit}]",
        ],
        rows,
        texts=2,
    )
    each = [
        [curve.words, str(curve.points), number(curve.rms, 3), number(curve.rms / found.noise, 3)]
        for curve in curves
    ]
    listed = Table(
        "Curves, the best first",
        ["set point", "points", f"rms [{unit}]", "rms [noise]"],
        each,
        folded=len(each) > 8,
    )
    return noise, table, listed
