"""Rivals for a force: what the present points say of each, and what each foretells of others.

What plain tires show beside a brush stands beside its parameters and strengths as unknowns with a
prior. Set points that are off in a block belong to the noise.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.fit import ForceFit, Problem, slopes_at, with_effect
from tirelib.diagnose.forces.models import plain_tires
from tirelib.effects import CATALOGUE, Effect
from tirelib.errors import TirelibError
from tirelib.identify.force_data import ForceData
from tirelib.identify.force_points import ForcePoints
from tirelib.infer.hypothesis import SLACK
from tirelib.infer.plain import pooled
from tirelib.infer.problem import Point
from tirelib.planning.criterion import NOTHING, Forecast, Noise
from tirelib.planning.envelope import Envelope
from tirelib.planning.force_noise import Counted, counted_noise, set_points
from tirelib.planning.on_trial import fitted_rivals
from tirelib.planning.sweep import campaign_sweep
from tirelib.problems.forces import WIDTH, ForceProblem, varies


@dataclass(frozen=True, slots=True, eq=False)
class ForceRival:
    """A suspect fitted to the present points.

    Attributes
    ----------
    name : str
        Of the effect, or `NOTHING`.
    fit : ForceFit
        With the effect, exact.
    weights : shape (n_unknowns,)
        Moves of its coordinates from there, and the structural unknowns.
    covariance : shape (n_unknowns, n_unknowns)
    cost : float
        Chi-square left on the present points.
    in_range : bool
    """

    name: str
    fit: ForceFit
    weights: FloatArray
    covariance: FloatArray
    cost: float
    in_range: bool

    @property
    def strength(self) -> FloatArray:
        """In the effect's unit, (components,); empty for `NOTHING`."""
        if self.name == NOTHING:
            return np.zeros(0)
        effect, last = self.fit.effects[-1], len(self.fit.slopes)
        moves = self.weights[last - effect.components : last]
        return np.asarray(self.fit.strengths[-1] + effect.scale * moves)


@dataclass(frozen=True, slots=True, eq=False)
class ForceTrial:
    """Rivals on the same points, under the same noise.

    Attributes
    ----------
    rivals : tuple of ForceRival
    left_out : mapping of name to reason
        Suspects whose fit failed.
    size : float, [-]
        Of the structural misfit; 1 is that of plain tires.
    noise : Noise
        Of one further point, [N] or [N m].
    counted : Counted
        That which counts in the present points.
    """

    rivals: tuple[ForceRival, ...]
    left_out: Mapping[str, str]
    size: float
    noise: Noise
    counted: Counted


def force_axes(case: ForceCase) -> tuple[str, ...]:
    """Return the conditions that a further point of a force may have."""
    at = case.problem.bench.conditions
    slip = ("slip_ratio",) if case.quantity == "Fx" else ("slip_angle",)
    known = [name for name in ("load", "pressure", "speed") if np.isfinite(getattr(at, name)).all()]
    other = [
        name
        for name in ("slip_angle", "slip_ratio", "camber", "temperature")
        if name not in slip and varies(at, name)
    ]
    return (*known, *slip, *other)


def force_envelope(case: ForceCase, sweep: bool | None = None, **declared: Any) -> Envelope:
    """Return the envelope of further runs of a force: sweeps where the campaign's runs are such.

    Parameters
    ----------
    case : ForceCase
    sweep : bool, optional
        Whether a run is a sweep of the slip; by default as the campaign's runs are.
    declared : (low, high) or None
        By axis, SI, as for `Envelope.of`.

    Raises
    ------
    ParameterError
        As `Envelope.of`; or the declared range of the slip holds none of the campaign's slips.
    """
    envelope = Envelope.of(case.problem.bench.conditions, force_axes(case), **declared)
    name = "slip_ratio" if case.quantity == "Fx" else "slip_angle"
    found = campaign_sweep(case.problem.bench.points, name, sweep)
    return envelope if found is None else envelope.swept(found)


def points_ahead(case: ForceCase, envelope: Envelope, wanted: FloatArray) -> Problem:
    """Return the present points and, after them in time, those of wanted runs, as one problem.

    What is not planned is as in the present points, on average; rolling is steady. The points of a
    sweep follow each other and are one block, for a run's set points are off alike.
    """
    data, sweep, size = case.problem.bench.points.data, envelope.sweep, envelope.points
    n, rate = len(wanted) * size, np.zeros(len(wanted) * size)
    columns = dict(zip(envelope.names, np.repeat(wanted, size, axis=0).T, strict=True))
    if sweep is not None:
        columns[sweep.name] = np.tile(sweep.values, len(wanted))
        rate = np.tile(sweep.rates, len(wanted))
    more = {}
    for field in fields(ForceData):
        if field.name == "block":
            more["block"] = data.block.max() + 1 + np.repeat(np.arange(len(wanted)), size)
        elif field.name in ("Fx", "Fy", "Mz"):
            more[field.name] = np.full(n, np.nan)
        else:
            values = getattr(data, field.name)
            more[field.name] = columns.get(field.name, np.full(n, float(np.mean(values))))
    points = case.problem.bench.points
    every = {k: np.concatenate([getattr(data, k), v]) for k, v in more.items()}
    joint = ForcePoints(
        ForceData(**every),
        np.concatenate([points.slip_rate, rate]),
        np.concatenate([points.samples, np.ones(n, dtype=np.int64)]),
        np.concatenate([points.cell, points.cell.max() + 1 + np.arange(n)]),
        np.concatenate([points.sweep, np.full(n, bool(rate.any()))]),
    )
    bench = case.model.bench(joint)
    order = np.concatenate([case.problem.bench.conditions.order, np.ones(n)])
    bench = replace(bench, conditions=replace(bench.conditions, order=order))
    return Problem(
        bench,
        case.quantity,
        np.concatenate([case.problem.measured, np.full(n, np.nan)]),
        case.problem.scale,
        every["block"],
    )


def structure_rows(joint: Problem, present: int, base: ForceFit) -> FloatArray:
    """Return what the base leaves of what plain tires show, rows of one standard deviation, (m, n).

    Each is an effect at what plain tires show of it, or a smooth shape. The base is fitted to the
    present points, the first ones of the joint problem.
    """
    data = joint.bench.points.data
    plain = joint.predict(base.values, base.changes)
    told = {joint.quantity: np.where(np.isfinite(joint.measured), joint.measured, plain)}
    points = replace(joint.bench.points, data=replace(data, **told))
    problem = ForceProblem(
        replace(joint.bench, points=points),
        joint.quantity,
        base.values,
        list(CATALOGUE.values()),
        noise=float("nan"),
        effects=base.effects,
        strengths=base.strengths,
    )
    spread = pooled(plain_tires(joint.quantity), {})
    at, others = problem.start, problem.living
    strengths = (*at.strengths, *(np.zeros(effect.components) for effect in others))
    point = Point(at.base, (*at.effects, *others), strengths)
    solved = problem.solve(point)
    groups = dict(problem.remainder(point, solved))
    last = problem.slopes(point, solved)
    for effect in reversed(others):
        last, groups[effect.name] = last[: -effect.components], last[-effect.components :]
    rows = np.concatenate(
        [np.sqrt(spread.get(name, 0.0)) * block for name, block in groups.items()]
    )
    slopes = slopes_at(joint, base)
    near = slopes[:, :present]
    inverse = np.linalg.inv(near @ near.T / joint.scale**2 + np.eye(len(near)) / WIDTH**2)
    moves = rows[:, :present] @ near.T @ inverse / joint.scale**2
    return np.asarray(rows - moves @ slopes)


def try_force_suspects(
    case: ForceCase,
    base: ForceFit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    structure: FloatArray,
    *,
    with_nothing: bool = False,
    progress: Callable[[str], None] | None = None,
) -> ForceTrial:
    """Fit every suspect to the present points.

    Parameters
    ----------
    case : ForceCase
    base : ForceFit
        The model without any of the suspects, fitted.
    suspects : sequence of (effect, start strength)
    structure : shape (m, n)
        At the present points (`structure_rows`).
    with_nothing : bool
        Whether the base itself is a rival.
    progress : callable, optional
    """
    noise, white = counted_noise(case, base, structure, _suspected(case, base, suspects))
    fits = {
        effect.name: partial(_with, case, base, effect, structure, white) for effect, _ in suspects
    }
    rivals, left_out = fitted_rivals(
        fits,
        _rival(case, NOTHING, base, structure, white),
        with_nothing=with_nothing,
        progress=progress,
    )
    return ForceTrial(rivals, left_out, 1.0, noise, white)


def _faint(case: ForceCase, base: ForceFit, effect: Effect) -> ForceFit:
    """Return the base with an effect of strength zero, and the slopes there."""
    zero = replace(
        base,
        effects=(*base.effects, effect),
        strengths=(*base.strengths, np.zeros(effect.components)),
    )
    return replace(zero, slopes=slopes_at(case.problem, zero))


def _suspected(
    case: ForceCase, base: ForceFit, suspects: Sequence[tuple[Effect, FloatArray]]
) -> FloatArray:
    """Return the slopes by the strengths of those suspects that can be computed."""
    rows = [np.zeros((0, len(case.problem)))]
    for effect, _ in suspects:
        try:
            rows.append(_faint(case, base, effect).slopes[len(base.slopes) :])
        except TirelibError:
            continue  # its fit will fail and say why
    return np.concatenate(rows)


def _with(
    case: ForceCase, base: ForceFit, effect: Effect, structure: FloatArray, white: Counted
) -> ForceRival:
    """Return the rival of an effect: about its own fit, or about strength zero if that is better.

    The fit is the best without structure; beside it, it may be a worse place to start from.
    """
    about = (with_effect(case.problem, base, effect), _faint(case, base, effect))
    found = [_rival(case, effect.name, fit, structure, white) for fit in about]
    return min(found, key=lambda rival: rival.cost)


def _rival(
    case: ForceCase, name: str, fit: ForceFit, structure: FloatArray, white: Counted
) -> ForceRival:
    """Return a rival at its minimum in the metric of structure, linear about its exact fit."""
    rows = white(np.concatenate([fit.slopes, structure]))
    rest = white(case.problem.measured - fit.predicted)
    prior = np.concatenate([np.full(len(fit.slopes), WIDTH**-2.0), np.ones(len(structure))])
    normal, right = rows @ rows.T + np.diag(prior), rows @ rest
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    weights = covariance @ right
    rival = ForceRival(name, fit, weights, covariance, float(rest @ rest - right @ weights), True)
    if name != NOTHING:
        effect, last = fit.effects[-1], len(fit.slopes)
        own = np.arange(last - effect.components, last)
        slack = SLACK * effect.scale * np.sqrt(covariance[own, own])
        low, high = effect.low - slack, effect.high + slack
        inside = (rival.strength >= low) & (rival.strength <= high)
        rival = replace(rival, in_range=bool(inside.all()))
    return rival


def force_forecasts(
    trial: ForceTrial, ahead: Problem, structure: FloatArray, size: int = 1
) -> list[Forecast]:
    """Return what every rival says of runs ahead, each point of them one sample.

    Parameters
    ----------
    trial : ForceTrial
    ahead : Problem
        Of their points, run after run.
    structure : shape (m, n)
        There.
    size : int
        Points of a run. Its set points are off alike in all of them.

    Raises
    ------
    TirelibError
        If a rival has no solution at one of the points.
    """
    told = []
    for rival in trial.rivals:
        slopes = np.concatenate([slopes_at(ahead, rival.fit), structure])
        wave = ahead.predict(rival.fit.values, rival.fit.changes) + rival.weights @ slopes
        off = set_points(ahead, rival.fit)
        told.append(
            Forecast(
                wave.reshape(-1, size),
                slopes.reshape(len(slopes), -1, size),
                trial.counted.share * off.reshape(-1, size, off.shape[1]),
                rival.covariance,
            )
        )
    return told
