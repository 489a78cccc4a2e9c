"""Identify a tire from a campaign: every number with an interval, and what it would take."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
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
from tirelib.inference.identify.waveform_fit import WaveformFit, fit_waveforms
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

    def tell(start: TireFile, values: Mapping[str, float | FloatArray]) -> None:
        if found is not None:
            found(_without_intervals(start, values, campaign, runs))

    try:
        start, fit, estimates = estimated(runs, tire, base=base, progress=progress, found=tell)
    except TirelibError as error:
        error.args = (_with_run(error, runs),)
        raise
    deviation = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(deviation, deviation)
    return Identification(
        _fitted_file(start, estimates, correlation, campaign, runs, fit),
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


def estimated(
    runs: StraightRuns,
    tire: TireFile | None = None,
    *,
    base: str = "plain",
    progress: Callable[[str], None] | None = None,
    found: Callable[[TireFile, Mapping[str, float | FloatArray]], None] | None = None,
) -> tuple[TireFile, WaveformFit, tuple[Estimate, ...]]:
    """Return start and priors, the fit, and what it tells of every number.

    Parameters and errors as in `identify`, for runs that have been read already; `found` is called
    with the start and the fitted values.
    """
    start, fit = fitted(runs, tire, base=base, progress=progress, found=found)
    estimates = [estimate(fit, k, start) for k in range(len(fit.free))]
    if any("not_identifiable" in e.flags for e in estimates):
        ways = next_run(fit, structure_std(start, fit.free))
        estimates = [
            replace(e, helps=_help(e, fit, k, ways)) if "not_identifiable" in e.flags else e
            for k, e in enumerate(estimates)
        ]
    return start, fit, tuple(estimates)


def fitted(
    runs: StraightRuns,
    tire: TireFile | None = None,
    *,
    base: str = "plain",
    progress: Callable[[str], None] | None = None,
    found: Callable[[TireFile, Mapping[str, float | FloatArray]], None] | None = None,
) -> tuple[TireFile, WaveformFit]:
    """Return start and priors, and the fit: `estimated` without what the fit tells of a number."""
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
        found=None if found is None else partial(found, start),
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


def estimate(fit: WaveformFit, k: int, start: TireFile) -> Estimate:
    """Return what a fit tells of its k-th coordinate, with the structural part and flags."""
    coordinate = fit.free[k]
    name = coordinate.name
    value = float(fit.values[name])
    fit_std = coordinate.spread(value, float(np.sqrt(fit.covariance[k, k])))
    apart = float(structure_std(start, fit.free)[k])
    structure = coordinate.spread(value, apart)
    # both parts are normal in the coordinate: a number that moves by a factor is off by one
    steps = np.array([-1.0, 1.0]) * np.hypot(fit.interval[k], 1.96 * apart)
    low, high = sorted(float(coordinate.moved(value, step)) for step in steps)
    prior = coordinate.spread(start.numbers[name].value, float(fit.prior_std[k]))
    untold, wide = fit_std > TOLD * prior, 0.5 * (high - low) > WIDEST * abs(value)
    far = abs(value - start.numbers[name].value) > 2.5 * prior
    flags = {
        "not_identifiable": untold or wide,
        "at_boundary": far or _near_limit(name, value),
        "not_quadratic": not fit.quadratic[k],
    }
    std = float(np.hypot(fit_std, structure))
    return Estimate(name, value, std, low, high, fit_std, tuple(f for f, on in flags.items() if on))


def _help(estimate: Estimate, fit: WaveformFit, k: int, ways: NextRun) -> str:
    """Return what would tell a number best, with the half-widths that are predicted."""
    coordinate = fit.free[k]

    def percent(half: float) -> float:
        # of a number that is zero: in percent of its prior's unit
        size = abs(estimate.value) or coordinate.unit
        low, high = (float(coordinate.moved(estimate.value, step)) for step in (-half, half))
        return 50.0 * abs(high - low) / size

    now = percent(float(ways.half_width[k]))
    best = ways.best(k)
    if best is None:
        return f"nothing that was weighed: half of the 95 % interval stays at {now:.0f} %"
    then = percent(best.half_width)
    said = f"{best.words}: half of the 95 % interval from {now:.0f} to {then:.0f} %"
    if then > 100.0 * WIDEST:
        said += ", still too wide"
    run = ways.best_run(k)
    if run is None:
        return f"{said}; no runs within 20 % of the campaign's range help"
    return said if run == best else f"{said}; {run.words}: {percent(run.half_width):.0f} %"


def _near_limit(name: str, value: float) -> bool:
    field = FIELDS[name]
    return value <= field.lowest * 1.001 if field.lowest > 0 else value >= field.highest * 0.999


def _fitted_file(
    start: TireFile,
    estimates: tuple[Estimate, ...],
    correlation: FloatArray,
    campaign: Campaign,
    runs: StraightRuns,
    fit: WaveformFit,
) -> TireFile:
    """Return the identified tire as a model without effects; it holds its numbers' correlation."""
    source = _source(campaign, runs)
    fitted = {e.name: Number(e.value, e.std, "fitted", source, e.notes) for e in estimates}
    provenance = {
        "method": "whole waveforms, Gauss-Newton with structural misfit",
        "tirelib": __version__,
        "campaign": campaign.header.name,
        "data_sha256": campaign.content_hash(),
        "runs": [int(run) for run in runs.waves.run],
        "rms_microstrain": 1e6 * fit.rms,
    }
    names = [each.name for each in estimates]
    extra = {
        "provenance": provenance,
        "identified_correlation": {"names": names, "values": correlation.tolist()},
        **WITHOUT_EFFECTS,
    }
    return TireFile(start.name, {**start.numbers, **fitted}, extra)


def _without_intervals(
    start: TireFile,
    values: Mapping[str, float | FloatArray],
    campaign: Campaign,
    runs: StraightRuns,
) -> TireFile:
    """Return the fitted tire while nothing more is known of it than its values."""
    fitted = {
        c.name: Number(float(values[c.name]), nan, "fitted", _source(campaign, runs))
        for c in coordinates(values_of(start.tire))
    }
    return TireFile(start.name, {**start.numbers, **fitted}, dict(WITHOUT_EFFECTS))


def _source(campaign: Campaign, runs: StraightRuns) -> str:
    return f"strain waveforms of {campaign.header.name}, {len(runs.waves)} straight runs"
