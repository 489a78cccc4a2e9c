"""The problem of strain: mean waveforms of straight runs and the rolling ring.

Coordinates of the base are those of the tire (`tirelib.model.base.coordinates`) and the delay of
the gages against the trigger.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.effects.effect import Strength
from tirelib.errors import ParameterError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.delay import STD, UNIT, by_delay, earlier
from tirelib.identify.discrepancy import (
    REFERENCE_LOAD,
    REFERENCE_OMEGA,
    REFERENCE_PRESSURE,
    Discrepancy,
    bumps,
)
from tirelib.identify.random_effects import scales, tangents
from tirelib.infer.problem import Point
from tirelib.infer.whiten import INSIDE, Whitener
from tirelib.model.base import Correction, coordinates, move, predict
from tirelib.model.chain import Changes
from tirelib.model.state import State
from tirelib.model.whole import Whole, WholeSlopes, solve_whole, whole_slopes
from tirelib.waveforms import GRID

Values = Mapping[str, float | FloatArray]

WIDTH = {
    "bending_stiffness": 0.7,
    "radial_stiffness": 0.7,
    "radial_pressure_slope": 1.5,
    "tangential_stiffness": 1.0,
    "tangential_pressure_slope": 1.5,
    "tread_stiffness": 0.9,
    "innerliner_offset": 0.15,
    "extension_stiffness": 0.7,
    "shear_stiffness": 0.7,
    "rotary_inertia": 1.0,
    "tread_shear_stiffness": 1.0,
    "tread_hardening": 0.7,
    "section_pull": 1.5,
    "liner_share": 1.0,
    "tread_poisson": 1.0,
    "contact_crown": 1.3,
}
"""Prior standard deviations of the base's coordinates: wide, the campaign informs them."""
IN_BASE = {
    "belt_extension": "extension_stiffness",
    "belt_shear": "shear_stiffness",
    "rotary_inertia": "rotary_inertia",
}
"""Effects that the base may have as a number."""
STILL = {"slip_angle": 5e-3, "camber": 5e-3, "slip_ratio": 5e-3}
"""What straight free rolling lacks, and the least that counts, [rad], [rad], [-]."""
SHAPES = Discrepancy(inside=1.0, outside=0.15, by_load=1.0, by_pressure=1.0, by_speed=1.0)
OWN = 0.004
"""A run's own misfit over its rms strain, in the contact."""
LEAST_SIGNAL = 3.0
"""Whitened norm below which an effect at the end of its range is dead."""
LEAST_STEP = 1e-3
NEAR = 0.2
"""Move of a strength, in ranges, within which what it adds to the slopes is kept."""
NEAR_BASE = 0.1
"""The same of the base's coordinates."""
UNKNOWN_NOISE = 0.005
"""Noise over the rms strain where there are no repeats."""


@dataclass(frozen=True, slots=True, eq=False)
class StrainSolved:
    """The model at a point, `tirelib.infer.problem.Solved`."""

    rest: FloatArray
    values: Values
    whole: Whole
    correction: Correction
    waveform: FloatArray
    deflection: FloatArray
    changes: Changes
    delay: float


@dataclass(frozen=True, slots=True, eq=False)
class _Changed:
    """What effects add to the slopes by the tire's coordinates, and the point it was taken at."""

    point: Point
    slopes: FloatArray

    def serves(self, point: Point) -> bool:
        """Return whether a point is so near that these slopes do."""
        same = self.point.effects == point.effects
        near = float(np.abs(self.point.base - point.base).max()) < NEAR_BASE
        return (
            same
            and near
            and all(
                float(np.abs(a - b).max()) < NEAR * effect.scale
                for effect, a, b in zip(
                    point.effects, self.point.strengths, point.strengths, strict=True
                )
            )
        )


class StrainProblem:
    """Straight runs of a campaign and the model of a tire.

    Parameters
    ----------
    runs : StraightRuns
    values : mapping
        Of the model's tire.
    catalogue : sequence of Effect
    effects, strengths
        That the model has already.
    """

    def __init__(
        self,
        runs: StraightRuns,
        values: Values,
        catalogue: Sequence[Effect],
        effects: Sequence[Effect] = (),
        strengths: Sequence[FloatArray] = (),
    ) -> None:
        self.runs, self.values = runs, dict(values)
        self.data = runs.data(with_deflection=False)
        self.free = coordinates(values)
        self.start = Point(np.zeros(len(self.free) + 1), tuple(effects), tuple(strengths))
        self.widths = np.array([*(WIDTH[c.name] for c in self.free), STD / UNIT])
        self.dead: dict[str, str] = {}
        typical = float(np.sqrt(np.mean(runs.strain**2)))
        noise = runs.noise.std if runs.noise.known else UNKNOWN_NOISE * typical
        solved = self._solve(self.start, None)
        self.half_angle = 0.6 * np.sqrt(
            2.0 * solved.deflection / float(np.max(self.values["free_radius"]))
        )
        self.reference = solved
        slopes = self._base_slopes(solved)
        self._tangent = tangents(solved.waveform, slopes.waveform[-2], slopes.waveform[-1])
        self._noise = noise
        self._whiteners: dict[float, Whitener] = {}
        self._changed: _Changed | None = None
        self.living = self._alive(catalogue)

    def whitener(self, own: float) -> Whitener:
        """Return the whitening for a misfit of each run of this size."""
        if own not in self._whiteners:
            self._whiteners[own] = Whitener.of(
                self.reference.waveform,
                self._tangent,
                scales(self.data.tolerance, self.data.angle_std),
                self.half_angle,
                self.data.points,
                self.data.low_pass,
                noise=self._noise,
                own=own,
            )
        return self._whiteners[own]

    def solve(self, point: Point, near: StrainSolved | None = None) -> StrainSolved:
        """Return the model at a point; raises TirelibError where it has none."""
        solved = self._solve(point, near or self.reference)
        return replace(solved, rest=self.data.strain - solved.waveform)

    def _solve(self, point: Point, near: StrainSolved | None) -> StrainSolved:
        data, values = self.data, move(self.values, point.base[:-1], self.free)
        start = None if near is None or near.whole.contact is None else near.whole.contact.x
        whole = solve_whole(
            {**values, "damping": 0.0}, data.points, low_pass=data.low_pass, start=start
        )
        linear = predict({**values, "damping": 0.0}, data.points, low_pass=data.low_pass)
        correction = Correction(
            whole.waveform - linear.wave,
            whole.deflection - linear.deflection,
            start=linear.contact.start if linear.contact else None,
        )
        changes = _changes(point)
        state = self._predict(values, changes, correction)
        delay = UNIT * float(point.base[-1])
        wave = earlier(state.wave, data.points.omega, -delay)
        return StrainSolved(
            np.zeros(0), values, whole, correction, wave, state.deflection, changes, delay
        )

    def _predict(self, values: Values, changes: Changes, correction: Correction) -> State:
        return predict(
            values,
            self.data.points,
            changes,
            low_pass=self.data.low_pass,
            correction=correction,
        )

    def _base_slopes(self, solved: StrainSolved) -> WholeSlopes:
        still = {**solved.values, "damping": 0.0}
        return whole_slopes(
            solved.whole, still, self.data.points, self.free, low_pass=self.data.low_pass
        )

    def slopes(self, point: Point, solved: StrainSolved) -> FloatArray:
        """Return slopes by the base, the delay and strengths in ranges."""
        slopes = self._base_slopes(solved).waveform[: len(self.free)]
        if point.effects:
            if self._changed is None or not self._changed.serves(point):
                self._changed = _Changed(point, self._changed_slopes(solved))
            slopes = slopes + self._changed.slopes
        rows = [*slopes, by_delay(solved.waveform, self.data.points.omega)]
        for k, effect in enumerate(point.effects):
            for j in range(effect.components):
                step = LEAST_STEP * effect.toward
                strengths = [s.copy() for s in point.strengths]
                strengths[k][j] += step
                moved = replace(point, strengths=tuple(strengths))
                wave = self._predict(solved.values, _changes(moved), solved.correction).wave
                late = earlier(wave, self.data.points.omega, -solved.delay)
                rows.append((late - solved.waveform) * (effect.scale / step))
        return np.array(rows)

    def _changed_slopes(self, solved: StrainSolved) -> FloatArray:
        """Return what effects add to the slopes of the waveform by the tire's coordinates."""
        here = self._added(solved.values, solved)
        rows = []
        for coordinate in self.free:
            value = np.asarray(solved.values[coordinate.name], dtype=float)
            moved = {**solved.values, coordinate.name: coordinate.moved(value, LEAST_STEP)}
            rows.append((self._added(moved, solved) - here) / LEAST_STEP)
        return np.array(rows)

    def _added(self, values: Values, solved: StrainSolved) -> FloatArray:
        """Return what the effects of a solution add to the waveform of a tire nearby."""
        with_them = self._predict(values, solved.changes, solved.correction)
        return with_them.wave - self._predict(values, (), solved.correction).wave

    def signatures(self, point: Point, solved: StrainSolved) -> dict[str, FloatArray]:
        """Return changes per range of the living effects that the point has not."""
        has = {effect.name for effect in point.effects}
        return {
            effect.name: self.signature(solved, effect)
            for effect in self.living
            if effect.name not in has
        }

    def signature(
        self,
        solved: StrainSolved,
        effect: Effect,
        trials: Sequence[Strength] | None = None,
        size: float | None = None,
    ) -> FloatArray:
        """Return changes (components, n_runs, n_phi) for a strength of one range."""
        omega = self.data.points.omega
        rows = []
        for trial in effect.trials if trials is None else trials:
            state = self._predict(
                solved.values, [*solved.changes, effect.at(trial)], solved.correction
            )
            change = earlier(state.wave, omega, -solved.delay) - solved.waveform
            rows.append(change * (effect.scale / (effect.step if size is None else size)))
        return np.array(rows)

    def remainder(self, point: Point, solved: StrainSolved) -> dict[str, FloatArray]:
        """Return smooth shapes over the wheel angle, by how they go with a run's conditions."""
        columns = SHAPES.columns(solved.waveform, self.half_angle, self.data.points, GRID)
        knots = SHAPES.knots
        centre = np.sinh(np.linspace(-np.arcsinh(SHAPES.reach), np.arcsinh(SHAPES.reach), knots))
        groups = {}
        for k, name in enumerate(("constant", "load", "pressure", "speed")):
            rows = columns[k * knots : (k + 1) * knots]
            groups[f"{name}, contact"] = rows[np.abs(centre) < INSIDE]
            groups[f"{name}, free belt"] = rows[np.abs(centre) >= INSIDE]
        return groups

    def roughly(self, rows: FloatArray) -> FloatArray:
        """Return how rows would look if their law were roughly right.

        Each goes otherwise with load, pressure, speed and time; and smooth shapes over the wheel
        angle, as large as the rows are in that run, are added, constant or going with load or
        speed.
        """
        p = self.data.points
        conditions = np.stack(
            [
                np.log(p.load / REFERENCE_LOAD),
                (p.omega / REFERENCE_OMEGA) ** 2,
                4.0 * (p.pressure / REFERENCE_PRESSURE - 1.0),
                2.0 * p.order - 1.0,
            ]
        )
        conditions = conditions - conditions.mean(axis=1, keepdims=True)
        otherwise = (conditions[:, None, :, None] * rows[None]).reshape(-1, *rows.shape[1:])
        square = np.sum(rows**2, axis=0)
        size = np.sqrt(0.5 * np.mean(square, axis=1, keepdims=True) + 0.5 * self._nearby(square))
        shape = bumps(GRID / self.half_angle[:, None], SHAPES.knots, SHAPES.reach) * size
        shape = shape - shape.mean(axis=2, keepdims=True)
        going = [shape * factor[:, None] for factor in conditions[:2]]
        return np.concatenate([otherwise, shape, *going])

    def _nearby(self, square: FloatArray) -> FloatArray:
        """Return squares (n_runs, n_phi) averaged over about half a contact's length."""
        order = np.fft.rfftfreq(GRID.size, 1.0 / GRID.size)
        gain = np.exp(-0.5 * (self.half_angle[:, None] * order) ** 2)
        return np.asarray(np.maximum(np.fft.irfft(np.fft.rfft(square) * gain, n=GRID.size), 0.0))

    def _alive(self, catalogue: Sequence[Effect]) -> tuple[Effect, ...]:
        """Return the effects that this plan may show; the others go to `dead`, with the reason."""
        numbers = {coordinate.name for coordinate in self.free}
        solved, living = self.solve(self.start), []
        for effect in catalogue:
            if effect.hook == "brush" or IN_BASE.get(effect.name) in numbers:
                continue
            reason = effect.untestable or self._idle(effect)
            if not reason:
                try:
                    rows = self.whitener(OWN)(self.signature(solved, effect))
                    signal = float(np.linalg.norm(rows))
                    if signal < LEAST_SIGNAL:
                        reason = "changes nothing that this plan could show" + (
                            f" (it varies with {', '.join(effect.varies_with)})"
                            if effect.varies_with
                            else ""
                        )
                except ParameterError as error:
                    reason = str(error)
            if reason:
                self.dead[effect.name] = reason
            else:
                living.append(effect)
        return tuple(living)

    def _idle(self, effect: Effect) -> str:
        """Return which condition that an effect varies with no run has, or is not measured."""
        points = self.data.points
        still = [
            name
            for name, least in STILL.items()
            if name in effect.varies_with
            and float(np.abs(np.nan_to_num(getattr(points, name))).max()) < least
        ]
        if still:
            return f"no run has a {' or '.join(still).replace('_', ' ')}"
        missing = effect.unknown(points)
        return f"{', '.join(missing)} is not measured in every run" if missing else ""


def _changes(point: Point) -> Changes:
    return [
        effect.at(float(s[0]) if effect.components == 1 else tuple(float(x) for x in s))
        for effect, s in zip(point.effects, point.strengths, strict=True)
    ]
