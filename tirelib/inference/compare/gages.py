"""Each gage by itself: its noise, its difference in every sector, and where it departs.

A model of one belt says the same at every lateral position. What a gage shows beside the mean over
the gages is tested as the mean is (`tirelib.inference.compare.regions`); the level is divided by
the gages.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray, rms
from tirelib.inference.compare.regions import LEVEL, Region, find_regions
from tirelib.inference.compare.runs import Chosen
from tirelib.inference.compare.sectors import Cell, cells, weighted_variance
from tirelib.inference.compare.sentences import amount, extent, millimetres, small
from tirelib.inference.compare.set_points import SetPoints
from tirelib.inference.identify.noise import RepeatNoise, repeat_noise
from tirelib.measured.waveforms import GRID


@dataclass(frozen=True, slots=True)
class Departure:
    """Where a gage differs more than the mean over the gages does, counted runs; strain, [-].

    Attributes
    ----------
    region : Region
        Its mean is that of the departure: the gage's difference less that of the mean.
    mean, std : float
        Model less measured at the gage there, and its standard deviation.
    of_all : float
        Model less measured of the mean over the gages there.
    measured_of_all : float
        Mean measured strain of the mean over the gages there.
    """

    region: Region
    mean: float
    std: float
    of_all: float
    measured_of_all: float


@dataclass(frozen=True, slots=True)
class Gage:
    """One gage against the model, counted runs.

    Attributes
    ----------
    number : int
        From zero, as in the campaign's header.
    lateral : float, [m]
        Left positive.
    noise : RepeatNoise
        Noise of this gage alone.
    rms : float, [-]
        Rms of model less measured, set points taken out.
    table : tuple of Cell
        By sector.
    departure : Departure or None
        None where it does not stand out, there is one gage, or the noise is unknown.
    """

    number: int
    lateral: float
    noise: RepeatNoise
    rms: float
    table: tuple[Cell, ...]
    departure: Departure | None


def compare_gages(
    chosen: Chosen,
    by_gage: FloatArray,
    difference: FloatArray,
    sector: IntArray,
    points: SetPoints,
) -> tuple[Gage, ...]:
    """Return every working gage against the model.

    Parameters
    ----------
    by_gage : shape (n_runs, n_gages, n_phi), [-]
        Model less measured, set points taken out.
    difference : shape (n_runs, n_phi), [-]
        The same of the mean over the gages.
    sector : shape (n_runs, n_phi)
        Number in `SECTORS`.
    """
    strain = chosen.waves.strain[:, chosen.gages]
    counted, out = chosen.straight, []
    for k, number in enumerate(chosen.gages):
        noise = _noise(strain[:, k], chosen, points)
        part = by_gage[:, k]
        departure = None
        if len(chosen.gages) > 1 and noise.known:
            departure = _departure(k, strain[:, k], part, difference, noise, chosen, points)
        out.append(
            Gage(
                number,
                chosen.waves.header.gage_lateral[number],
                noise,
                rms(part[counted]),
                cells(part, sector, counted, (), noise, points),
                departure,
            )
        )
    return tuple(out)


def _noise(strain: FloatArray, chosen: Chosen, points: SetPoints) -> RepeatNoise:
    rows = chosen.straight
    found = repeat_noise(strain[rows], chosen.waves.group[rows], points.tangent[rows])
    if found.known or rows.all():
        return found
    return repeat_noise(strain, chosen.waves.group, points.tangent)


def _departure(
    k: int,
    strain: FloatArray,
    part: FloatArray,
    difference: FloatArray,
    noise: RepeatNoise,
    chosen: Chosen,
    points: SetPoints,
) -> Departure | None:
    """Return where a gage is worse than the mean over the gages, by the most squares."""
    rest = _noise(strain - chosen.strain, chosen, points)
    regions = find_regions(part - difference, strain, chosen.straight, (), rest, points)
    for region in regions:
        inside = (region.start <= GRID) & (region.stop > GRID)
        mean, of_all, measured = (
            float(values[region.member][:, inside].mean())
            for values in (part, difference, chosen.strain)
        )
        if region.p * len(chosen.gages) < LEVEL and abs(mean) > abs(of_all):
            weights = np.tile(inside / inside.sum(), (len(strain), 1))
            variance = weighted_variance(weights, noise, points)[region.member]
            std = float(np.sqrt(variance.sum()) / variance.size)
            return Departure(region, mean, std, of_all, measured)
    return None


def gage_sentences(gages: Sequence[Gage], edges: FloatArray) -> tuple[str, ...]:
    """Say every gage that stands out beside the mean over the gages, by lateral position."""
    out = []
    for gage in sorted(gages, key=lambda g: -g.lateral):
        found = gage.departure
        if found is None:
            continue
        region = found.region
        out.append(
            f"At the gage at y = {millimetres(gage.lateral)}, {extent(region, edges)}, "
            f"from {region.start:.2f} to {region.stop:.2f} rad, in all runs, the model shows "
            f"{amount(found.mean, region.measured)} (95 % \N{PLUS-MINUS SIGN} "
            f"{small(1.96e6 * found.std)}, {region.runs} runs); of the mean over the gages it "
            f"shows {amount(found.of_all, found.measured_of_all)} there."
        )
    return tuple(out)
