"""The base model with some effects, fitted to the straight runs: values and strengths together."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
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

WIDTH = np.array([0.7, 0.7, 1.5, 1.0, 1.5, 0.9, 0.15, 0.7])
"""Prior standard deviation of the free coordinates: wide, since the campaign has informed them."""
STRENGTH_WIDTH = 1.0
"""Prior standard deviation of a strength, relative to its range."""
OUTER, MAX_STEPS = 3, 25
SETTLED = (0.05, 0.05, 0.005)
LONGEST = 0.4
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
    waveform : shape (n_runs, n_phi), [-]
    slopes : shape (n_free, n_runs, n_phi)
        By base coordinates and by strengths in units of their range.
    correction : Correction
    whiten : Whitening
    covariance : shape (n_free, n_free)
    error : float, [-]
        Rms of the whitened residual.
    """

    values: Mapping[str, float | FloatArray]
    effects: tuple[Effect, ...]
    strengths: tuple[FloatArray, ...]
    waveform: FloatArray
    deflection: FloatArray
    slopes: FloatArray
    correction: Correction
    whiten: Whitening
    covariance: FloatArray
    error: float

    @property
    def changes(self) -> Changes:
        """The effects at their strengths, for the chain."""
        return changes_of(self.effects, self.strengths)

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        first = len(FITTED) + sum(effect.components for effect in self.effects[:index])
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
    near : Correction, optional
        Of the same runs at values nearby: saves time, the result is the same.
    progress : callable, optional

    Raises
    ------
    ConvergenceError
        If the steps do not settle; carries the last values.
    """
    start = [np.zeros(e.components) for e in effects] if not strengths else list(strengths)
    fitter = _Fitter(data, dict(values), tuple(effects), start, near)
    try:
        fitter.refresh()
    except ParameterError:  # another fit may have ended where the sidewall has no stiffness left
        fitter = _Fitter(data, _flatter(values), tuple(effects), start, near)
        fitter.refresh()
    for outer in range(OUTER):
        if outer:
            fitter.refresh()
        for _ in range(MAX_STEPS):
            moved = fitter.step()
            if progress is not None:
                progress(f"refit, error {np.sqrt(fitter.cost / data.strain.size):.2f}")
            if moved < SETTLED[outer]:
                break
        else:
            raise ConvergenceError(
                f"refit with {', '.join(e.name for e in effects) or 'no effect'}: the parameters "
                f"still move by {moved:.2e}; the model does not fit these runs: look at them with "
                "`tirelib compare`",
                fitter.values,
                moved,
            )
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
        near: Correction | None = None,
    ) -> None:
        self.data, self.start, self.effects = data, values, effects
        scales = [np.full(e.components, e.scale) for e in effects]
        self.scale = np.concatenate([np.ones(len(FITTED)), *scales])
        self.z = np.concatenate([np.zeros(len(FITTED)), *strengths]) / self.scale
        self.width = np.concatenate([WIDTH, np.full(self.z.size - len(FITTED), STRENGTH_WIDTH)])
        self.damping, self.cost = 1e-3, np.inf
        self.correction = near

    @property
    def values(self) -> dict[str, float | FloatArray]:
        return move(self.start, self.z[: len(FITTED)], FITTED)

    def strengths(self, z: FloatArray) -> tuple[FloatArray, ...]:
        """Return the strengths in their units."""
        flat = (z * self.scale)[len(FITTED) :]
        cuts = np.cumsum([e.components for e in self.effects])[:-1]
        return tuple(np.split(flat, cuts)) if self.effects else ()

    def refresh(self) -> None:
        """Bring large displacements and whitening up to date."""
        data = self.data
        self.correction = large_displacements(
            self.values, data.points, low_pass=data.low_pass, start=self.correction
        )
        self._linearise(self.z)
        self.whiten = whitening(
            self.waveform, self.values, data.points, data.tolerance, data.angle_std, data.noise,
            data.low_pass,
        )  # fmt: skip
        self.cost = self._cost(self.waveform, self.z)

    def _linearise(self, z: FloatArray) -> None:
        values = move(self.start, z[: len(FITTED)], FITTED)
        changes = changes_of(self.effects, self.strengths(z))
        base = linearised(
            values, self.data.points, FITTED, changes, low_pass=self.data.low_pass,
            correction=self.correction,
        )  # fmt: skip
        rows = [base.waveform_slopes]
        for k in range(len(FITTED), z.size):
            moved = z.copy()
            moved[k] += 1e-3 if z[k] <= 0.5 else -1e-3
            wave = self._predict(values, moved)
            rows.append(((wave - base.waveform) / (moved[k] - z[k]))[None])
        self.waveform, self.deflection = base.waveform, base.deflection
        self.slopes = np.concatenate(rows)

    def _predict(self, values: Mapping[str, float | FloatArray], z: FloatArray) -> FloatArray:
        state = predict(
            values, self.data.points, changes_of(self.effects, self.strengths(z)),
            low_pass=self.data.low_pass, correction=self.correction,
        )  # fmt: skip
        return state.wave

    def _cost(self, waveform: FloatArray, z: FloatArray) -> float:
        rest = self.whiten(self.data.strain - waveform)
        return float(np.sum(rest**2) + np.sum((z / self.width) ** 2))

    def step(self) -> float:
        """Take one step that lowers the cost; return its largest component."""
        rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        rest = self.whiten(self.data.strain - self.waveform).ravel()
        normal = rows @ rows.T + np.diag(self.width**-2)
        gradient = rows @ rest - self.z / self.width**2
        while self.damping < 1e8:
            dz = np.linalg.solve(normal + self.damping * np.diag(np.diag(normal)), gradient)
            dz = np.clip(dz, -LONGEST, LONGEST)
            z = self.z + dz
            try:
                wave = self._predict(move(self.start, z[: len(FITTED)], FITTED), z)
                cost = self._cost(wave, z)
                better = cost <= self.cost * (1.0 + 1e-12)
                if better:
                    self._linearise(z)
            except TirelibError:  # there, or within a difference of it, is no tire
                better = False
            if better:
                gain = self.cost - cost
                self.z, self.cost = z, cost
                self.damping = max(self.damping / 10.0, 1e-9)
                # a valley that is flat to a millionth is the bottom
                return 0.0 if gain < 1e-5 * cost else float(np.abs(dz).max())
            self.damping *= 10.0
        self.damping = 1e-3
        return 0.0

    def result(self) -> Refit:
        """Return the fitted model."""
        assert self.correction is not None  # noqa: S101 - refresh has set it
        rows = self.whiten(self.slopes).reshape(self.z.size, -1)
        rest = self.whiten(self.data.strain - self.waveform)
        normal = rows @ rows.T + np.diag(self.width**-2)
        covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
        return Refit(
            self.values, self.effects, self.strengths(self.z), self.waveform, self.deflection,
            self.slopes, self.correction, self.whiten, covariance,
            float(np.sqrt(np.mean(rest**2))),
        )  # fmt: skip
