"""Which further run would tell a number of the brush best, computed at the fitted brush.

Each candidate adds points whose slopes by the parameters are known; the variance of every parameter
with and without them follows, with the smooth misfit among the errors: more of the same does not
average it out. What this campaign could not fit (the contact length without Mz, the
load's power at one load) is free here, with a vague prior, so that its lack counts.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.brush_cells import places
from tirelib.inference.identify.brush_law import point_parameters
from tirelib.inference.identify.brush_misfit import ForceMisfit, Shape, kernel
from tirelib.inference.identify.brush_problem import ASSUMED_HALF_LENGTH, BrushProblem
from tirelib.inference.identify.brush_study import Study
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.ring_patch import ring_half

PRIOR = 1.0
"""Standard deviation of every z before any measurement."""
LEAST_GAIN = 0.8
"""A run that leaves more of the standard deviation than this share is no advice."""
LARGEST_ANGLE = 15.0
"""No rig is asked for a larger slip angle, [deg]; where friction is unknown full sliding is too."""
_ANGLES = (1.0, 2.0, 4.0, 6.0)
_RATIOS = (0.01, 0.02, 0.05, 0.1, 0.15)
_SHARE = 0.05
"""Assumed error of a force that was not recorded, over mu Fz (of a moment: mu Fz a)."""
_MOST_VARIANCE = 1e6
NO_RUN = (
    "no further run would narrow it: the brush's own misfit limits it (`tirelib diagnose` with "
    "--quantity says what is missing)"
)


class Candidate(NamedTuple):
    """A run, or a channel, that could be added: in words, which forces it records, and where."""

    words: str
    forces: tuple[str, ...]
    data: ForceData


def advice(study: Study) -> dict[str, str]:
    """Return the best further run for each fitted parameter, or what limits it where none helps."""
    problem = _opened(study)
    z = problem.z_of(np.array([_value(study, name) for name in problem.names]))
    known = {each.cells.force: each for each in study.misfit.forces}
    have = {name: _points(*each.cells.at[:5]) for name, each in known.items()}

    def spread(added: Candidate | None) -> FloatArray:
        total = np.eye(z.size) / PRIOR**2
        for force in dict.fromkeys([*have, *(added.forces if added else ())]):
            parts = [have[force]] if force in have else []
            parts += [added.data] if added and force in added.forces else []
            total += _information(study, problem, z, force, parts, known.get(force))
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(total))))

    before = spread(None)
    best = dict.fromkeys(study.fit.names, (NO_RUN, LEAST_GAIN))
    for candidate in candidates(study):
        share = spread(candidate) / before
        for k, name in enumerate(problem.names):
            if name in best and share[k] < best[name][1]:
                best[name] = (candidate.words, float(share[k]))
    return {
        name: words if words == NO_RUN else f"{words} (standard deviation to {100 * share:.0f} %)"
        for name, (words, share) in best.items()
    }


def candidates(study: Study) -> tuple[Candidate, ...]:
    """Return the runs that are weighed: slips, loads and pressures beyond the campaign's."""
    data, fit = study.fit.problem.data, study.fit
    load, pressure = fit.reference.load, fit.reference.pressure
    side = tuple(n for n in ("Fy", "Mz") if n in fit.rmse) or ("Fy", "Mz")
    slide = float(np.rad2deg(study.slide["slip_angle"]))
    far = min(np.ceil(1.3 * max(slide, 3.0)), LARGEST_ANGLE)
    large = np.deg2rad([-far, -0.8 * far, 0.8 * far, far])
    small = np.deg2rad([s * a for a in _ANGLES for s in (-1.0, 1.0)])
    ratios = np.array([s * r for r in _RATIOS for s in (-1.0, 1.0)])
    one_load = np.ptp(data.load) < 0.3 * load
    other = 0.5 * float(data.load.min()) if one_load else 1.5 * float(data.load.max())
    at, several = f"at {load:.0f} N", "slip angles of 1 to 6 deg"
    drive = f"slip ratios of 0.01 to 0.15, drive and brake, {at}"
    asked = [
        (f"slip angles up to {far:.0f} deg {at}", side, (load, pressure, large)),
        (f"{several}, either sign, {at}", side, (load, pressure, small)),
        (f"{several} at another load, {other:.0f} N", side, (other, pressure, small)),
        (drive, ("Fx",), (load, pressure, 0.0, ratios)),
    ]
    if np.isfinite(pressure):
        words = f"{several} at {1.3e-5 * pressure:.2g} bar"
        asked.append((words, side, (load, 1.3 * pressure, small)))
    out = [Candidate(words, forces, _points(*where)) for words, forces, where in asked]
    if "Mz" not in fit.rmse and np.ptp(data.slip_angle) > 0.0:
        some = data.take(np.arange(0, len(data), max(1, len(data) // 200)))
        out.append(Candidate("Mz recorded in the same runs", ("Mz",), some))
    return tuple(out)


def _points(*conditions: FloatArray | float) -> ForceData:
    """Return points at loads, pressures, slip angles, slip ratios and cambers.

    Their forces are one: only slopes at the points matter.
    """
    given = np.broadcast_arrays(*conditions)
    one = np.ones(given[0].size)
    return replace(ForceData(*given), Fx=one, Fy=one, Mz=one)


def _opened(study: Study) -> BrushProblem:
    """Return the problem with the parameters that this campaign could not fit, free."""
    problem = study.fit.problem
    closed = {
        name: why
        for name, (_, why) in problem.fixed.items()
        if why.startswith(("assumed", "one load", "no ", "Fy is", "Fx is", "Mz is"))
    }
    names = [*problem.names, *closed]
    if "longitudinal_stiffness" not in names and "Fx" not in problem.forces:
        names.append("longitudinal_stiffness")
    fixed = {name: at for name, at in problem.fixed.items() if name not in closed}
    return replace(problem, names=tuple(names), fixed=fixed)


def _value(study: Study, name: str) -> float:
    values = study.fit.values
    if name == "longitudinal_stiffness" and name not in values:
        return values["lateral_stiffness"]
    return values.get(name, ASSUMED_HALF_LENGTH if name == "half_length" else 0.0)


def _information(
    study: Study,
    problem: BrushProblem,
    z: FloatArray,
    force: str,
    parts: Sequence[ForceData],
    known: ForceMisfit | None,
) -> FloatArray:
    """Return J^T K^-1 J of one force at points, with scatter and smooth misfit in K."""
    names = ("load", "pressure", "slip_angle", "slip_ratio", "camber")
    joined = _points(*(np.concatenate([getattr(part, n) for part in parts]) for n in names))
    here = replace(
        problem,
        data=joined,
        forces=(force,),
        half=ring_half(problem.tire, joined),
        scale=np.array([_scale(study, force)]),
    )
    slope = here.jacobian(z)
    if known is None:
        shape, variance = Shape(0.5, 1.0, 0.9), 1.0
    else:
        shape, variance = known.shape, min(known.variance, _MOST_VARIANCE)
    # a half length from the ring is no number of its own
    values = {name: value for name, value in study.fit.values.items() if np.isfinite(value)}
    at = places(point_parameters(values, joined, study.fit.reference, here.half), joined)
    scatter = (at[0] / study.misfit.load) ** 2
    smooth = kernel(force, shape, at, study.misfit.load)
    K = shape.share * smooth + np.diag((1.0 - shape.share) * scatter)
    floor = 1e-8 * float(np.trace(K)) / len(joined)
    solved = cho_solve(cho_factor(K + floor * np.eye(len(joined)), lower=True), slope)
    return np.asarray(slope.T @ solved / max(variance, 1e-12))


def _scale(study: Study, force: str) -> float:
    """Return the scale of a force; of one that was not recorded that of its like."""
    fit, known = study.fit, study.scale_of(force)
    if known is not None:
        return known
    size = fit.values["friction"] * fit.reference.load
    return _SHARE * size * (_value(study, "half_length") if force == "Mz" else 1.0)
