"""The problem of forces: points of one force and the brush.

Coordinates of the base are the brush's constants, as moves of their logarithms or over the sizes by
which `tirelib.identify` judges them (`SPECS`). Rows are forces at points.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import TirelibError
from tirelib.effects import Effect
from tirelib.effects.brush_state import BrushState
from tirelib.inference.identify.brush_fit import LOAD_RATIO
from tirelib.inference.identify.brush_law import SPECS
from tirelib.inference.identify.discrepancy import bumps
from tirelib.inference.identify.force_bench import Changes, ForceBench
from tirelib.inference.problems.force_plan import SPANS, blind, varies
from tirelib.inference.problems.whiten_forces import PointWhitener
from tirelib.inference.statistics.problem import Point
from tirelib.model.brush import brush_forces
from tirelib.model.brush_slopes import STATE_STEP, StateSlopes, moment_of

COORDINATES: Mapping[str, tuple[str, ...]] = {
    "Fy": ("lateral_stiffness", "friction", "load_power", "slip_angle_offset", "Fy_offset"),
    "Fx": ("longitudinal_stiffness", "friction", "load_power", "slip_ratio_offset", "Fx_offset"),
    "Mz": (
        "lateral_stiffness",
        "friction",
        "half_length",
        "load_power",
        "slip_angle_offset",
        "Mz_offset",
    ),
}
"""Constants of the brush that are fitted with each force; the others stay as the model has them."""
WIDTH = 1.0
"""Prior standard deviation of a coordinate."""
SET_POINTS = {"load": 0.005, "pressure": 0.005, "slip_ratio": 0.01}
"""Standard deviation of the measured conditions of a block, relative."""
ANGLE = 3e-4
"""The same of the slip angle's zero, [rad]."""
UNKNOWN_NOISE = 0.01
"""Noise over the rms force where nothing is repeated."""
OWN = 2.0
"""A block's own misfit over the rms force, for a size of one."""
KNOTS, REACH = 7, 4.0
"""Smooth shapes over the slip, and how far they reach in C slip / (mu Fz); from 3 on all slides."""
CONSTANT = 8.0
"""Size of a misfit that is the same at all conditions, over one that goes with a condition."""
LEAST_SIGNAL, LEAST_OWN = 3.0, 0.02
"""Whitened norm below which an effect at the end of its range is dead, and the share of it that the
base must not be able to mimic."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceSolved:
    """The model at a point, `tirelib.inference.statistics.problem.Solved`.

    Attributes
    ----------
    rest : shape (n,), [N] or [N m]
        Measured less model.
    force : shape (n,)
        The model's force.
    state : BrushState
        With the effects.
    turn : shape (n,), [rad]
        Angle by which the contact turns on its carcass.
    """

    rest: FloatArray
    force: FloatArray
    state: BrushState
    turn: FloatArray


class ForceProblem:
    """One force at points and the brush of a model.

    Parameters
    ----------
    bench : ForceBench
    quantity : str
        Fy, Fx or Mz.
    values : mapping
        Constants of the model's brush, SI.
    catalogue : sequence of Effect
    noise : float, [N] or [N m]
        Standard deviation of a point's noise, from repeats; NaN without.
    effects, strengths
        That the model has already.
    """

    def __init__(
        self,
        bench: ForceBench,
        quantity: str,
        values: Mapping[str, float],
        catalogue: Sequence[Effect],
        *,
        noise: float,
        effects: Sequence[Effect] = (),
        strengths: Sequence[FloatArray] = (),
    ) -> None:
        self.bench, self.quantity, self.values = bench, quantity, dict(values)
        self.measured: FloatArray = getattr(bench.points.data, quantity)
        load = bench.conditions.load
        of_contact = ("half_length", "load_power") if bench.half is not None else ()
        held = of_contact if load.max() >= LOAD_RATIO * load.min() else (*of_contact, "load_power")
        self.names = tuple(name for name in COORDINATES[quantity] if name not in held)
        self.start = Point(np.zeros(len(self.names)), tuple(effects), tuple(strengths))
        self.starts = (self.start,)
        self.widths = np.full(len(self.names), WIDTH)
        self.ends = -np.full(len(self.names), np.inf), np.full(len(self.names), np.inf)
        self.size = float(np.sqrt(np.mean(self.measured**2))) * load / np.sqrt(np.mean(load**2))
        self.noise_known = bool(np.isfinite(noise))
        noise = noise if self.noise_known else UNKNOWN_NOISE * float(np.mean(self.size))
        self.noise = np.full(load.size, noise)
        self.present = load.size  # points that are measured: the first ones
        self.dead: dict[str, str] = {}
        self.lookalike = 0.0  # `roughly` has every pair of conditions
        self._whiteners: dict[float, PointWhitener] = {}
        solved = self.solve(self.start)
        self.slip = slip_of(solved.state, quantity)
        self._tangent = self._by_set_points(solved)
        self._base, self._triangle = np.linalg.qr(self._by_base(solved))
        self.living = self._alive(catalogue, solved)

    def whitener(self, own: float) -> PointWhitener:
        """Return the whitening for a misfit of each block of this size."""
        if own not in self._whiteners:
            self._whiteners[own] = PointWhitener.of(
                self.bench.points.data.block,
                self._tangent,
                np.arcsinh(self.slip),
                OWN * own * self.size,
                noise=self.noise,
            )
        return self._whiteners[own]

    def followed_by(self, bench: ForceBench, repeats: FloatArray) -> "ForceProblem":
        """Return the problem with points ahead, whose force is zero, behind the present ones.

        Parameters
        ----------
        bench : ForceBench
            The present points and those ahead.
        repeats : shape (n_ahead,)
            Measurements of which each is the mean: noise and set points average, the misfit that a
            block has for itself does not.

        Raises
        ------
        TirelibError
            If the model has no solution at one of them.
        """
        out, n = copy(self), len(repeats)
        out.bench, out._whiteners = bench, {}
        out.measured = np.concatenate([self.measured, np.zeros(n)])
        load = bench.conditions.load
        out.size = self.size[0] * load / load[0]
        solved = out.solve(self.start)
        out.slip = slip_of(solved.state, self.quantity)
        share = 1.0 / np.sqrt(repeats)
        out.noise = np.concatenate([self.noise, np.mean(self.noise) * share])
        out._tangent = out._by_set_points(solved)
        out._tangent[self.present :] *= share[:, None]
        out._base = np.linalg.solve(self._triangle.T, out._by_base(solved).T).T
        return out

    @property
    def run_ahead(self) -> IntArray:
        """The run ahead that each point is of, -1 for the present ones."""
        block = self.bench.points.data.block
        return np.asarray(np.maximum(block - block[: self.present].max() - 1, -1))

    def own_misfit(self, own: float) -> float:
        """Return the standard deviation of a block's own misfit, as a mean, [N] or [N m]."""
        return OWN * own * float(np.mean(self.size[: self.present]))

    def part(self, chosen: BoolArray, start: Point) -> "ForceProblem":
        """Return the problem of some of the points (n,), without effects that may be missing."""
        out = copy(self)
        out.bench, out.measured = self.bench.take(chosen), self.measured[chosen]
        out.size, out.noise, out.slip = self.size[chosen], self.noise[chosen], self.slip[chosen]
        out._tangent, out._base = self._tangent[chosen], self._base[chosen]
        out.present, out._whiteners = int(chosen.sum()), {}
        out.start, out.starts, out.living = start, (start,), ()
        return out

    def repeated(self, times: float) -> "ForceProblem":
        """Return the problem of the same points, each the mean of so many measurements."""
        out = copy(self)
        out.noise, out._tangent = self.noise / np.sqrt(times), self._tangent / np.sqrt(times)
        out._whiteners = {}
        return out

    def _by_base(self, solved: ForceSolved) -> FloatArray:
        """Return slopes by the base over the size of the force, (n, n_base)."""
        return np.asarray((self.slopes(Point(self.start.base), solved) / self.size).T)

    def constants(self, point: Point) -> dict[str, float]:
        """Return the brush's constants at a point."""
        pairs = zip(self.names, point.base.tolist(), strict=True)
        moved = {k: SPECS[k].moved(self.values.get(k, 0.0), move) for k, move in pairs}
        return self.values | moved

    def thinned(self) -> "ForceProblem":
        """Return the problem itself: a fit to forces costs little."""
        return self

    def forget(self) -> None:
        """Do nothing: no slopes are kept."""

    def about(self, solved: ForceSolved) -> "ForceProblem":
        """Return the problem: its whitening stays about the given model."""
        return self

    def solve(self, point: Point, near: ForceSolved | None = None) -> ForceSolved:
        """Return the model at a point; raises TirelibError where it has none."""
        state = self._state(point)
        found = brush_forces(state)
        force: FloatArray = getattr(found, self.quantity)
        turn = state.yaw_compliance * moment_of(state, found)
        return ForceSolved(self.measured - force, force, state, turn)

    def _state(self, point: Point) -> BrushState:
        state = self.bench.state(self.constants(point))
        for _, change in changes_at(point.effects, point.strengths):
            state = change(state)
        return state

    def slopes(self, point: Point, solved: ForceSolved, *, near: bool = False) -> FloatArray:
        """Return slopes by the base and by strengths in ranges, (n_coordinates, n).

        Every point's force is a function of the state there, so that slopes by the state's fields
        are taken once, and each coordinate adds how it moves the fields. They are of this point,
        whether `near` would do or not.
        """
        by, rows = StateSlopes(solved.state, solved.turn, self.quantity), []
        for k in range(point.base.size):
            base = point.base.copy()
            base[k] += STATE_STEP
            rows.append(by.toward(self._state(replace(point, base=base))))
        for k, effect in enumerate(point.effects):
            for j in range(effect.components):
                strengths = [s.copy() for s in point.strengths]
                # into the range, for a law may end there
                inward = -1.0 if strengths[k][j] >= effect.high else 1.0
                strengths[k][j] += inward * STATE_STEP * effect.scale
                moved = self._state(replace(point, strengths=tuple(strengths)))
                rows.append(inward * by.toward(moved))
        return np.stack(rows) / STATE_STEP

    def remainder(self, point: Point, solved: ForceSolved) -> dict[str, FloatArray]:
        """Return smooth shapes over the slip, by how they go with the conditions of a point."""
        shapes = self._shapes() * self.size
        # what the base can mimic is the base's
        measured = shapes[:, : self.present] / self.size[: self.present]
        shapes = shapes - (measured @ self._base[: self.present]) @ self._base.T * self.size
        groups = {"constant, slip": CONSTANT * shapes}
        for name, factor in self._factors().items():
            groups[f"{name}, slip"] = shapes * factor
        return groups

    def roughly(
        self, point: Point, solved: ForceSolved, slopes: FloatArray, count: int
    ) -> Sequence[FloatArray]:
        """Return how the laws of effects may be off: smoothly over pairs of conditions.

        What an effect of one condition does may go otherwise over the slip, on either side of it,
        with its own condition and with every other one; each of these errors is as large as what
        all of the effects do together, for an effect may be small because the base or another one
        has done most of what its condition does.
        """
        factors, present = self._factors(), slice(self.present)
        first, done = len(point.base), []
        for size in point.ranges[:count]:
            done.append(size @ slopes[first : first + len(size)])
            first += len(size)
        whole = float(np.sqrt(sum(np.mean(each[present] ** 2) for each in done)))
        slips, out = self._shapes() * self.size, []
        for effect, each in zip(point.effects, done, strict=False):
            one = np.ones_like(self.size)
            own = [factors[name] for name in effect.varies_with if name in factors] or [one]
            pairs = [f * g for f in own for g in (one, *factors.values())]
            parts = [slips * pair for pair in pairs]
            squares = [np.mean(np.sum(part[:, present] ** 2, axis=0)) for part in parts]
            sizes = [np.sqrt(len(pairs) * square) for square in squares]
            smooth = [whole / size * part for part, size in zip(parts, sizes, strict=True)]
            otherwise = [each * (f - float(np.mean(f[present]))) for f in factors.values()]
            out.append(np.concatenate([*smooth, np.array(otherwise)]))
        return out

    def _shapes(self) -> FloatArray:
        return np.asarray(bumps(np.clip(self.slip, -REACH, REACH)[None], KNOTS, REACH)[:, 0])

    def _factors(self) -> dict[str, FloatArray]:
        """Return how a misfit may go with each condition that varies, about one at the ends."""
        at, measured = self.bench.conditions, self.bench.conditions.take(np.arange(self.present))
        middle = {name: float(np.median(np.abs(getattr(measured, name)))) for name in SPANS}
        every = {
            "load": np.log(at.load / middle["load"]),
            "pressure": 4.0 * (at.pressure / middle["pressure"] - 1.0),
            "camber": at.camber / np.deg2rad(5.0),
            "temperature": (at.temperature - middle["temperature"]) / 20.0,
            "speed": np.log(np.abs(at.speed) / middle["speed"]) if middle["speed"] else at.speed,
        }
        # a tire that rolls both ways at one speed has a speed that varies, and nothing goes with it
        n = self.present
        found = {k: f for k, f in every.items() if varies(measured, k) and np.ptp(f[:n]) > 0.0}
        return found | {"order": 2.0 * at.order - 1.0}

    def _by_set_points(self, solved: ForceSolved) -> FloatArray:
        """Return the change of the force by one standard deviation of each condition, (n, 4)."""
        at, points, columns = self.bench.conditions, self.bench.points, []
        moves = {n: (1.0 + s) * getattr(at, n) for n, s in SET_POINTS.items()}
        for name, moved in {**moves, "slip_angle": at.slip_angle + ANGLE}.items():
            bench = replace(
                self.bench,
                points=replace(points, data=replace(points.data, **{name: moved})),
                conditions=replace(at, **{name: moved}),
            )
            found = bench.forces(self.values, changes_at(self.start.effects, self.start.strengths))
            columns.append(np.nan_to_num(getattr(found, self.quantity) - solved.force))
        return np.stack(columns, axis=1)

    def _alive(self, catalogue: Sequence[Effect], solved: ForceSolved) -> tuple[Effect, ...]:
        """Return the effects that this plan may show; the others go to `dead`, with the reason."""
        whiten, has = self.whitener(0.0), {effect.name for effect in self.start.effects}
        base = whiten(self.slopes(self.start, solved))
        basis, living = np.linalg.qr(base.T)[0], []
        for effect in catalogue:
            if effect.hook != "brush" or effect.name in has:
                continue
            reason = blind(self.bench.conditions, effect) or self._hidden(
                effect, solved, whiten, basis
            )
            if reason:
                self.dead[effect.name] = reason
            else:
                living.append(effect)
        return tuple(living)

    def _hidden(
        self, effect: Effect, solved: ForceSolved, whiten: PointWhitener, basis: FloatArray
    ) -> str:
        start = self.start
        point = replace(
            start,
            effects=(*start.effects, effect),
            strengths=(*start.strengths, np.zeros(effect.components)),
        )
        try:
            rows = whiten(self.slopes(point, solved)[-effect.components :])
        except TirelibError as error:
            return f"cannot be computed at these conditions: {error}"
        whole = float(np.linalg.norm(rows))
        own = float(np.linalg.norm(rows - (rows @ basis) @ basis.T))
        if own >= max(LEAST_SIGNAL, LEAST_OWN * whole):
            return ""
        if effect.lacking:
            return effect.lacking
        if whole < LEAST_SIGNAL:
            return f"changes {self.quantity} at no point by more than noise"
        return "the brush's own parameters change the force alike at these conditions"


def slip_of(state: BrushState, quantity: str) -> FloatArray:
    """Return signed slip as C slip / (mu Fz): from 3 on the whole contact slides."""
    slip, stiffness = np.tan(state.slip_angle), state.c_py
    if quantity == "Fx":
        slip, stiffness = state.slip_ratio, state.c_px
    out: FloatArray = 2.0 * stiffness * state.a**2 * slip / (state.mu * state.conditions.load)
    return out


def changes_at(effects: Sequence[Effect], strengths: Sequence[FloatArray]) -> Changes:
    """Return effects at strengths as changes of the brush."""
    return [effect.at(each) for effect, each in zip(effects, strengths, strict=True)]
