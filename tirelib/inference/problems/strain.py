"""The problem of strain: mean waveforms of straight runs and the rolling ring.

Coordinates of the base are those of the tire (`tirelib.model.base.coordinates`) and the delay of
the gages against the trigger.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.effects import Effect
from tirelib.effects.state import Operating, State
from tirelib.inference.identify.campaign_data import StraightRuns, begins_with
from tirelib.inference.identify.delay import STD, UNIT, earlier
from tirelib.inference.identify.random_effects import scales, tangents
from tirelib.inference.problems.strain_laws import (
    LOOKALIKE_SHARE,
    as_large,
    beside,
    law_errors,
    stiffened,
)
from tirelib.inference.problems.strain_living import in_base, living
from tirelib.inference.problems.strain_prior import MEAN, WIDTH, as_in_literature
from tirelib.inference.problems.strain_shapes import smooth_shapes
from tirelib.inference.problems.strain_slopes import StrainSlopes, StrainSolved, changes_at
from tirelib.inference.problems.whiten_strain import Whitener
from tirelib.inference.statistics.problem import FOLLOWED, Point
from tirelib.measured.waveforms import GRID
from tirelib.model import solution
from tirelib.model.base import coordinates, move
from tirelib.model.slopes import by_effects, by_values
from tirelib.model.solution import Solution
from tirelib.physics.rolling.assemble import Unknowns
from tirelib.physics.rolling.solve import Rolling

OWN = 0.004
"""A run's own misfit over its rms strain, in the contact."""
UNKNOWN_NOISE = 0.005
"""Noise over the rms strain where there are no repeats."""


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """What a whitening and the contact's lengths are about.

    Attributes
    ----------
    waveform : shape (n_runs, n_phi)
    tangent : shape (n_runs, n_phi, 4)
        Its slopes by load, pressure, gain and angle.
    half_angle : shape (n_runs,), [rad]
        Half of the contact's angle.
    point : Point
    rolling : Rolling
        A start of solutions nearby.
    """

    waveform: FloatArray
    tangent: FloatArray
    half_angle: FloatArray
    point: Point
    rolling: Rolling

    def take(self, chosen: BoolArray) -> "Reference":
        """Return that of some of the runs."""
        return Reference(
            self.waveform[chosen],
            self.tangent[chosen],
            self.half_angle[chosen],
            self.point,
            self.rolling.take(chosen),
        )


class StrainProblem:
    """Straight runs of a campaign and the model of a tire.

    Parameters
    ----------
    runs : StraightRuns
    values : mapping
        Values of the model's tire.
    catalogue : sequence of Effect
    effects, strengths
        That the model has already.
    """

    def __init__(
        self,
        runs: StraightRuns,
        values: Mapping[str, float | FloatArray],
        catalogue: Sequence[Effect],
        effects: Sequence[Effect] = (),
        strengths: Sequence[FloatArray] = (),
    ) -> None:
        self.runs = runs
        self.data = runs.data(with_deflection=False)
        self.free = coordinates(values)
        means = {c.name: MEAN[c.name] for c in self.free if c.name in MEAN}
        self.values = {**values, **means}
        begin = [float(np.max(c.distance(self.values[c.name], values[c.name]))) for c in self.free]
        self.start = Point(np.array([*begin, 0.0]), tuple(effects), tuple(strengths))
        self.widths = np.array([*(WIDTH[c.name] for c in self.free), STD / UNIT])
        ends = [c.ends(float(np.max(self.values[c.name]))) for c in self.free]
        low, high = np.array([*ends, (-np.inf, np.inf)]).T  # a delay has none
        self.ends = low, high
        typical = float(np.sqrt(np.mean(runs.strain**2)))
        noise = runs.noise.std if runs.noise.known else UNKNOWN_NOISE * typical
        self._slopes = StrainSlopes(self.free)
        self.noise = np.full(len(self.data.points), noise)
        self.present = len(self.data.points)  # runs that are measured: the first ones
        self._scale = scales(self.data.tolerance, self.data.angle_std)
        self._whiteners: dict[float, Whitener] = {}
        solved = self._solved(self.start, None)
        self.reference = self._referred(solved)
        has = {effect.name for effect in effects} | in_base(values)

        def signal(effect: Effect) -> float:
            return float(np.linalg.norm(self.whitener(OWN)(self.signature(solved, effect))))

        further = [effect for effect in catalogue if effect.name not in has]
        self.living, self.dead = living(further, self.data.points, signal)
        self.lookalike = LOOKALIKE_SHARE

    @property
    def starts(self) -> tuple[Point, Point]:
        """The model as it is given, and with the base of a tire as the literature has it."""
        moves = as_in_literature(self.values, self.free)
        return self.start, replace(self.start, base=np.append(moves, 0.0))

    @property
    def half_angle(self) -> FloatArray:
        """Half angle of the contact, (n_runs,), [rad]."""
        return self.reference.half_angle

    def _referred(self, solved: StrainSolved) -> Reference:
        """Return a solution as a reference."""
        model, wave = solved.model, solved.waveform
        radius = float(np.max(self.values["free_radius"]))
        by = by_values(model, ()).waveform
        half = 0.6 * np.sqrt(2.0 * model.deflection / radius)
        return Reference(wave, tangents(wave, by[0], by[1]), half, solved.point, model.rolling)

    def about(self, solved: StrainSolved) -> "StrainProblem":
        """Return the problem with a whitening about a solution; itself where it is near."""
        change = solved.waveform - self.reference.waveform
        if np.std(change) < FOLLOWED * np.std(self.data.strain):
            return self
        out = copy(self)
        out.reference, out._whiteners = self._referred(solved), {}
        out._slopes = copy(self._slopes)
        return out

    def followed_by(self, points: Operating, repeats: FloatArray) -> "StrainProblem":
        """Return the problem with runs ahead, whose strain is zero, behind the present ones.

        Parameters
        ----------
        points : Operating
        repeats : shape (n_ahead,)
            Runs of which each is the mean: noise and set points average, the misfit that a run has
            for itself does not.

        Raises
        ------
        TirelibError
            If the model has no solution at one of them.
        """
        data, n = self.data, len(points)
        out = copy(self)
        out.data = replace(
            data,
            strain=np.concatenate([data.strain, np.zeros((n, data.strain.shape[1]))]),
            points=data.points.followed_by(points),
            angle_std=np.concatenate([data.angle_std, np.full(n, np.mean(data.angle_std))]),
            deflection=np.concatenate([data.deflection, np.full(n, np.nan)]),
        )
        share = 1.0 / np.sqrt(repeats)
        out.noise = np.concatenate([self.noise, np.mean(self.noise) * share])
        ahead = scales(data.tolerance, out.data.angle_std[-n:]) * share[:, None]
        out._scale = np.concatenate([self._scale, ahead])
        out.forget()
        out._whiteners = {}
        near = np.concatenate([np.arange(len(data.points)), data.points.nearest(points)])
        start = self.reference.rolling.take(near)
        out.reference = out._referred(out._solved(self.reference.point, start))
        return out

    def part(self, chosen: BoolArray, start: Point) -> "StrainProblem":
        """Return the problem of some of the runs (n_runs,), without effects that may be missing.

        Parameters
        ----------
        chosen : shape (n_runs,)
        start : Point
            The model.
        """
        out = self._of(chosen)
        out.start, out.living = start, ()
        return out

    def thinned(self) -> "StrainProblem":
        """Return the problem of a quarter of the runs, drawn at random; itself if they are few."""
        chosen = begins_with(len(self.data.points))
        return self if chosen.all() else self._of(chosen)

    def _of(self, chosen: BoolArray) -> "StrainProblem":
        """Return the problem of some of the runs, with the same start and effects."""
        out = copy(self)
        out.data = self.data.take(chosen)
        out.noise, out._scale = self.noise[chosen], self._scale[chosen]
        out.present = int(chosen.sum())
        out.forget()
        out.reference, out._whiteners = self.reference.take(chosen), {}
        return out

    @property
    def run_ahead(self) -> IntArray:
        """The run ahead that each whitened number is of, -1 for the present ones."""
        run = np.maximum(np.arange(len(self.data.points)) - self.present, -1)
        return np.repeat(run, self.whitener(OWN).lower.shape[1])

    def repeated(self, times: float) -> "StrainProblem":
        """Return the problem of the same runs, each the mean of so many."""
        out = copy(self)
        out.noise, out._scale = self.noise / np.sqrt(times), self._scale / np.sqrt(times)
        out._slopes, out._whiteners = copy(self._slopes), {}
        return out

    def whitener(self, own: float) -> Whitener:
        """Return the whitening for a misfit of each run of this size."""
        if own not in self._whiteners:
            self._whiteners[own] = Whitener.of(
                self.reference.waveform,
                self.reference.tangent,
                self._scale,
                self.half_angle,
                self.data.points,
                self.data.low_pass,
                noise=self.noise,
                own=own,
            )
        return self._whiteners[own]

    def own_misfit(self, own: float) -> float:
        """Return the standard deviation of a run's own misfit in the contact, as a mean, [-]."""
        return own * float(np.sqrt(np.mean(self.reference.waveform**2)))

    def forget(self) -> None:
        """Forget slopes that only save time, so that a fit does not depend on those before it."""
        self._slopes = StrainSlopes(self.free)

    def solve(self, point: Point, near: StrainSolved | None = None) -> StrainSolved:
        """Return the model at a point; raises TirelibError where it has none."""
        start = self.reference.rolling if near is None else self._slopes.start(point, near)
        return self._solved(point, start)

    def _solved(self, point: Point, start: Rolling | Unknowns | None) -> StrainSolved:
        """Return the model at a point from a start of the contact."""
        model = self.model_at(point, self.data.points, start)
        delay = UNIT * float(point.base[-1])
        waveform = earlier(model.waveform, self.data.points.omega, -delay)
        return StrainSolved(self.data.strain - waveform, point, model, delay, waveform)

    def model_at(
        self, point: Point, points: Operating, start: Rolling | Unknowns | None = None
    ) -> Solution:
        """Return the model at operating points; raises TirelibError where it has none."""
        values = move(self.values, point.base[:-1], self.free)
        return solution.solved(
            values, points, changes_at(point), low_pass=self.data.low_pass, start=start
        )

    def slopes(self, point: Point, solved: StrainSolved, *, near: bool = False) -> FloatArray:
        """Return slopes by the base, the delay and strengths in ranges, see `StrainSlopes.at`."""
        return self._slopes.at(point, solved, near=near)

    def signature(self, solved: StrainSolved, effect: Effect) -> FloatArray:
        """Return changes (components, n_runs, n_phi) for a strength of one range."""
        changes = solved.model.changes
        there = [(len(changes), effect.at(trial)) for trial in effect.trials]
        steps = [effect.step] * effect.components
        rows = by_effects(solved.model, there, steps).waveform * effect.scale
        return earlier(rows, self.data.points.omega, -solved.delay)

    def remainder(self, point: Point, solved: StrainSolved) -> dict[str, FloatArray]:
        """Return smooth shapes round the turn: `smooth_shapes`."""
        return smooth_shapes(solved.waveform, self.half_angle, self.data.points)

    def roughly(
        self, point: Point, solved: StrainSolved, slopes: FloatArray, count: int
    ) -> Sequence[FloatArray]:
        """Return how what effects do would look if their laws were roughly right."""
        where = self.half_angle, self.data.points, self.present
        state = State.of(solved.model.values, self.data.points, GRID)
        state = state.but(deflection=solved.model.deflection)
        first, out = len(point.base), []
        for effect, strength, size in zip(
            point.effects[:count], point.strengths, point.ranges, strict=False
        ):
            rows = slopes[first : first + effect.components]
            first += effect.components
            errors = [law_errors(as_large(rows, size), *where)]
            if effect.hook == "constants" and effect.components == 1:
                after = effect.at(float(strength[0]))[1](state)
                errors += [
                    beside(slopes[: len(self.free)], self.free, part, change, rows, self.present)
                    for part, change in stiffened(state, after).items()
                ]
            out.append(np.concatenate(errors))
        return out
