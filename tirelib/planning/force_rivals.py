"""Rivals for a force: what the present points say of each, and what each foretells of others.

As for strain (`tirelib.planning.rivals`), with points in the place of runs: variants of the brush
that lack no effect stand beside the parameters and strengths as unknowns with a prior.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.force_model import ForceBench
from tirelib.compare.force_points import ForcePoints
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.candidates import varies
from tirelib.diagnose.forces.ensemble import ANGLE, SET_POINT, variant
from tirelib.diagnose.forces.fit import WIDTH, ForceFit, Problem, slopes_at, with_effect
from tirelib.effects import Effect
from tirelib.errors import CalibrationError, TirelibError
from tirelib.identify.force_data import ForceData
from tirelib.planning.criterion import NOTHING, Forecast, Noise
from tirelib.planning.envelope import Envelope
from tirelib.units import to_si

MEMBERS = 60
LOST = 0.5
"""Chi-square by which a rival may be worse than without its effect before its fit has failed."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""
RATIO = 0.01
"""Standard deviation of the measured slip ratio, relative."""
TURN = float(to_si(1.0, "km/h", "speed"))
"""Least speed of a point."""


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
        return self.fit.strengths[-1] if self.name != NOTHING else np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class ForceTrial:
    """Rivals on the same points, under the same noise.

    Attributes
    ----------
    rivals : tuple of ForceRival
    left_out : mapping of name to reason
        Suspects whose fit failed.
    size : float, [-]
        Of the structural misfit; 1 is that of the variants of a diagnosis.
    noise : Noise
        Of one further point, [N] or [N m].
    """

    rivals: tuple[ForceRival, ...]
    left_out: Mapping[str, str]
    size: float
    noise: Noise


def force_axes(case: ForceCase) -> tuple[str, ...]:
    """Return the conditions that a further point of a force may have."""
    at = case.problem.bench.conditions
    slip = ("slip_ratio",) if case.quantity == "Fx" else ("slip_angle",)
    known = [name for name in ("load", "pressure", "speed") if np.isfinite(getattr(at, name)).all()]
    other = [
        name for name in ("slip_angle", "slip_ratio", "camber", "temperature")
        if name not in slip and varies(at, name)
    ]  # fmt: skip
    return (*known, *slip, *other)


def points_ahead(case: ForceCase, envelope: Envelope, wanted: FloatArray) -> Problem:
    """Return the present points and, after them in time, wanted ones, as one problem.

    What is not planned is as in the present points, on average; rolling is steady.
    """
    data, n = case.problem.bench.points.data, len(wanted)
    columns = dict(zip(envelope.names, wanted.T, strict=True))
    more = {}
    for field in fields(ForceData):
        if field.name == "block":
            more["block"] = data.block.max() + 1 + np.arange(n)
        elif field.name in ("Fx", "Fy", "Mz"):
            more[field.name] = np.full(n, np.nan)
        else:
            values = getattr(data, field.name)
            more[field.name] = columns.get(field.name, np.full(n, float(np.mean(values))))
    points = case.problem.bench.points
    every = {k: np.concatenate([getattr(data, k), v]) for k, v in more.items()}
    joint = ForcePoints(
        ForceData(**every), np.concatenate([points.slip_rate, np.zeros(n)]),
        np.concatenate([points.samples, np.ones(n, dtype=np.int64)]),
        np.concatenate([points.cell, points.cell.max() + 1 + np.arange(n)]),
        np.concatenate([points.sweep, np.zeros(n, dtype=bool)]),
    )  # fmt: skip
    bench = ForceBench.of(case.model, joint)
    order = np.concatenate([case.problem.bench.conditions.order, np.ones(n)])
    bench = replace(bench, conditions=replace(bench.conditions, order=order))
    return Problem(
        bench, case.quantity, np.concatenate([case.problem.measured, np.full(n, np.nan)]),
        case.problem.scale, every["block"],
    )  # fmt: skip


def structure_rows(
    joint: Problem, present: int, base: ForceFit, members: int, seed: int
) -> FloatArray:
    """Return what the base leaves of variants, each over the root of their number, (members, n).

    The base is fitted to the present points, the first ones of the joint problem.

    Raises
    ------
    CalibrationError
        If no variant can be computed.
    """
    random = np.random.default_rng(seed)
    slopes, plain = slopes_at(joint, base), joint.predict(base.values, base.changes)
    near = slopes[:, :present]
    inverse = np.linalg.inv(near @ near.T / joint.scale**2 + np.eye(len(near)) / WIDTH**2)
    rows: list[FloatArray] = []
    for _ in range(3 * members):
        try:
            made = variant(joint, base, 0.0, random) - plain
        except TirelibError:
            continue  # the draw is no tire
        moves = inverse @ (near @ made[:present]) / joint.scale**2
        rows.append(made - moves @ slopes)
        if len(rows) == members:
            break
    if not rows:
        raise CalibrationError(
            "next test: no variant of the brush has a solution in the envelope; declare narrower "
            "ranges"
        )
    found: FloatArray = np.array(rows) / np.sqrt(len(rows))
    return found


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
    structure : shape (n_members, n)
        At the present points (`structure_rows`).
    with_nothing : bool
        Whether the base itself is a rival.
    progress : callable, optional
    """
    noise, counted = _noise(case, base, structure)
    nothing = _rival(case, NOTHING, base, structure, counted)
    rivals, left_out = [nothing] if with_nothing else [], {}
    for effect, _ in suspects:
        if progress is not None:
            progress(f"fit with {effect.name}")
        try:
            fit = with_effect(case.problem, base, effect)
        except TirelibError as error:
            left_out[effect.name] = f"its fit did not converge: {error}"
            continue
        rival = _rival(case, effect.name, fit, structure, counted)
        if rival.cost > nothing.cost + LOST:
            left_out[effect.name] = (
                f"its fit did not reach the minimum: chi-square {rival.cost:.1f} with it, "
                f"{nothing.cost:.1f} without"
            )
        else:
            rivals.append(rival)
    return ForceTrial(tuple(rivals), left_out, 1.0, noise)


def _noise(case: ForceCase, base: ForceFit, structure: FloatArray) -> tuple[Noise, float]:
    """Return the noise of a further point, and that which counts in the present ones.

    What structure does not span is left by repeats. In the present points errors of one block go
    together: the noise counts as much larger as the square of their sum exceeds the sum of their
    squares.
    """
    random = case.noise if np.isfinite(case.noise) else case.problem.scale
    rest = case.problem.measured - base.predicted
    rows = np.concatenate([base.slopes, structure])
    normal = rows @ rows.T + random**2 * np.eye(len(rows))
    left = rest - np.linalg.solve(normal, rows @ rest) @ rows
    spread = float(np.sqrt(np.mean(left**2)))
    _, block = np.unique(case.problem.block, return_inverse=True)
    together = float(np.sum(np.bincount(np.ravel(block), left) ** 2) / np.sum(left**2))
    counted = max(spread, random) * float(np.sqrt(max(together, 1.0)))
    return Noise(float(random), float(np.sqrt(max(spread**2 - random**2, 0.0)))), counted


def _rival(
    case: ForceCase, name: str, fit: ForceFit, structure: FloatArray, white: float
) -> ForceRival:
    """Return a rival at its minimum in the metric of structure, linear about its exact fit."""
    rows = np.concatenate([fit.slopes, structure]) / white
    rest = (case.problem.measured - fit.predicted) / white
    prior = np.concatenate([np.full(len(fit.slopes), WIDTH**-2.0), np.ones(len(structure))])
    normal, right = rows @ rows.T + np.diag(prior), rows @ rest
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    weights = covariance @ right
    inside = True
    if name != NOTHING:
        effect, last = fit.effects[-1], len(fit.slopes)
        own = np.arange(last - effect.components, last)
        slack = RANGE_SLACK * effect.scale * np.sqrt(covariance[own, own])
        strength = fit.strengths[-1]
        inside = bool(((strength >= effect.low - slack) & (strength <= effect.high + slack)).all())
    return ForceRival(name, fit, weights, covariance, float(rest @ rest - right @ weights), inside)


def force_forecasts(trial: ForceTrial, ahead: Problem, structure: FloatArray) -> list[Forecast]:
    """Return what every rival says of points ahead, each one sample.

    Parameters
    ----------
    trial : ForceTrial
    ahead : Problem
        Of these points.
    structure : shape (n_members, n)
        There.

    Raises
    ------
    TirelibError
        If a rival has no solution at one of the points.
    """
    told = []
    for rival in trial.rivals:
        slopes = np.concatenate([slopes_at(ahead, rival.fit), structure])
        wave = ahead.predict(rival.fit.values, rival.fit.changes) + rival.weights @ slopes
        told.append(
            Forecast(
                wave[:, None], slopes[..., None], _set_points(ahead, rival.fit)[:, None],
                rival.covariance,
            )
        )  # fmt: skip
    return told


def _set_points(ahead: Problem, fit: ForceFit) -> FloatArray:
    """Return the change of the force for one standard deviation of each set point, (n, 4)."""
    at, here = ahead.bench.conditions, ahead.predict(fit.values, fit.changes)
    steps = {
        "load": SET_POINT * at.load, "pressure": SET_POINT * at.pressure,
        "slip_angle": np.full(len(at), ANGLE), "slip_ratio": RATIO * at.slip_ratio,
    }  # fmt: skip
    columns = []
    for name, step in steps.items():
        moved = getattr(at, name) + step
        data = replace(ahead.bench.points.data, **{name: moved})
        bench = replace(
            ahead.bench, points=replace(ahead.bench.points, data=data),
            conditions=replace(at, **{name: moved}),
        )  # fmt: skip
        there = replace(ahead, bench=bench).predict(fit.values, fit.changes)
        columns.append(np.nan_to_num(there - here))
    return np.stack(columns, axis=1)
