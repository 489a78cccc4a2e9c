"""Structural variants of the user's own brush, with no effect: what the scores do by themselves.

A brush is not a tire, and what it lacks looks to some extent like one effect or another. So the
scores of the data are held against those of forces that variants of the model make: another shape
of the pressure, a carcass that turns, a stiffness over load that is no power, the shape of the
Magic Formula over slip, a smooth misfit over slip and load, a friction that drifts as the test goes
on, a slip angle that comes late or is off; at the user's plan, with set-point errors and noise.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.forces.fit import ForceFit, Problem, moved
from tirelib.diagnose.forces.ranking import ForceRanking
from tirelib.errors import TirelibError
from tirelib.model.brush import BrushState, brush_forces

MEMBERS = 100
BACK_STEPS = 5
FLATNESS = (-0.4, 1.2)
"""Shape of the pressure, as in `tirelib.brush.shaped`."""
YAW = 1e-4
"""Largest yaw compliance of the carcass, [rad/(N m)]."""
SHAPE_C, SHAPE_E, SHAPE_SHARE = (1.05, 1.5), (-1.0, 0.6), (0.0, 1.0)
"""Shape and curvature factor of the Magic Formula, and how far the force goes over to it."""
BEND = 0.03
"""Standard deviation of the bend of stiffness over load: that of ln c over (ln Fz)^2."""
SMOOTH = 0.01
"""Rms of the smooth misfit over slip and load, relative."""
DRIFT = 0.01
"""Rms of the drift of friction through a sweep, relative."""
DRIFT_TIMES = 4
DELAY = 0.008
"""Largest time by which the slip angle may come late or early, [s]."""
ANGLE = 3e-4
"""Standard deviation of the slip angle's zero from block to block, [rad]."""
SET_POINT = 0.005
"""The same of measured load and pressure, relative."""
_FEATURES = 6


@dataclass(frozen=True, slots=True, eq=False)
class ForceEnsemble:
    """Scores of the variants.

    Attributes
    ----------
    scores : shape (n_members, n_candidates)
    after : shape (n_members,), [-]
        Rms of the scaled residual after the joint fit.
    before : shape (n_members,), [-]
        The same with the base alone.
    """

    scores: FloatArray
    after: FloatArray
    before: FloatArray
    rests: FloatArray

    @property
    def threshold(self) -> FloatArray:
        """Largest score of the variants, per candidate."""
        largest: FloatArray = self.scores.max(axis=0)
        return largest


def force_ensemble(
    problem: Problem,
    model: ForceFit,
    ranking: ForceRanking,
    *,
    noise: float,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ForceEnsemble:
    """Return the scores of variants of a model at the plan of the data.

    Parameters
    ----------
    noise : float, [N] or [N m]
        Of a point, from repeats.
    members, seed : int
    progress : callable, optional
        Called after each member.
    """
    random = np.random.default_rng(seed)
    rows = model.slopes / problem.scale
    normal = rows @ rows.T + 1e-6 * np.eye(len(rows))
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    scores: list[FloatArray] = []
    after: list[float] = []
    before: list[float] = []
    rests: list[FloatArray] = []
    attempts = 0
    while len(scores) < members and attempts < 3 * members:
        attempts += 1
        try:
            measured = variant(problem, model, noise, random)
            rest = np.subtract(measured, _refitted(problem, model, measured, rows, inverse))
        except TirelibError:
            continue  # the draw is no tire
        found = ranking.scores(rest)
        scores.append(found.score)
        after.append(found.after)
        before.append(found.before)
        rests.append(rest / problem.scale)
        if progress is not None:
            progress(f"variant {len(scores)}")
    n = len(ranking.found.living)
    return ForceEnsemble(
        np.array(scores).reshape(len(scores), n),
        np.array(after),
        np.array(before),
        np.array(rests).reshape(len(rests), len(problem)),
    )


def variant(
    problem: Problem, model: ForceFit, noise: float, random: np.random.Generator
) -> FloatArray:
    """Return the force of one variant, measured, shape (n,)."""
    bench, at = problem.bench, problem.bench.conditions
    n = len(problem)
    _, block = np.unique(problem.block, return_inverse=True)
    block = np.asarray(block).ravel()
    blocks = int(block.max()) + 1

    def per_block(size: float) -> FloatArray:
        out: FloatArray = size * random.standard_normal(blocks)[block]
        return out

    late = random.uniform(-DELAY, DELAY)
    load = at.load * (1.0 + per_block(SET_POINT))
    pressure = at.pressure * (1.0 + per_block(SET_POINT))
    slip = at.slip_angle - late * at.slip_rate + per_block(ANGLE)
    data = replace(bench.points.data, load=load, pressure=pressure, slip_angle=slip)
    really = replace(
        bench,
        points=replace(bench.points, data=data),
        conditions=replace(at, load=load, pressure=pressure, slip_angle=slip),
    )
    state = really.state(model.values)
    drift = _drift(at.order, random)
    flat = random.uniform(*FLATNESS)
    yaw = random.uniform(0.0, YAW)
    bend = np.exp(BEND * random.standard_normal() * np.log(load / np.median(load)) ** 2)

    def structure(before: BrushState) -> BrushState:
        return before.but(
            mu=before.mu * (1.0 + drift),
            c_py=before.c_py * bend,
            c_px=before.c_px * bend,
            flatness=np.clip(before.flatness + flat, -0.5, 2.5),
            yaw_compliance=before.yaw_compliance + yaw,
        )

    changes = [*model.changes, ("brush", structure)]
    found: FloatArray = getattr(brush_forces(state, changes), problem.quantity)
    offset: FloatArray = getattr(state, f"{problem.quantity}_offset")
    x = _slip_of(state, problem.quantity)
    factor = _magic(np.abs(x), random) * (1.0 + _smooth(x, load, random))
    measured: FloatArray = offset + (found - offset) * factor
    return measured + noise * random.standard_normal(n)


def _slip_of(state: BrushState, quantity: str) -> FloatArray:
    """Return the slip over that from which all slides, times three: C tan(alpha) / (mu Fz)."""
    slip = np.tan(state.slip_angle)
    stiffness = state.c_py
    if quantity == "Fx":
        slip, stiffness = state.slip_ratio, state.c_px
    out: FloatArray = 2.0 * stiffness * state.a**2 * slip / (state.mu * state.conditions.load)
    return out


def _magic(x: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return the Magic Formula of slope and peak one over the brush's curve, at slips x >= 0."""
    c, e = random.uniform(*SHAPE_C), random.uniform(*SHAPE_E)
    b = 1.0 / c
    magic = np.sin(c * np.arctan(b * x - e * (b * x - np.arctan(b * x))))
    t = np.minimum(x / 3.0, 1.0)
    brush = 3.0 * t - 3.0 * t**2 + t**3
    share = random.uniform(*SHAPE_SHARE)
    ratio = np.where(x > 1e-6, magic / np.where(brush > 0.0, brush, 1.0), 1.0)
    out: FloatArray = 1.0 + share * (ratio - 1.0)
    return out


def _smooth(x: FloatArray, load: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return a smooth random function of signed slip and load."""
    u = np.arcsinh(x)
    v = np.log(load / np.median(load))
    out = np.zeros_like(x)
    for _ in range(_FEATURES):
        along, across = 0.8 * random.standard_normal(), 0.8 * random.standard_normal()
        out = out + np.cos(along * u + across * v + random.uniform(0.0, 2.0 * np.pi))
    result: FloatArray = SMOOTH * np.sqrt(2.0 / _FEATURES) * out
    return result


def _drift(order: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return a slow random function of the place in the campaign."""
    nodes = np.linspace(0.0, 1.0, DRIFT_TIMES + 1)
    out: FloatArray = DRIFT * np.interp(order, nodes, random.standard_normal(nodes.size))
    return out


def _refitted(
    problem: Problem, model: ForceFit, measured: FloatArray, rows: FloatArray, inverse: FloatArray
) -> FloatArray:
    """Return the model brought near a measurement by chord steps that lower the misfit."""
    z, k = np.zeros(len(rows)), len(model.names)
    fitted, size = model.predicted, float(np.sum((measured - model.predicted) ** 2))
    share = 1.0
    for _ in range(BACK_STEPS):
        step = inverse @ (rows @ ((measured - fitted) / problem.scale))
        trial = z + share * np.clip(step, -0.4, 0.4)
        values = moved(model.values, model.names, trial[:k])
        # strengths move to first order only, their laws may end nearby
        found = problem.predict(values, model.changes) + trial[k:] @ model.slopes[k:]
        left = float(np.sum((measured - found) ** 2))
        if left < size:
            z, fitted, size = trial, found, left
        else:
            share *= 0.3
    return fitted
