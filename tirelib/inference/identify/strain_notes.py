"""What of a campaign's strain is not used, and why: no run and no gage is left out silently."""

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from tirelib.campaign import Campaign, RunPlan
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.measured.waveforms import Waveforms

WEAK_GAGE = 0.3
"""A gage below this share of what the others show is broken."""
LEAST_STRAIN = 2e-4
"""No contact stretches an innerliner less than this."""
MOST_STRAIN = 0.05
"""Rms strain that no belt survives."""
LEAST_RUNS = 4
LEAST_LOAD_RATIO = 1.25
_NAMED = 6
"""Runs that a message names."""


def gage_sizes(strain: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return each gage's rms and the typical one of its run, shapes (n_runs, n_gages), (n_runs, 1).

    The typical one is the median over the gages that show anything; NaN where none does.
    """
    size = np.sqrt(np.mean((strain - strain.mean(axis=2, keepdims=True)) ** 2, axis=2))
    some = np.where(np.isfinite(size), size, 0.0)
    typical = np.array([np.median(row[row > 0.0]) if (row > 0.0).any() else np.nan for row in some])
    return size, typical[:, None]


def some_gage_works(waves: Waveforms) -> BoolArray:
    """Return whether any gage of a run has a waveform without gaps, shape (n_runs,)."""
    whole = np.asarray(np.isfinite(waves.strain).all(axis=2))
    return np.asarray(whole.any(axis=1))


def gage_notes(waves: Waveforms, used: tuple[int, ...]) -> tuple[str, ...]:
    """Return a sentence for every gage that is not averaged: it failed, or its twin did."""
    size, typical = gage_sizes(waves.strain)
    failed = ~(np.isfinite(size) & (size > WEAK_GAGE * typical))
    out = []
    for gage in (g for g in range(size.shape[1]) if g not in used):
        at = f"gage {gage + 1} at {1e3 * waves.header.gage_lateral[gage]:+.0f} mm"
        bad = np.flatnonzero(failed[:, gage])
        if not bad.size:
            out.append(
                f"{at}: works, but its twin on the other side does not; left out of the ring"
            )
            continue
        run = bad[0]
        shown = (
            f"{1e6 * size[run, gage]:.0f} microstrain rms in {named(waves.run[bad])}, where the "
            f"others show {1e6 * typical[run, 0]:.0f}"
            if np.isfinite(size[run, gage])
            else f"samples that are no numbers (NaN) in {named(waves.run[bad])}"
        )
        out.append(f"{at}: {shown}; left out of the ring in all runs")
    return tuple(out)


def run_notes(waves: Waveforms, plans: Sequence[RunPlan]) -> tuple[str, ...]:
    """Return a sentence for each reason why straight runs with strain are not used."""
    lost = defaultdict[str, list[int]](list)
    for plan in plans:
        if is_straight(plan) and plan.run in waves.left_out:
            lost[waves.left_out[plan.run]].append(plan.run)
    out = [f"{named(runs)}: {reason}; left out of the ring" for reason, runs in lost.items()]
    silent = waves.straight & ~some_gage_works(waves)
    if silent.any():
        out.append(
            f"{named(waves.run[silent])}: no gage gives a whole waveform (samples are not "
            "numbers, or contacts were found where there are none); left out of the ring"
        )
    set_point = {plan.run: (plan.load, plan.pressure) for plan in plans}
    point = np.array([set_point.get(int(run), (np.nan, np.nan)) for run in waves.run])
    for k, (name, words) in enumerate((("Fz", "load"), ("pressure", "inflation pressure"))):
        value = waves.conditions[name]
        missing = waves.run[waves.straight & ~np.isfinite(value)]
        if missing.size:
            out.append(f"{named(missing)}: no {words} is known; left out of the ring")
        given = waves.run[waves.straight & (value == point[:, k])]
        if given.size:
            out.append(f"{named(given)}: {words} is exactly the set point: not measured")
    return tuple(out)


def is_straight(plan: RunPlan) -> bool:
    """Whether the set points are those of a straight, freely rolling run."""
    slips = (plan.slip_angle, plan.camber, plan.slip_ratio)
    return plan.kind != "sweep" and bool(np.all(np.abs(np.nan_to_num(slips)) < 1e-3))


def ring_expected(campaign: Campaign) -> bool:
    """Whether the plan holds what a ring needs: gages, straight runs, different loads."""
    if not campaign.header.gage_lateral:
        return False
    loads = [p.load for p in campaign.plans if is_straight(p) and np.isfinite(p.load)]
    return len(loads) >= LEAST_RUNS and max(loads) >= LEAST_LOAD_RATIO * min(loads)


def broken_gages(campaign: Campaign) -> tuple[str, ...]:
    """Return a sentence for every gage whose raw strain hardly changes in straight runs.

    The gage nearest to the middle finds the contacts: without it no run has a waveform.
    """
    lateral = np.array(campaign.header.gage_lateral)
    weak = defaultdict[int, list[int]](list)
    flat: list[int] = []
    for plan in campaign.plans:
        run = campaign.load(plan) if is_straight(plan) else None
        if run is None or run.strain is None:
            continue
        size = np.nan_to_num(np.ptp(run.strain, axis=1))
        if np.max(size) < LEAST_STRAIN:
            flat.append(plan.run)
            continue
        for gage in np.flatnonzero(size <= WEAK_GAGE * np.max(size)):
            weak[int(gage)].append(plan.run)
    middle = int(np.argmin(np.abs(lateral))) if lateral.size else -1
    few = f"below {1e6 * LEAST_STRAIN:.0f} microstrain, check their unit"
    said = (f"all gages of {named(flat)} range {few}",) if flat else ()
    return said + tuple(
        f"gage {gage + 1} at {1e3 * lateral[gage]:+.0f} mm hardly shows strain in {named(found)}"
        + (", and it is the one that finds the contacts" if gage == middle else "")
        for gage, found in sorted(weak.items())
    )


def named(numbers: Iterable[int]) -> str:
    """Return "run 3" or "4 runs (1, 2, 3, 5)"."""
    chosen = [int(n) for n in numbers]
    names = ", ".join(map(str, chosen[:_NAMED])) + (", ..." if len(chosen) > _NAMED else "")
    return f"run {names}" if len(chosen) == 1 else f"{len(chosen)} runs ({names})"
