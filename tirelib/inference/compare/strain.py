"""A model held against the strain waveforms of a campaign."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from tirelib.core.arrays import BoolArray, FloatArray, IntArray, rms
from tirelib.core.threads import one_thread
from tirelib.inference.compare.error import (
    Floor,
    ModelError,
    Yardstick,
    floor_of,
    lag_message,
    late_prediction,
)
from tirelib.inference.compare.gages import Gage, compare_gages, gage_sentences
from tirelib.inference.compare.model import Prediction, TireModel, UsedEffect, predict_runs
from tirelib.inference.compare.regions import SLIPS, Region, find_regions
from tirelib.inference.compare.runs import Chosen, choose
from tirelib.inference.compare.sectors import Cell, cells, sectors_of
from tirelib.inference.compare.sentences import sentence
from tirelib.inference.compare.set_points import SAID, SetPoints, predict_set_points, tangents
from tirelib.inference.compare.tracks import Track, track_sentences, tracks
from tirelib.inference.identify.campaign_data import straight_noise
from tirelib.inference.identify.noise import RepeatNoise
from tirelib.inference.identify.random_effects import scales
from tirelib.measured.waveforms import Waveforms
from tirelib.model.base import operating_points

NO_FIT = 0.5
"""Share of the rms strain that a model leaves from which it does not fit at all."""
SIGNIFICANT = 0.01
BEYOND = 2.0
"""Rms of the predicted set points, in tolerances, from which they are misfit and not chance."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """A model and the waveforms of a campaign; arrays over runs in the campaign's order.

    Attributes
    ----------
    chosen : Chosen
        Runs, gages and conditions.
    error : ModelError
        Over the counted (straight) runs, with the delay.
    prediction : Prediction
        With the delay.
    difference : shape (n_runs, n_phi), [-]
        Model less measured, set points taken out; positive: the model shows too much tension.
    by_gage : shape (n_runs, n_gages, n_phi), [-]
        The same for each gage.
    sector : shape (n_runs, n_phi)
        Number in `SECTORS`.
    run_rms : shape (n_runs,), [-]
        Rms of `difference`.
    rms, measured_rms : float, [-]
        Rms of model less measured, with set points and delay taken out, and rms of the measured
        strain. Like `p` and `verdict`, they are over the counted runs.
    p : float
        Chance of such an error if only noise and set points differ (F test); NaN without repeats.
    verdict : str
        What `verdict_of` returns.
    beyond : tuple of str
        Set points that would have to be off by more than `BEYOND` tolerances (rms).
    sentences : tuple of str
        Lack of fit in plain words: `regions`, set points, `tracks`, `gages`.
    gages : tuple of Gage
        Each gage by itself.
    messages : tuple of str
        What limits the comparison.
    """

    chosen: Chosen
    model: TireModel
    error: ModelError
    prediction: Prediction
    points: SetPoints
    noise: RepeatNoise
    difference: FloatArray
    by_gage: FloatArray
    sector: IntArray
    run_rms: FloatArray
    rms: float
    measured_rms: float
    p: float
    verdict: str
    beyond: tuple[str, ...]
    floor: Floor
    table: tuple[Cell, ...]
    regions: tuple[Region, ...]
    sentences: tuple[str, ...]
    tracks: tuple[Track, ...]
    gages: tuple[Gage, ...]
    messages: tuple[str, ...]

    @property
    def quantity(self) -> str:
        """What is compared."""
        return "strain"

    @property
    def used(self) -> tuple[UsedEffect, ...]:
        """Effects that the model has."""
        return self.model.used

    @property
    def told(self) -> dict[str, Any]:
        """The keys under which every document states an error."""
        return self.error.told

    @property
    def run(self) -> IntArray:
        """Run numbers."""
        return self.chosen.waves.run

    def ranked(self) -> dict[str, int]:
        """Return the best, the median and the worst counted run, as indices by that name."""
        counted = np.flatnonzero(self.chosen.straight)
        order = counted[np.argsort(self.run_rms[counted], kind="stable")]
        places = {"best": 0, "median": (order.size - 1) // 2, "worst": -1}
        return {name: int(order[place]) for name, place in places.items()}


@one_thread()
def compare_strain(waves: Waveforms, model: TireModel, data_hash: str = "") -> Comparison:
    """Hold a model against measured waveforms.

    Parameters
    ----------
    data_hash : str
        `Campaign.content_hash()`; tells whether the model was identified from these data.

    Raises
    ------
    CalibrationError
        If no run can be used, or the model has no solution at the campaign's conditions.
    """
    chosen = choose(waves)
    waves = chosen.waves
    at = operating_points(waves)
    lateral = [waves.header.gage_lateral[g] for g in chosen.gages]
    prediction = predict_runs(model, at, lateral, waves.low_pass)
    counted = chosen.straight
    repeats = straight_noise(waves.take(counted), chosen.strain[counted])
    scale = scales(chosen.tolerance, waves.angle_std)
    yardstick = Yardstick(
        chosen.strain, at, scale, repeats.std, tuple(lateral), waves.low_pass
    ).take(counted)
    parts = (getattr(prediction, name)[counted] for name in Prediction.__slots__)
    error = yardstick.of_prediction(Prediction(*parts))
    prediction = late_prediction(prediction, at.omega, error.delay)
    tangent, rest = tangents(prediction), chosen.strain - prediction.strain
    points = _set_points(rest, tangent, scale, repeats.std, chosen)
    difference = points.shift - rest
    left, size = rms(difference[counted]), rms(chosen.strain[counted])
    verdict, p, beyond = _judged(left / size, error, repeats, points, counted)
    sector = sectors_of(prediction.edges)
    regions: tuple[Region, ...] = ()
    if verdict == "lack_of_fit":
        plain = tuple(f for f in chosen.factors if f.name not in SLIPS)
        slips = tuple(f for f in chosen.factors if f.name in SLIPS)
        regions = find_regions(difference, chosen.strain, counted, plain, repeats, points)
        if slips:
            regions += find_regions(difference, chosen.strain, counted, slips, repeats, points)
    by_gage = prediction.gages - waves.strain[:, chosen.gages] + points.shift[:, None, :]
    followed = tracks(waves, chosen.strain, prediction, chosen.tolerance)
    gages = compare_gages(chosen, by_gage, difference, sector, points)
    said = tuple(sentence(region, prediction.edges) for region in regions)
    if verdict == "lack_of_fit":
        said += _beyond(beyond, points, chosen)
    if verdict in ("fits", "lack_of_fit"):
        said += track_sentences(followed, counted, chosen.factors)
        said += gage_sentences(gages, prediction.edges)
    return Comparison(
        chosen,
        model,
        error,
        prediction,
        points,
        repeats,
        difference,
        by_gage,
        sector,
        np.sqrt(np.mean(difference**2, axis=1)),
        left,
        size,
        p,
        verdict,
        beyond,
        floor_of(model, data_hash, error, at.take(counted)),
        cells(difference, sector, counted, chosen.factors, repeats, points),
        regions,
        said,
        followed,
        gages,
        (
            *_messages(chosen, repeats, verdict, left / size),
            *lag_message(error.delay, error.delay_std, at.omega[counted]),
            *chosen.notes,
        ),
    )


def _set_points(
    rest: FloatArray, tangent: FloatArray, scale: FloatArray, noise: float, chosen: Chosen
) -> SetPoints:
    """Return the set points; straight runs and the others have their own spread."""
    counted = chosen.straight
    first = predict_set_points(rest[counted], tangent[counted], scale[counted], noise)
    if counted.all():
        return first
    second = predict_set_points(rest[~counted], tangent[~counted], scale[~counted], noise)
    value, shift = np.empty((len(rest), 4)), np.empty_like(rest)
    covariance = np.empty((len(rest), 5, 5))
    for part, rows in ((first, counted), (second, ~counted)):
        value[rows], shift[rows], covariance[rows] = part.value, part.shift, part.covariance
    return SetPoints(value, scale, covariance, tangent, shift, first.spread, first.independent)


def _judged(
    share: float, error: ModelError, noise: RepeatNoise, points: SetPoints, counted: BoolArray
) -> tuple[str, float, tuple[str, ...]]:
    """Return verdict, p-value and the set points that are beyond their tolerance."""
    p = float("nan")
    if error.known:
        freedom = points.independent * int(counted.sum())
        p = float(special.fdtrc(freedom, noise.freedom, error.value**2))
    beyond = tuple(n for k, n in enumerate(SAID) if rms(points.scaled[counted, k]) > BEYOND)
    verdict = verdict_of(share, p)
    return "lack_of_fit" if verdict == "fits" and beyond else verdict, p, beyond


def verdict_of(share: float, p: float) -> str:
    """Return a verdict from the share that a model leaves and the p-value (NaN without noise)."""
    if p >= SIGNIFICANT:
        return "fits"
    if share > NO_FIT:
        return "does_not_fit"
    return "noise_unknown" if np.isnan(p) else "lack_of_fit"


def _beyond(beyond: Sequence[str], points: SetPoints, chosen: Chosen) -> tuple[str, ...]:
    """Say which set points would have to be off by far more than their tolerance."""
    out = []
    for k, (name, (_, unit, factor)) in enumerate(SAID.items()):
        if name not in beyond:
            continue
        value = factor * points.value[chosen.straight, k]
        out.append(
            f"From run to run the {_MEANT[name]} differs from {value.min():+.2g} to "
            f"{value.max():+.2g} {unit}, {rms(points.scaled[chosen.straight, k]):.1f} times the "
            "tolerance (rms): something that the model lacks acts in this way."
        )
    return tuple(out)


_MEANT = {
    "load": "strain that goes with load",
    "pressure": "strain that goes with pressure",
    "gain": "size of the strain",
    "angle": "zero of the wheel angle",
}


def _messages(chosen: Chosen, noise: RepeatNoise, verdict: str, share: float) -> tuple[str, ...]:
    """Say what limits the comparison."""
    name = chosen.waves.header.name
    out = []
    if verdict == "does_not_fit":
        out.append(
            f"The model does not fit at all: it leaves {100 * share:.0f} % of "
            f"the measured strain (no model leaves 100 %, {100 * NO_FIT:.0f} % is the limit). "
            "Where it fails says nothing then; identify it from this campaign first, or look for "
            "a wrong unit, sign or tire."
        )
    if not noise.known:
        out.append(
            f"{name} has no repeated run: the noise is unknown, so errors are given in "
            "microstrain, and whether they exceed the noise is open. Repeat three set points or "
            "more."
        )
    factors = [f.name for f in chosen.factors if f.name in ("load", "pressure", "speed")]
    if not factors:
        out.append(
            f"{name} holds one condition only: what changes with load, pressure or speed cannot "
            "be seen. Measure at least two loads, and if possible two pressures and speeds."
        )
    if 0 < noise.repeats < 3:
        out.append(
            f"{name} repeats {noise.repeats} set point(s) only: the noise is uncertain by about "
            f"{100 / np.sqrt(2 * max(noise.freedom, 1)):.0f} % or more."
        )
    return tuple(out)
