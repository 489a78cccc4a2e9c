"""A model's brush held against the forces of a campaign.

Points are runs, or passes of a sweep through a cell of conditions. Points in the same cell are the
repeats, which give the noise (`tirelib.inference.identify.force_noise`). The model is computed at
the measured conditions, so a set point that is off moves both.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import special

from tirelib.campaign import Campaign
from tirelib.core.arrays import BoolArray, FloatArray, IntArray, rms
from tirelib.core.parameters import TireFile
from tirelib.core.quantities import QUANTITIES
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.error import last_floor
from tirelib.inference.compare.force_model import (
    ForceModel,
    force_model_of,
    quantities_of,
    slip_of,
    slips,
    strain_effects,
    usable_points,
)
from tirelib.inference.compare.model import UsedEffect
from tirelib.inference.compare.sentences import set_point, told
from tirelib.inference.compare.strain import verdict_of
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.force_data import ForceData, force_data
from tirelib.inference.identify.force_noise import force_noise
from tirelib.inference.identify.force_notes import noise_note, taken_as_zero
from tirelib.inference.identify.force_points import CELL_ANGLE, ForcePoints, force_points

SLIP_LIMITS = {
    "slip_angle": np.deg2rad([1.0, 2.0, 4.0, 6.0, 9.0]),
    "slip_ratio": np.array([0.02, 0.05, 0.1, 0.2]),
}
LEVEL, LEAST_SHARE, MOST_REGIONS = 0.01, 0.02, 6
CELLS = (
    "cells of 0.5 deg in slip angle and camber, 0.01 in slip ratio, a tenth in load, pressure and "
    "speed, 5 K in tread temperature"
)


@dataclass(frozen=True, slots=True)
class ForceCell:
    """Difference over a range of conditions.

    Attributes
    ----------
    by : str
        all, load, pressure, slip_angle, slip_ratio or camber (sizes of the slips).
    low, high : float
        Range, SI.
    rms, mean : float
        Rms and mean of model less measured.
    excess, excess_std : float
        Mean of how much the model's size exceeds the measured, and its standard deviation from
        repeats (NaN without).
    shift : float
        In a cell of camber: mean of model less measured, turned with the sign of camber. A camber
        thrust that the model lacks shifts the force on both sides alike, which no size shows.
        NaN elsewhere.
    member : shape (n,)
    """

    by: str
    low: float
    high: float
    points: int
    rms: float
    mean: float
    excess: float
    excess_std: float
    shift: float
    member: BoolArray

    @property
    def is_shifted(self) -> bool:
        """Whether a shift says more than a difference in size."""
        return abs(self.shift) > abs(self.excess)

    @property
    def largest(self) -> float:
        """Return the larger of the two."""
        return self.shift if self.is_shifted else self.excess


@dataclass(frozen=True, slots=True)
class ForceComparison:
    """One force of a campaign against a model, SI, ISO; arrays over points.

    Attributes
    ----------
    name : str
        Name of the campaign.
    data : ForceData
        Means over cells.
    run : shape (n,)
        Number of the run or stretch.
    measured, predicted : shape (n,)
    noise : float
        Standard deviation of a point, from repeats; NaN without.
    repeats : int
        Cells with more than one point.
    error : float
        Rms of model less measured over the noise; in N or N m without repeats.
    used : tuple of UsedEffect
        Effects that the model has.
    floor : float
        Part of the error that noise and the brush's structure explained when the model was last
        changed for this force on these data, in noise units; NaN where unknown.
    """

    quantity: str
    name: str
    model: str
    data: ForceData
    run: IntArray
    measured: FloatArray
    predicted: FloatArray
    noise: float
    repeats: int
    error: float
    rms: float
    measured_rms: float
    p: float
    verdict: str
    table: tuple[ForceCell, ...]
    sentences: tuple[str, ...]
    messages: tuple[str, ...]
    used: tuple[UsedEffect, ...] = ()
    floor: float = float("nan")

    @property
    def unit(self) -> str:
        """Unit of the force: N or Nm."""
        return QUANTITIES[self.quantity].unit

    @property
    def told(self) -> dict[str, Any]:
        """The keys under which every document states an error: value, unit, noise, raw rms."""
        return {
            "error": self.error,
            "error_unit": "noise" if np.isfinite(self.noise) else self.unit,
            "noise": self.noise,
            "residual_rms_raw": self.rms,
        }

    @property
    def difference(self) -> FloatArray:
        """Model less measured."""
        return np.asarray(self.predicted - self.measured)


@one_thread()
def compare_forces(
    campaign: Campaign,
    file: TireFile,
    quantity: str | None = None,
    effects: Mapping[str, Effect] = CATALOGUE,
) -> ForceComparison:
    """Hold the brush of a model, with its effects, against a campaign.

    Parameters
    ----------
    quantity : str, optional
        Fy, Fx or Mz; by default the one with the largest lack of fit.
    effects : mapping
        By name, as the model's file names them.

    Raises
    ------
    CalibrationError
        If the model has no brush, or the force is not measured.
    """
    model = force_model_of(file, effects)
    points = force_points(force_data(campaign))
    wanted = quantities_of(campaign, points, quantity)
    points = usable_points(campaign, model, points)
    bench = model.bench(points)
    found, data_hash = bench.forces(model.values, model.changes), campaign.content_hash()
    left_out = tuple(
        f"the model's effect {name} acts on strain and has no part in the forces"
        for name in strain_effects(file, model)
    )
    every = [
        _compare(campaign, model, points, getattr(found, name), name, data_hash) for name in wanted
    ]
    best = max(every, key=lambda c: c.error if np.isfinite(c.noise) else c.rms / c.measured_rms)
    return replace(best, messages=(*best.messages, *left_out))


def _compare(
    campaign: Campaign,
    model: ForceModel,
    points: ForcePoints,
    predicted: FloatArray,
    name: str,
    data_hash: str,
) -> ForceComparison:
    """Return the comparison of one force."""
    keep = np.isfinite(getattr(points.data, name))
    points, predicted = points.take(keep), predicted[keep]
    data = points.data
    measured = getattr(data, name)
    difference = predicted - measured
    noise, freedom, repeats = force_noise(points, measured)
    left, size = rms(difference), rms(measured)
    error, p = left, float("nan")
    if freedom:
        error = left / noise
        p = float(special.fdtrc(difference.size, freedom, error**2))
    verdict = verdict_of(left / size, p)
    table = _table(data, difference, measured, noise)
    said = _sentences(name, table, freedom) if verdict == "lack_of_fit" else ()
    return ForceComparison(
        name,
        campaign.header.name,
        model.name,
        data,
        data.block,
        measured,
        predicted,
        noise,
        repeats,
        error,
        left,
        size,
        p,
        verdict,
        table,
        said,
        (
            *_messages(campaign, name, points, verdict, left / size, repeats),
            *noise_note(name, noise, size),
            *taken_as_zero(campaign),
        ),
        model.used,
        last_floor(model.history, name, data_hash),
    )


def _table(
    data: ForceData, difference: FloatArray, measured: FloatArray, noise: float
) -> tuple[ForceCell, ...]:
    every = np.ones(len(data), dtype=np.bool_)
    groups: list[tuple[str, float, float, BoolArray]] = [("all", np.nan, np.nan, every)]
    for by in ("load", "pressure"):
        level = levels(getattr(data, by))
        for k in range(int(level.max()) + 1 if level.max() > 0 else 0):
            part = getattr(data, by)[level == k]
            groups.append((by, float(part.min()), float(part.max()), level == k))
    for by, limits in SLIP_LIMITS.items():
        size = np.abs(getattr(data, by))
        if np.ptp(getattr(data, by)) < limits[0]:
            continue
        ends = [0.0, *limits.tolist(), np.inf]
        slack = 0.1 * limits[0]
        for low, high in pairwise(ends):
            inside = (size >= low - slack * (low > 0)) & (size < high - slack)
            groups.append((by, low, min(high, float(size.max())), inside))
    if np.ptp(data.camber) > CELL_ANGLE:
        for step in np.unique(np.round(np.abs(data.camber) / CELL_ANGLE)):
            inside = np.round(np.abs(data.camber) / CELL_ANGLE) == step
            groups.append(("camber", step * CELL_ANGLE, step * CELL_ANGLE, inside))
    excess = np.abs(measured + difference) - np.abs(measured)
    out = []
    for by, low, high, member in groups:
        n = int(member.sum())
        if n:
            d = difference[member]
            out.append(
                ForceCell(
                    by,
                    low,
                    high,
                    n,
                    rms(d),
                    float(d.mean()),
                    float(excess[member].mean()),
                    noise / np.sqrt(n),
                    float(np.mean(d * np.sign(data.camber[member])))
                    if by == "camber" and low > 0.0
                    else float("nan"),
                    member,
                )
            )
    return tuple(out)


def _sentences(name: str, table: Sequence[ForceCell], freedom: int) -> tuple[str, ...]:
    """Say the cells, and pairs of a slip cell with a load or pressure cell, that stand out."""
    parts = [cell for cell in table if cell.by != "all"]
    ranked = sorted(parts, key=lambda cell: -cell.points * cell.largest**2)
    looked_at = len(parts) + sum(np.isfinite(cell.shift) for cell in parts)
    total = table[0].points * table[0].rms ** 2
    out: list[str] = []
    for cell in ranked:
        t = abs(cell.largest) / cell.excess_std if cell.excess_std > 0 else 0.0
        p = 2.0 * special.stdtr(freedom, -t) * looked_at
        large = cell.points * cell.largest**2 > LEAST_SHARE * total
        if p < LEVEL and large and len(out) < MOST_REGIONS:
            out.append(_say(name, cell))
    return tuple(out)


def _say(name: str, cell: ForceCell) -> str:
    if cell.is_shifted:
        return (
            f"At camber {range_of(cell)} the model's {name} is shifted by "
            f"{'-' if cell.shift < 0.0 else '+'}{_short(abs(cell.shift))} "
            f"± {_short(1.96 * cell.excess_std)} {QUANTITIES[name].unit} where camber is "
            f"positive, and the other way where it is negative (95 %, {cell.points} points)."
        )
    kind = cell.by.replace("_", " ")
    size = "large" if cell.excess > 0.0 else "small"
    sign = ", either sign, " if cell.by in SLIP_LIMITS else ", "
    return (
        f"At {kind} {range_of(cell)}{sign}the model's {name} is {_short(abs(cell.excess))} "
        f"\N{PLUS-MINUS SIGN} {_short(1.96 * cell.excess_std)} {QUANTITIES[name].unit} "
        f"too {size} in size (95 %, {cell.points} points)."
    )


def range_of(cell: ForceCell) -> str:
    """Say the range of a cell: levels of load and pressure by their middle."""
    if cell.by == "all":
        return ""
    if cell.by in ("load", "pressure") and cell.high < 1.1 * cell.low:
        return set_point(cell.by, 0.5 * (cell.low + cell.high))
    grain = float(np.deg2rad(0.1)) if cell.by in ("slip_angle", "camber") else 0.001
    if cell.by in ("load", "pressure"):
        grain = 1.0
    low, high = (told(cell.by, grain * round(value / grain)) for value in (cell.low, cell.high))
    return low if low == high else f"{low} to {high}"


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.2g}"


def _messages(
    campaign: Campaign, name: str, points: ForcePoints, verdict: str, share: float, repeats: int
) -> tuple[str, ...]:
    where = campaign.header.name
    out = []
    if verdict == "does_not_fit":
        out.append(
            f"The model does not fit at all: it leaves {100 * share:.0f} % of the measured {name}. "
            "Where it fails says nothing then; identify it from this campaign first, or look for "
            "a wrong unit, sign or tire."
        )
    if not repeats:
        out.append(
            f"{where} repeats no condition ({CELLS}): the noise is unknown, so errors are given in "
            f"{QUANTITIES[name].unit}, and whether they exceed the noise is open. Repeat three "
            "conditions or more."
        )
    elif points.sweep.any():
        out.append(
            f"Repeats are {repeats} cells of conditions ({CELLS}) that a sweep passes more than "
            "once; the noise is that of a pass's mean."
        )
    if not slips(points.data, name):
        slip = slip_of(name).replace("_", " ")
        out.append(
            f"{where} holds one {slip} only: {name} says nothing about the brush. "
            "Add runs with slip."
        )
    return tuple(out)
