"""Identify a tire from a campaign: every number with an interval, and what it would take."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import nan
from typing import Any

import numpy as np

from tirelib.campaign import Campaign, CampaignHeader
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, ParameterError, TirelibError
from tirelib.core.parameters import FIELDS, Number, TireFile
from tirelib.core.threads import one_thread
from tirelib.core.units import from_si
from tirelib.core.version import __version__
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.identify.discrepancy import COARSE, Discrepancy
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.literature import OF_PLAIN, literature
from tirelib.inference.identify.next_run import NextRun, next_run
from tirelib.inference.identify.strain_notes import gage_notes, run_notes
from tirelib.inference.identify.structure import STRUCTURE_STD, WITHOUT_SHEAR
from tirelib.inference.identify.waveform_fit import WaveformFit, fit_waveforms, ridges
from tirelib.measured.waveforms import measure_waveforms
from tirelib.model.base import Coordinate, coordinates, values_of

WIDEST = 0.25
"""Relative half-width of a 95 % interval up to which a number is called identifiable."""
TOLD = 0.6
"""Share of the prior's deviation below which the campaign has added knowledge."""

LENGTHS = ("ring_radius", "free_radius", "belt_width", "tread_thickness", "innerliner_offset")
"""What a campaign states of its tire."""
BASES = ("plain", "dissertation")
"""The plain tire, and the ring whose belt does not shear on a road without friction."""
WITHOUT_EFFECTS: Mapping[str, Any] = {
    "model": {"ring": "large displacements", "contact": "radial"},
    "effects": [],
    "history": [],
}
"""What a model file holds beyond its numbers while no effect has been added."""


@dataclass(frozen=True, slots=True)
class Identification:
    """What a campaign says of a tire.

    Attributes
    ----------
    tire : TireFile
        With provenance; what the other verbs read.
    correlation : shape (n, n)
        Correlation of the estimates, by the fit.
    notes : tuple of str
        Runs and gages that were not used, and why.
    """

    tire: TireFile
    estimates: tuple[Estimate, ...]
    correlation: FloatArray
    fit: WaveformFit
    runs: StraightRuns
    notes: tuple[str, ...] = ()


@one_thread()
def identify(
    campaign: Campaign,
    tire: TireFile | None = None,
    *,
    base: str = "plain",
    progress: Callable[[str], None] | None = None,
    found: Callable[[TireFile], None] | None = None,
) -> Identification:
    """Identify the base model from the straight runs of a campaign.

    Parameters
    ----------
    tire : TireFile, optional
        Start and priors; the campaign's geometry and literature values where it is absent.
    base : str
        One of `BASES`.
    found : callable, optional
        Called with the fitted tire before the intervals of its numbers are computed.

    Raises
    ------
    CalibrationError
        If the campaign cannot inform the model; says what is missing.
    ConvergenceError
        If the fit does not settle.
    """
    waves = measure_waveforms(campaign, progress=progress)
    runs = straight_runs(waves)
    source = f"strain waveforms of {campaign.header.name}, {len(runs.waves)} straight runs"
    try:
        start, fit = fitted(runs, tire, base=base, progress=progress)
        if found is not None:
            bare = {
                c.name: Number(float(fit.values[c.name]), nan, "fitted", source) for c in fit.free
            }
            found(TireFile(start.name, {**start.numbers, **bare}, dict(WITHOUT_EFFECTS)))
        estimates = estimates_of(start, fit)
    except TirelibError as error:
        error.args = (_with_run(error, runs),)
        raise
    deviation = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(deviation, deviation)
    extra = {
        "provenance": {
            "method": "whole waveforms, Gauss-Newton with structural misfit",
            "tirelib": __version__,
            "campaign": campaign.header.name,
            "data_sha256": campaign.content_hash(),
            "runs": [int(run) for run in runs.waves.run],
            "rms_microstrain": 1e6 * fit.rms,
        },
        "identified_correlation": {
            "names": [each.name for each in estimates],
            "values": correlation.tolist(),
        },
        **WITHOUT_EFFECTS,
    }
    told = {e.name: Number(e.value, e.std, "fitted", source, e.notes) for e in estimates}
    return Identification(
        TireFile(start.name, {**start.numbers, **told}, extra),
        estimates,
        correlation,
        fit,
        runs,
        (
            *run_notes(waves, campaign.plans),
            *gage_notes(runs.waves, runs.gages),
            *_contradictions(start, estimates),
        ),
    )


def _contradictions(start: TireFile, estimates: tuple[Estimate, ...]) -> tuple[str, ...]:
    """Return a sentence for each measured number that the strain does not agree with."""
    out = []
    for each in estimates:
        given, field = start.numbers[each.name], FIELDS[each.name]
        if given.kind == "measured" and "at_boundary" in each.flags:
            value, said = (
                f"{from_si(v, field.unit, field.dimension):.4g} {field.unit}"
                for v in (each.value, given.value)
            )
            out.append(
                f"{each.name}: the strain says {value}, {given.source} says {said}; one of them is "
                "wrong: correct the length, or the unit or gain of the gages"
            )
    return tuple(out)


def _with_run(error: TirelibError, runs: StraightRuns) -> str:
    """Return an error's message with the campaign's run in place of the model's point."""
    said = str(error)
    if error.point is not None:
        run = runs.waves.run[min(error.point, runs.waves.run.size - 1)]
        said = said.replace(f"point {error.point}", f"run {run}")
    return f"{runs.waves.header.name}: {said}"


def fitted(
    runs: StraightRuns,
    tire: TireFile | None = None,
    *,
    base: str = "plain",
    progress: Callable[[str], None] | None = None,
) -> tuple[TireFile, WaveformFit]:
    """Return start and priors, and the fit to runs; parameters and errors as of `identify`."""
    start = start_file(runs.waves.header, runs, tire, base)
    values = values_of(start.tire)
    free = coordinates(values)
    return start, fit_waveforms(
        runs.data(),
        values,
        np.array([prior_std(start, coordinate) for coordinate in free]),
        free=free,
        discrepancy=Discrepancy() if base == "plain" else COARSE,
        progress=progress,
    )


def estimates_of(start: TireFile, fit: WaveformFit) -> tuple[Estimate, ...]:
    """Return what a fit tells of every number, and what would tell those that it does not."""
    found = intervals_of(start, fit)
    if not any("not_identifiable" in each.flags for each in found):
        return found
    ways = next_run(fit, structure_std(start, fit.free))
    return tuple(
        replace(e, helps=_help(e, fit, k, ways)) if "not_identifiable" in e.flags else e
        for k, e in enumerate(found)
    )


def start_file(
    header: CampaignHeader, runs: StraightRuns, tire: TireFile | None, base: str = "plain"
) -> TireFile:
    """Return start and priors: the campaign's geometry, then the given tire, then literature.

    The reference pressure is the mean of the campaign. What is no part of the base model starts at
    zero or infinity: damping, and of the dissertation's ring whatever the plain tire has beyond
    it. An infinite stiffness or a zero of the given tire is no start for a fit and gives way to the
    assumed one.

    Raises
    ------
    CalibrationError
        If neither the campaign nor the given tire states the lengths of the ring.
    ParameterError
        If there is no such base.
    """
    if base not in BASES:
        raise ParameterError(f"base model {base!r}; allowed are {' and '.join(BASES)}")
    pressure = float(np.mean(runs.waves.conditions["pressure"]))
    numbers = literature(pressure, plain=base == "plain")
    if tire is not None:
        numbers |= {
            name: number
            for name, number in tire.numbers.items()
            if name != "damping"
            and (name not in OF_PLAIN or (base == "plain" and number.value > 0.0))
            and (name != "offset_pressure_slope" or base == "plain")
            and np.isfinite(number.value)
        }
    for name, number in stated_lengths(header).items():
        unsure = replace(number, std=0.05 * abs(number.value))
        numbers[name] = unsure if name == "innerliner_offset" else number
    if lacking := [f"{name}_m" for name in LENGTHS if name not in numbers]:
        raise CalibrationError(
            f"{header.name}: [tire] in campaign.toml does not state {', '.join(lacking)}; the ring "
            "is fitted with these lengths; measure them at the tire and state them there, or give "
            "a tire file that holds them (--tire)"
        )
    if tire is not None:
        shift = pressure - tire.tire.pressure
        for prefix in ("radial", "tangential"):
            old = numbers[f"{prefix}_stiffness"]
            slope = numbers[f"{prefix}_pressure_slope"].value
            numbers[f"{prefix}_stiffness"] = Number(
                old.value + slope * shift, old.std, old.kind, old.source
            )
    numbers["pressure"] = Number(pressure, nan, "measured", f"{header.name}, mean of runs")
    return TireFile(header.tire.name or header.name, numbers)


def stated_lengths(header: CampaignHeader) -> dict[str, Number]:
    """Return the lengths of the tire that a campaign states, by name."""
    given = {name: getattr(header.tire, name) for name in LENGTHS}
    return {
        name: Number(float(value), nan, "measured", f"{header.name}, campaign.toml")
        for name, value in given.items()
        if value is not None and np.isfinite(value)
    }


def prior_std(start: TireFile, coordinate: Coordinate) -> float:
    """Return the prior's standard deviation of a coordinate, from the number's kind."""
    number = start.numbers[coordinate.name]
    by_kind = {"measured": 0.1, "fitted": 0.15, "literature": 0.5, "assumed": 0.7}[number.kind]
    if coordinate.unit:
        return (number.std if np.isfinite(number.std) else 1.0) / coordinate.unit
    return number.std / abs(number.value) if np.isfinite(number.std) else by_kind


def structure_std(start: TireFile, free: tuple[Coordinate, ...]) -> FloatArray:
    """Return the structural standard deviation of every coordinate."""
    known = WITHOUT_SHEAR if len(free) == len(WITHOUT_SHEAR) else STRUCTURE_STD
    return np.array(
        [
            known[c.name] * (abs(start.numbers[c.name].value) / c.unit if c.unit else 1.0)
            for c in free
        ]
    )


def intervals_of(start: TireFile, fit: WaveformFit) -> tuple[Estimate, ...]:
    """Return what a fit tells of its coordinates, with the structural part and flags."""
    ends, quadratic = ridges(fit)
    fit_stds = np.sqrt(np.diag(fit.covariance))
    out = []
    for k, (coordinate, apart) in enumerate(
        zip(fit.free, structure_std(start, fit.free).tolist(), strict=True)
    ):
        name = coordinate.name
        value, given = float(fit.values[name]), start.numbers[name].value
        fit_std = coordinate.spread(value, float(fit_stds[k]))
        # both parts are normal in the coordinate: a number that moves by a factor is off by one
        steps = np.array([-1.0, 1.0]) * np.hypot(ends[k], 1.96 * apart)
        low, high = sorted(float(coordinate.moved(value, step)) for step in steps)
        prior = coordinate.spread(given, float(fit.prior_std[k]))
        untold, wide = fit_std > TOLD * prior, 0.5 * (high - low) > WIDEST * abs(value)
        flags = {
            "not_identifiable": untold or wide,
            "at_boundary": abs(value - given) > 2.5 * prior or _near_limit(name, value),
            "not_quadratic": not quadratic[k],
        }
        std = float(np.hypot(fit_std, coordinate.spread(value, apart)))
        told = tuple(flag for flag, on in flags.items() if on)
        out.append(Estimate(name, value, std, low, high, fit_std, told))
    return tuple(out)


def _help(estimate: Estimate, fit: WaveformFit, k: int, ways: NextRun) -> str:
    """Return what would tell a number best, with the half-widths that are predicted."""
    coordinate = fit.free[k]

    def percent(half: float) -> float:
        # of a number that is zero: in percent of its prior's unit
        size = abs(estimate.value) or coordinate.unit
        low, high = (float(coordinate.moved(estimate.value, step)) for step in (-half, half))
        return 50.0 * abs(high - low) / size

    now = percent(float(ways.half_width[k]))
    best, run = ways.best(k), ways.best_run(k)
    if best is None:
        return f"nothing that was weighed: half of the 95 % interval stays at {now:.0f} %"
    then = percent(float(best.half_width[k]))
    said = f"{best.words}: half of the 95 % interval from {now:.0f} to {then:.0f} %"
    if then > 100.0 * WIDEST:
        said += ", still too wide"
    if run is None:
        return f"{said}; no runs within 20 % of the campaign's range help"
    return (
        said if run is best else f"{said}; {run.words}: {percent(float(run.half_width[k])):.0f} %"
    )


def _near_limit(name: str, value: float) -> bool:
    field = FIELDS[name]
    return value <= field.lowest * 1.001 if field.lowest > 0 else value >= field.highest * 0.999
