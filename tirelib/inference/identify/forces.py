"""Identify the brush of a tire from the forces of a campaign."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite, nan
from types import MappingProxyType
from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.errors import TirelibError
from tirelib.core.forked import forked
from tirelib.core.parameters import Number, Tire
from tirelib.core.threads import one_thread
from tirelib.inference.identify.brush_advice import advice
from tirelib.inference.identify.brush_estimates import SlipStiffness, estimates_of, slip_stiffness
from tirelib.inference.identify.brush_fit import BrushFit, fit_brush
from tirelib.inference.identify.brush_law import stored_number
from tirelib.inference.identify.brush_study import study_of
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.force_data import ForceData, force_data
from tirelib.inference.identify.force_notes import force_notes
from tirelib.inference.identify.lateral_force import PressureComparison, compare_pressures

MOST_SAMPLES = 50000
"""A longer sweep is thinned evenly: its samples are closer than its errors are independent."""
SMALL_ANGLE = 0.05
"""Slip angle up to which the lateral force acts behind the middle of the contact, [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceIdentification:
    """What the forces of a campaign say of a tire.

    Attributes
    ----------
    stiffness : tuple of SlipStiffness
        By load and pressure.
    comparison : PressureComparison or None
        Lateral force by the ring's pressure against the parabola; without a ring none.
    notes : tuple of str
        What was left out or assumed, and why.
    numbers : mapping of str to Number
        As a tire file holds them.
    """

    fit: BrushFit
    estimates: tuple[Estimate, ...]
    stiffness: tuple[SlipStiffness, ...]
    comparison: PressureComparison | None
    notes: tuple[str, ...]
    numbers: Mapping[str, Number]


@one_thread()
def identify_forces(
    campaign: Campaign,
    ring: Tire | None = None,
    *,
    progress: Callable[[str], None] | None = None,
) -> ForceIdentification:
    """Fit the brush to the forces of a campaign.

    Parameters
    ----------
    ring : Tire, optional
        Gives the contact length; without it Mz does, or it is assumed and flagged.

    Raises
    ------
    CalibrationError
        If slips, loads or forces do not suffice; with what is missing.
    """
    tell = progress or (lambda label: None)
    tell("reading forces")
    read: list[Callable[[], Any]] = [partial(force_data, campaign), partial(force_notes, campaign)]
    data, notes = forked(read)  # both read every run
    notes = list(notes)
    if len(data) > MOST_SAMPLES:
        step = -(-len(data) // MOST_SAMPLES)
        notes.append(f"{len(data)} samples: each {step}. is used, {-(-len(data) // step)} in all")
        data = data.take(np.arange(0, len(data), step))
    if ring is not None:
        data, ring = _with_pressure(data, ring, notes)
    tell("fitting the brush")
    fit = _fit(data, ring, campaign.header.axes, notes)
    tell("intervals of the brush")
    study = study_of(fit)
    estimates = estimates_of(study, free_radius=campaign.header.tire.free_radius)
    if any("not_identifiable" in each.flags for each in estimates):
        helps = advice(study)
        estimates = tuple(
            replace(each, helps=helps[each.name]) if "not_identifiable" in each.flags else each
            for each in estimates
        )
    notes += _remarks(fit, estimates, data)
    stiffness = slip_stiffness(study)
    comparison = None
    if ring is not None:
        tell("ring pressure against the parabola")
        try:
            comparison = compare_pressures(data, ring)
            said = comparison.notes
        except TirelibError as error:
            said = (str(error),)
        notes += [f"ring pressure against parabola: {each}" for each in said]
    return ForceIdentification(
        fit,
        estimates,
        stiffness,
        comparison,
        tuple(notes),
        MappingProxyType(_numbers(campaign, fit, estimates, len(data))),
    )


def _fit(data: ForceData, ring: Tire | None, axes: str, notes: list[str]) -> BrushFit:
    """Return the fit to all forces, without an aligning moment that no brush can have."""
    fit = fit_brush(data, tire=ring)
    if fit.r2.get("Mz", 0.0) >= 0.0:
        return fit
    small = np.abs(data.slip_angle) < SMALL_ANGLE
    trail = -float(np.nansum((data.Fy * data.Mz)[small]) / np.nansum((data.Fy**2)[small]))
    why = "the brush leaves more than all of it"
    if trail < 0.0:
        why = (
            f"it has the wrong sign for axes = {axes!r}, that of Fy at small slip angles; correct "
            "the sign of the channel in the import map"
        )
    notes.append(f"Mz is not used (R2 {fit.r2['Mz']:.2f}): {why}")
    return fit_brush(data, forces=[name for name in fit.rmse if name != "Mz"], tire=ring)


def _with_pressure(data: ForceData, ring: Tire, notes: list[str]) -> tuple[ForceData, Tire | None]:
    """Return the points whose pressure is known, or all of them without the ring."""
    known = np.isfinite(data.pressure)
    if not known.any():
        notes.append(
            "the inflation pressure is known nowhere: the ring cannot give the contact length; "
            "record the pressure, or give it as a set point"
        )
        return data, None
    if not known.all():
        notes.append(
            f"{int((~known).sum())} of {known.size} points have no inflation pressure; left out, "
            "since the ring needs it"
        )
        data = data.take(known)
    return data, ring


def _remarks(fit: BrushFit, estimates: tuple[Estimate, ...], data: ForceData) -> list[str]:
    """Return what a reader should know of this fit."""
    out = []
    angles = np.unique(np.round(np.abs(np.rad2deg(data.slip_angle)), 1))
    if "Fy" in fit.rmse and "Fx" not in fit.rmse and angles[angles > 0.3].size < 2:
        out.append(
            "one size of slip angle only: cornering stiffness and friction cannot be separated; "
            "add a small and a large slip angle"
        )
    if fit.held.get("load_power", (0.0, ""))[1] == "one load only":
        out.append(
            f"one load only, {fit.reference.load:.0f} N: how the contact length follows the load "
            "is unknown, so it is taken as constant; do not use this brush at other loads"
        )
    if "half_length" in fit.held and fit.tire is None:
        out.append(
            "the contact length is assumed, since neither Mz nor a ring determines it: the product "
            "c_py a^2, which gives the cornering stiffness, is known, c_py alone is not"
        )
    if any("beyond_geometry" in each.flags for each in estimates):
        out.append(
            "half_length is longer than any contact of this tire: Mz is larger than a brush on a "
            "rigid carcass explains. Forces do not depend on it; do not read it as a contact length"
        )
    if not np.isfinite(data.pressure).any():
        out.append("the inflation pressure is unknown: the brush holds at the pressure of the test")
    return out


def _numbers(
    campaign: Campaign, fit: BrushFit, estimates: tuple[Estimate, ...], points: int
) -> dict[str, Number]:
    """Return the brush as numbers of a tire file."""
    source = f"forces of {campaign.header.name}, {' and '.join(fit.rmse)} at {points} points"
    numbers = dict(
        stored_number(each.name, each.value, each.std, "fitted", source, each.notes)
        for each in estimates
    )
    numbers |= dict(
        stored_number(name, value, nan, "assumed", f"not fitted: {why}")
        for name, (value, why) in fit.held.items()
        if not (name == "half_length" and fit.tire is not None)
    )
    mean = f"median of the points of {campaign.header.name}"
    at = {"reference_load": fit.reference.load, "reference_pressure": fit.reference.pressure}
    return numbers | {
        name: Number(value, nan, "measured", mean) for name, value in at.items() if isfinite(value)
    }
