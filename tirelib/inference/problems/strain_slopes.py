"""Slopes of the model's waveforms; those that cost most are kept, and serve points nearby."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.delay import by_delay, earlier
from tirelib.inference.statistics.problem import Point
from tirelib.model.base import Coordinate
from tirelib.model.chain import Changes
from tirelib.model.slopes import SolutionSlopes, added_by_values, by_effects, by_values
from tirelib.model.solution import Solution
from tirelib.physics.rolling.assemble import Unknowns
from tirelib.physics.rolling.solve import Rolling

LEAST_STEP = 1e-3
STRENGTH_MOVE = 0.05
"""Move of a strength, in ranges, within which what it adds to the slopes is kept."""
BASE_MOVE = 0.03
"""The same of the base's coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class StrainSolved:
    """The model at a point, `tirelib.inference.statistics.problem.Solved`.

    Attributes
    ----------
    rest : shape (n_runs, n_phi)
        Measured less model.
    point : Point
    model : Solution
    delay : float, [s]
    waveform : shape (n_runs, n_phi)
        The model's waveforms, with the delay.
    """

    rest: FloatArray
    point: Point
    model: Solution
    delay: float
    waveform: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        """Leave the effects' changes out, which are functions; the point makes them again."""
        bare = replace(self.model, changes=())
        return _with_changes, (self.rest, self.point, bare, self.delay, self.waveform)


def _with_changes(
    rest: FloatArray, point: Point, bare: Solution, delay: float, waveform: FloatArray
) -> StrainSolved:
    return StrainSolved(rest, point, replace(bare, changes=changes_at(point)), delay, waveform)


def changes_at(point: Point) -> Changes:
    """Return what a point's effects change."""
    return [effect.at(s) for effect, s in zip(point.effects, point.strengths, strict=True)]


@dataclass(frozen=True, slots=True, eq=False)
class _Added:
    """Slopes that cost much, and the point they were taken at."""

    point: Point
    slopes: FloatArray

    def serves(self, point: Point, *, near: bool) -> bool:
        """Return whether these slopes are a point's own, or with `near` so near that they do."""
        if self.point is point or not near:
            return self.point is point
        same = self.point.effects == point.effects
        near = float(np.abs(self.point.base - point.base).max()) < BASE_MOVE
        return (
            same
            and near
            and all(
                float(np.abs(a - b).max()) < STRENGTH_MOVE * effect.scale
                for effect, a, b in zip(
                    point.effects, self.point.strengths, point.strengths, strict=True
                )
            )
        )


class StrainSlopes:
    """Slopes at one solution after the other.

    Parameters
    ----------
    free : sequence of Coordinate
        The base's coordinates.
    """

    def __init__(self, free: Sequence[Coordinate]) -> None:
        self._free = free
        self._last: tuple[StrainSolved, SolutionSlopes] | None = None
        self._added: _Added | None = None
        self._strengths: _Added | None = None

    def start(self, point: Point, near: StrainSolved) -> Rolling | Unknowns:
        """Return a start of the contact: a solution nearby, moved along its slopes if known."""
        if self._last is None or self._last[0] is not near:
            return near.model.rolling
        return self._last[1].start(near.model, (point.base - near.point.base)[:-1])

    def at(self, point: Point, solved: StrainSolved, *, near: bool = False) -> FloatArray:
        """Return slopes by the base, the delay and strengths in ranges.

        With `near`, slopes by strengths, and of what they add to the base, may be those of a point
        nearby: they cost most.
        """
        if self._last is None or self._last[0] is not solved:
            self._last = (solved, by_values(solved.model, self._free))
        n, omega = len(self._free), solved.model.points.omega
        slopes = self._last[1].waveform[:n]
        if _bends(point):
            if self._added is None or not self._added.serves(point, near=near):
                more = added_by_values(solved.model, self._free, LEAST_STEP)
                self._added = _Added(point, more)
            slopes = slopes + self._added.slopes
        rows = np.concatenate([slopes, self._by_strengths(point, solved, near=near)])
        late = earlier(rows, omega, -solved.delay)
        return np.concatenate([late[:n], by_delay(solved.waveform, omega)[None], late[n:]])

    def _by_strengths(self, point: Point, solved: StrainSolved, *, near: bool) -> FloatArray:
        """Return slopes by strengths in ranges, without the delay."""
        if self._strengths is not None and self._strengths.serves(point, near=near):
            return self._strengths.slopes
        there, steps, scales = [], [], []
        for k, effect in enumerate(point.effects):
            for j in range(effect.components):
                steps.append(LEAST_STEP * effect.toward)
                scales.append(effect.scale)
                strength = point.strengths[k].copy()
                strength[j] += steps[-1]
                there.append((k, effect.at(strength)))
        rows = np.zeros((0, *solved.waveform.shape))
        if there:
            rows = by_effects(solved.model, there, steps).waveform
            rows = rows * np.array(scales)[:, None, None]
        self._strengths = _Added(point, rows)
        return rows


def _bends(point: Point) -> bool:
    """Return whether effects are strong enough to matter to the slopes of the base."""
    return any(
        effect.hook in ("contact", "strain")
        and float(np.abs(s).max()) >= STRENGTH_MOVE * effect.scale
        for effect, s in zip(point.effects, point.strengths, strict=True)
    )
