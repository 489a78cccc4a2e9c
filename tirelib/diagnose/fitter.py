"""Levenberg-Marquardt for the base model with effects.

An effect of one sign whose law ends at zero is held there.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.delay import STD, UNIT, by_delay, late
from tirelib.identify.random_effects import whitening
from tirelib.identify.waveform_fit import Data
from tirelib.infer.strain import WIDTH
from tirelib.model.base import (
    Coordinate,
    Correction,
    coordinates,
    large_displacements,
    linearised,
    move,
    predict,
)
from tirelib.model.chain import Changes
from tirelib.model.state import State
from tirelib.model.whole import with_slopes

STRENGTH_WIDTH = 1.0
"""Prior standard deviation of a strength, relative to its range."""
LONGEST = 0.4
FORETOLD = 0.8
"""Share of the gain that slopes foretell from which on they serve for another step."""
POOR = 0.25
"""The same below which steps get shorter."""
MOST = 1e8
"""Damping at which there is no way down."""
FLAT = 1e-5
"""Gain of a step, over the cost, of one at the bottom."""


def widths(free: Sequence[Coordinate]) -> FloatArray:
    """Return the prior standard deviations of coordinates of the tire."""
    return np.array([WIDTH[coordinate.name] for coordinate in free])


def before_strengths(values: Mapping[str, float | FloatArray]) -> int:
    """Return how many coordinates stand before the strengths: the tire's, then the delay."""
    return len(coordinates(values)) + 1


def changes_of(effects: Sequence[Effect], strengths: Sequence[FloatArray]) -> Changes:
    """Return effects at strengths as changes of the chain."""
    return [
        effect.at(float(s[0]) if effect.components == 1 else tuple(float(x) for x in s))
        for effect, s in zip(effects, strengths, strict=True)
    ]


class Fitter:
    """Levenberg-Marquardt on whitened residuals.

    Coordinates z: those of the tire, the delay in `UNIT`, strengths in units of their ranges.
    """

    def __init__(
        self,
        data: Data,
        values: dict[str, float | FloatArray],
        effects: tuple[Effect, ...],
        strengths: list[FloatArray],
        delay: float,
        near: Correction | None = None,
    ) -> None:
        self.data, self.start, self.effects = data, values, effects
        self.free = coordinates(values)
        self.base = before_strengths(values)
        scales = [np.full(e.components, e.scale) for e in effects]
        self.scale = np.concatenate([np.ones(len(self.free)), [UNIT], *scales])
        self.z = np.concatenate([np.zeros(len(self.free)), [delay], *strengths]) / self.scale
        more = np.full(self.z.size - self.base, STRENGTH_WIDTH)
        self.width = np.concatenate([widths(self.free), [STD / UNIT], more])
        self.damping, self.cost = 1e-3, np.inf
        self.fresh = self.follows = False
        self.about, self.near = self.z, near
        self.correction: Correction
        one_sign = [np.full(e.components, (e.low >= 0.0) - (e.high <= 0.0)) for e in effects]
        self.sign = np.concatenate([np.zeros(self.base), *one_sign])
        self.signed: BoolArray = self.sign != 0.0
        self.slopes: FloatArray = np.zeros((0, *data.strain.shape))

    @property
    def values(self) -> dict[str, float | FloatArray]:
        """Of the tire, at the coordinates."""
        return move(self.start, self.z[: len(self.free)], self.free)

    def strengths(self, z: FloatArray) -> tuple[FloatArray, ...]:
        """Return the strengths in their units."""
        flat = (z * self.scale)[self.base :]
        cuts = np.cumsum([e.components for e in self.effects])[:-1]
        return tuple(np.split(flat, cuts)) if self.effects else ()

    def delay(self, z: FloatArray) -> float:
        """Return the delay [s]."""
        return float((z * self.scale)[self.base - 1])

    def changes(self, z: FloatArray) -> Changes:
        """Return effects and delay for the chain."""
        return [*changes_of(self.effects, self.strengths(z)), late(self.delay(z))]

    def refresh(self, *, weigh: bool = True) -> None:
        """Bring large displacements up to date, and if asked for the weights."""
        data, before = self.data, self.correction if self.follows else self.near
        start = None if before is None else before.guess(self._away(self.z))
        self.about = self.z
        self.correction = with_slopes(
            large_displacements(self.values, data.points, low_pass=data.low_pass, start=start),
            self.values,
            data.points,
            self.free,
            low_pass=data.low_pass,
        )
        if self.follows and before is not None:
            self._follow(before)
            self._take(self._predict(self.z), self.z)
        else:
            self._linearise(self.z)
        if weigh:
            self.whiten = whitening(
                self.waveform,
                self.values,
                data.points,
                data.tolerance,
                data.angle_std,
                data.noise,
                data.low_pass,
            )
        self.rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        self.cost = self._cost(self.waveform, self.z)

    def _follow(self, before: Correction) -> None:
        """Bring what large displacements have in the slopes up to date."""
        by_base, others = np.split(self.slopes, [len(self.free)])
        by_base = by_base + self.correction.by_waveform - before.by_waveform
        self.slopes = np.concatenate([by_base, others])

    def large(self, z: FloatArray) -> Correction:
        """Return what large displacements add at coordinates; `refresh` computes them."""
        return self.correction.moved(self._away(z))

    @property
    def away(self) -> float:
        """How far a base coordinate is from where large displacements were computed."""
        return float(np.abs(self._away(self.z)).max())

    def _away(self, z: FloatArray) -> FloatArray:
        """Return how far base coordinates are from where large displacements were computed."""
        away: FloatArray = (z - self.about)[: len(self.free)]
        return away

    def _take(self, state: State, z: FloatArray) -> None:
        self.waveform, self.fresh = state.wave, False
        self._at(state.deflection, z)

    def _at(self, deflection: FloatArray, z: FloatArray) -> None:
        """Take a deflection, where constants that follow it start from now on."""
        self.deflection = deflection
        depth = deflection - self.large(z).deflection
        self.correction = replace(self.correction, depth=depth)

    def _linearise(self, z: FloatArray) -> None:
        values = move(self.start, z[: len(self.free)], self.free)
        base = linearised(
            values,
            self.data.points,
            self.free,
            self.changes(z),
            low_pass=self.data.low_pass,
            correction=self.large(z),
        )
        rows = [base.waveform_slopes, by_delay(base.waveform, self.data.points.omega)[None]]
        for k in range(self.base, z.size):
            moved, side = z.copy(), -1.0 if self.sign[k] < 0.0 else 1.0
            moved[k] += 1e-3 * side * (1.0 if side * z[k] <= 0.5 else -1.0)
            wave = self._predict(moved).wave
            rows.append(((wave - base.waveform) / (moved[k] - z[k]))[None])
        self.waveform = base.waveform
        self._at(base.deflection, z)
        self.slopes = np.concatenate(rows)
        self.fresh = self.follows = True

    def _predict(self, z: FloatArray) -> State:
        return predict(
            move(self.start, z[: len(self.free)], self.free),
            self.data.points,
            self.changes(z),
            low_pass=self.data.low_pass,
            correction=self.large(z),
        )

    def _cost(self, waveform: FloatArray, z: FloatArray) -> float:
        rest = self.whiten(self.data.strain - waveform)
        return float(np.sum(rest**2) + np.sum((z / self.width) ** 2))

    def step(self) -> float:
        """Take one step that lowers the cost; return its largest component.

        The slopes serve as long as they foretell what a step gains.
        """
        rest = self.whiten(self.data.strain - self.waveform).ravel()
        normal = self.rows @ self.rows.T + np.diag(self.width**-2)
        gradient = self.rows @ rest - self.z / self.width**2
        while self.damping < MOST:
            damped = normal + self.damping * np.diag(np.diag(normal))
            for dz in self._ways(damped, gradient):
                moved = self._tried(dz, float(dz @ (2.0 * gradient - normal @ dz)))
                if moved is not None:
                    return moved
            if not self.fresh and self.renew():
                return self.step()
            self.damping *= 10.0
        self.damping = 1e-3
        return 0.0

    def _ways(self, damped: FloatArray, gradient: FloatArray) -> Iterator[FloatArray]:
        """Return the step as it comes, then one that keeps signs: its law may end at zero."""
        dz = np.clip(np.linalg.solve(damped, gradient), -LONGEST, LONGEST)
        yield dz
        crossing = self.signed & ((self.z + dz) * self.sign < 0.0)
        if crossing.any():
            held = np.where(crossing, -self.z, 0.0)
            free = np.flatnonzero(~crossing)
            right = (gradient - damped @ held)[free]
            held[free] = np.linalg.solve(damped[np.ix_(free, free)], right)
            yield np.clip(held, -LONGEST, LONGEST)

    def _tried(self, dz: FloatArray, foretold: float) -> float | None:
        """Take a step if it lowers the cost, and return its largest component; None if not."""
        z = self.z + dz
        try:
            state = self._predict(z)
            cost = self._cost(state.wave, z)
            gain = self.cost - cost
            if gain < -1e-12 * self.cost:
                return None
            # a valley that is flat to a millionth is the bottom
            flat = gain < FLAT * cost
            if gain < FORETOLD * foretold or (flat and not self.fresh):
                flat = flat and self.fresh
                self._linearise(z)
                self.rows = self.whiten(self.slopes).reshape(z.size, -1)
            else:
                self._take(state, z)
        except TirelibError:  # there, or within a difference of it, is no tire
            return None
        self.z, self.cost = z, cost
        if gain > FORETOLD * foretold:
            self.damping = max(self.damping / 10.0, 1e-9)
        elif gain < POOR * foretold:  # it went too far
            self.damping = max(10.0 * self.damping, 1e-3)
        return 0.0 if flat else float(np.abs(dz).max())

    def renew(self) -> bool:
        """Bring the slopes up to date; return whether there is a tire within their differences."""
        if not self.fresh:
            try:
                self._linearise(self.z)
            except TirelibError:
                return False
            self.rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        return True
