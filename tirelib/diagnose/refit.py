"""The base model with some effects, fitted to the straight runs.

Values of the tire, the delay of the day (`tirelib.diagnose.delay`) and strengths together.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.delay import STD, UNIT, by_delay, earlier, late
from tirelib.effects import Effect
from tirelib.errors import ConvergenceError, ParameterError, TirelibError
from tirelib.identify.identify import FITTED
from tirelib.identify.random_effects import Whitening, whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import (
    Correction,
    large_displacements,
    linearised,
    move,
    predict,
)
from tirelib.model.chain import Changes
from tirelib.model.state import Operating, State

WIDTH = np.array([0.7, 0.7, 1.5, 1.0, 1.5, 0.9, 0.15, 0.7])
"""Prior standard deviation of the free coordinates: wide, since the campaign has informed them."""
BASE = len(FITTED) + 1
"""Coordinates before the strengths: those of the tire, then the delay."""
STRENGTH_WIDTH = 1.0
"""Prior standard deviation of a strength, relative to its range."""
OUTER, MAX_STEPS = 8, 25
"""Most times that large displacements and whitening are brought up to date, and steps each time."""
ROUGH, SETTLED = 0.05, 0.005
"""Coordinate by which the last step moves: the first two times, and then."""
FOLLOWED = 0.008
"""Coordinate by which all steps together move where large displacements need no update."""
LONGEST = 0.4
FORETOLD = 0.8
"""Share of the gain that slopes foretell from which on they serve for another step."""
POOR = 0.25
"""The same below which steps get shorter."""
FLAT = 1e-5
"""Gain of a step, over the cost, of one at the bottom."""
FLATTER = 0.9
"""Share of the pressure slopes from which a fit starts that cannot start where it should."""


@dataclass(frozen=True, slots=True)
class Refit:
    """A fitted model.

    Attributes
    ----------
    values : mapping
        Of the tire.
    effects : tuple of Effect
        That the model has.
    strengths : tuple of array
        One array of components per effect.
    delay : float, [s]
        Of the gages against the trigger.
    waveform : shape (n_runs, n_phi), [-]
    slopes : shape (n_free, n_runs, n_phi)
        By base coordinates, the delay last of them, and by strengths in units of their range.
    correction : Correction
    whiten : Whitening
    covariance : shape (n_free, n_free)
    error : float, [-]
        Rms of the whitened residual.
    """

    values: Mapping[str, float | FloatArray]
    effects: tuple[Effect, ...]
    strengths: tuple[FloatArray, ...]
    delay: float
    waveform: FloatArray
    deflection: FloatArray
    slopes: FloatArray
    correction: Correction
    whiten: Whitening
    covariance: FloatArray
    error: float

    @property
    def changes(self) -> Changes:
        """The effects at their strengths and the delay, for the chain."""
        return [*changes_of(self.effects, self.strengths), late(self.delay)]

    @property
    def own_slopes(self) -> FloatArray:
        """Slopes by what belongs to the tire and its effects, shape (n_free - 1, ...)."""
        return np.delete(self.slopes, BASE - 1, axis=0)

    def beside_delay(self, white: FloatArray) -> FloatArray:
        """Return whitened waveforms (..., n_runs, n_phi) without what a delay could take."""
        late = self.whiten(self.slopes[BASE - 1])
        size = float(np.sum(late**2))
        if size == 0.0:
            return white
        share = np.sum(white * late, axis=(-2, -1), keepdims=True) / size
        return np.asarray(white - share * late)

    def on_time(self, points: Operating) -> "Refit":
        """Return the model without the delay: as a day without any would show it."""
        waveform = earlier(self.waveform, points.omega, self.delay)
        return replace(self, delay=0.0, waveform=waveform)

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        first = BASE + sum(effect.components for effect in self.effects[:index])
        effect = self.effects[index]
        rows = slice(first, first + effect.components)
        deviation: FloatArray = effect.scale * np.sqrt(np.diag(self.covariance)[rows])
        return deviation

    def needed(self, names: Sequence[str]) -> list[str]:
        """Return those of some effects whose strength the fit does not take back to zero."""
        kept = []
        for index, effect in enumerate(self.effects):
            strength, std = self.strengths[index], self.strength_std(index)
            if effect.name in names and (np.abs(strength) > 3.0 * std).any():
                kept.append(effect.name)
        return sorted(kept, key=list(names).index)


def changes_of(effects: Sequence[Effect], strengths: Sequence[FloatArray]) -> Changes:
    """Return effects at strengths as changes of the chain."""
    return [
        effect.at(float(s[0]) if effect.components == 1 else tuple(float(x) for x in s))
        for effect, s in zip(effects, strengths, strict=True)
    ]


def refit(
    data: Data,
    values: Mapping[str, float | FloatArray],
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    *,
    delay: float = 0.0,
    near: Correction | None = None,
    progress: Callable[[str], None] | None = None,
) -> Refit:
    """Fit base values and strengths to the waveforms.

    Parameters
    ----------
    data : Data
    values : mapping
        Start values of the tire.
    effects, strengths
        Effects of the model and their start strengths.
    delay : float, [s]
        From which it starts; that of the same runs is nearby, whatever effects there are.
    near : Correction, optional
        Of the same runs at values nearby: saves time, the result is the same.
    progress : callable, optional

    Raises
    ------
    ConvergenceError
        If the steps do not settle; carries the last values.
    """
    start = [np.zeros(e.components) for e in effects] if not strengths else list(strengths)
    fitter = _Fitter(data, dict(values), tuple(effects), start, delay, near)
    try:
        fitter.refresh()
    except ParameterError:  # another fit may have ended where the sidewall has no stiffness left
        fitter = _Fitter(data, _flatter(values), tuple(effects), start, delay, near)
        fitter.refresh()
    for outer in range(OUTER):
        if outer:
            fitter.refresh()
        begin = fitter.z
        for _ in range(MAX_STEPS):
            moved = fitter.step()
            if progress is not None:
                progress(f"refit, error {np.sqrt(fitter.cost / data.strain.size):.2f}")
            if moved < (ROUGH if outer < 2 else SETTLED):
                break
        if outer == OUTER - 1 and moved >= SETTLED:
            raise ConvergenceError(
                f"refit with {', '.join(e.name for e in effects) or 'no effect'}: the parameters "
                f"still move by {moved:.2e}; the model does not fit these runs: look at them with "
                "`tirelib compare`",
                fitter.values,
                moved,
            )
        if outer >= 2 and float(np.abs(fitter.z - begin).max()) < FOLLOWED:
            break
    return fitter.result()


def _flatter(values: Mapping[str, float | FloatArray]) -> dict[str, float | FloatArray]:
    """Return values whose sidewall follows the pressure a little less."""
    slopes = ("radial_pressure_slope", "tangential_pressure_slope")
    return {**values, **{name: FLATTER * np.asarray(values[name]) for name in slopes}}


class _Fitter:
    """Levenberg-Marquardt on whitened residuals, base coordinates first, then strengths."""

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
        scales = [np.full(e.components, e.scale) for e in effects]
        self.scale = np.concatenate([np.ones(len(FITTED)), [UNIT], *scales])
        self.z = np.concatenate([np.zeros(len(FITTED)), [delay], *strengths]) / self.scale
        more = np.full(self.z.size - BASE, STRENGTH_WIDTH)
        self.width = np.concatenate([WIDTH, [STD / UNIT], more])
        self.damping, self.cost = 1e-3, np.inf
        self.fresh = self.follows = False
        self.correction = near

    @property
    def values(self) -> dict[str, float | FloatArray]:
        return move(self.start, self.z[: len(FITTED)], FITTED)

    def strengths(self, z: FloatArray) -> tuple[FloatArray, ...]:
        """Return the strengths in their units."""
        flat = (z * self.scale)[BASE:]
        cuts = np.cumsum([e.components for e in self.effects])[:-1]
        return tuple(np.split(flat, cuts)) if self.effects else ()

    def delay(self, z: FloatArray) -> float:
        """Return the delay [s]."""
        return float((z * self.scale)[BASE - 1])

    def changes(self, z: FloatArray) -> Changes:
        """Return effects and delay for the chain."""
        return [*changes_of(self.effects, self.strengths(z)), late(self.delay(z))]

    def refresh(self) -> None:
        """Bring large displacements and whitening up to date."""
        data = self.data
        self.correction = large_displacements(
            self.values, data.points, low_pass=data.low_pass, start=self.correction
        )
        if self.follows:  # what large displacements add changes no slope
            self._take(self._predict(self.z))
        else:
            self._linearise(self.z)
        self.whiten = whitening(
            self.waveform, self.values, data.points, data.tolerance, data.angle_std, data.noise,
            data.low_pass,
        )  # fmt: skip
        self.rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        self.cost = self._cost(self.waveform, self.z)

    def _take(self, state: State) -> None:
        self.waveform, self.deflection, self.fresh = state.wave, state.deflection, False

    def _linearise(self, z: FloatArray) -> None:
        values = move(self.start, z[: len(FITTED)], FITTED)
        base = linearised(
            values, self.data.points, FITTED, self.changes(z), low_pass=self.data.low_pass,
            correction=self.correction,
        )  # fmt: skip
        rows = [base.waveform_slopes, by_delay(base.waveform, self.data.points.omega)[None]]
        for k in range(BASE, z.size):
            moved = z.copy()
            moved[k] += 1e-3 if z[k] <= 0.5 else -1e-3
            wave = self._predict(moved).wave
            rows.append(((wave - base.waveform) / (moved[k] - z[k]))[None])
        self.waveform, self.deflection = base.waveform, base.deflection
        self.slopes = np.concatenate(rows)
        self.fresh = self.follows = True

    def _predict(self, z: FloatArray) -> State:
        return predict(
            move(self.start, z[: len(FITTED)], FITTED), self.data.points, self.changes(z),
            low_pass=self.data.low_pass, correction=self.correction,
        )  # fmt: skip

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
        while self.damping < 1e8:
            dz = np.linalg.solve(normal + self.damping * np.diag(np.diag(normal)), gradient)
            dz = np.clip(dz, -LONGEST, LONGEST)
            z = self.z + dz
            try:
                state = self._predict(z)
                cost = self._cost(state.wave, z)
                better = cost <= self.cost * (1.0 + 1e-12)
                gain = self.cost - cost
                # a valley that is flat to a millionth is the bottom
                flat = gain < FLAT * cost
                foretold = float(dz @ (2.0 * gradient - normal @ dz))
                if better and (gain < FORETOLD * foretold or (flat and not self.fresh)):
                    flat = flat and self.fresh
                    self._linearise(z)
                    self.rows = self.whiten(self.slopes).reshape(z.size, -1)
                elif better:
                    self._take(state)
            except TirelibError:  # there, or within a difference of it, is no tire
                better = False
            if better:
                self.z, self.cost = z, cost
                if gain > FORETOLD * foretold:
                    self.damping = max(self.damping / 10.0, 1e-9)
                elif gain < POOR * foretold:  # it went too far
                    self.damping = max(10.0 * self.damping, 1e-3)
                return 0.0 if flat else float(np.abs(dz).max())
            if not self.fresh and self._renewed():
                return self.step()
            self.damping *= 10.0
        self.damping = 1e-3
        return 0.0

    def _renewed(self) -> bool:
        """Bring the slopes up to date; return whether there is a tire within their differences."""
        try:
            self._linearise(self.z)
        except TirelibError:
            return False
        self.rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        return True

    def result(self) -> Refit:
        """Return the fitted model."""
        assert self.correction is not None  # noqa: S101 - refresh has set it
        if not self.fresh:
            with suppress(TirelibError):  # within a difference of it is no tire
                self._linearise(self.z)
        rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        rest = self.whiten(self.data.strain - self.waveform)
        normal = rows @ rows.T + np.diag(self.width**-2)
        covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
        return Refit(
            self.values, self.effects, self.strengths(self.z),
            self.delay(self.z), self.waveform, self.deflection, self.slopes, self.correction,
            self.whiten, covariance, float(np.sqrt(np.mean(rest**2))),
        )  # fmt: skip
