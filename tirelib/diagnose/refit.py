"""The base model with some effects, fitted to the straight runs.

Values of the tire, the delay of the day (`tirelib.identify.delay`) and strengths together.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.model import Model
from tirelib.diagnose.fitter import Fitter, before_strengths, changes_of
from tirelib.effects import Effect
from tirelib.errors import ConvergenceError, ParameterError, TirelibError
from tirelib.identify.delay import earlier, late
from tirelib.identify.random_effects import Whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Correction
from tirelib.model.chain import Changes
from tirelib.model.state import Operating

OUTER, WEIGHED, MAX_STEPS = 8, 2, 25
"""Most times that large displacements are brought up to date, those that weights are, which might
swing from one to another for ever, and steps each time."""
STILL = 5e-4
"""Least share of the cost that another time has to gain."""
ROUGH, SETTLED = 0.05, 0.005
"""Coordinate by which the last step moves: the first time, and then."""
FOLLOWED = 0.01
"""Coordinate by which all steps together move where large displacements need no update: they follow
to first order."""
WITHIN = 0.9
"""Share of a range in which a fit starts."""
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
        Delay of the gages against the trigger.
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
    def model(self) -> Model:
        """The tire with its effects, without the delay: what a model file holds."""
        return Model.fitted(self.values, self.effects, self.strengths)

    @property
    def changes(self) -> Changes:
        """The effects at their strengths and the delay, for the chain."""
        return [*changes_of(self.effects, self.strengths), late(self.delay)]

    @property
    def own_slopes(self) -> FloatArray:
        """Slopes by what belongs to the tire and its effects, shape (n_free - 1, ...)."""
        return np.delete(self.slopes, before_strengths(self.values) - 1, axis=0)

    def beside_delay(self, white: FloatArray) -> FloatArray:
        """Return whitened waveforms (..., n_runs, n_phi) without what a delay could take."""
        late = self.whiten(self.slopes[before_strengths(self.values) - 1])
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
        first = before_strengths(self.values) + sum(
            effect.components for effect in self.effects[:index]
        )
        effect = self.effects[index]
        rows = slice(first, first + effect.components)
        deviation: FloatArray = effect.scale * np.sqrt(np.diag(self.covariance)[rows])
        return deviation


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
    fitter = Fitter(data, dict(values), tuple(effects), start, delay, near)
    try:
        fitter.refresh()
    except ParameterError:  # another fit may have ended where the sidewall has no stiffness left
        fitter = Fitter(data, _flatter(values), tuple(effects), start, delay, near)
        fitter.refresh()
    last = np.inf
    for outer in range(OUTER):
        if outer:
            fitter.refresh(weigh=outer < WEIGHED)
        if outer >= WEIGHED and fitter.cost > (1.0 - STILL) * last:
            break
        last = fitter.cost
        begin = fitter.z
        for _ in range(MAX_STEPS):
            moved = fitter.step()
            if progress is not None:
                progress(f"refit, error {np.sqrt(fitter.cost / data.strain.size):.2f}")
            if moved < (SETTLED if outer else ROUGH):
                break
        if outer == OUTER - 1 and moved >= SETTLED:
            raise ConvergenceError(
                f"refit with {', '.join(e.name for e in effects) or 'no effect'}: the parameters "
                f"still move by {moved:.2e}; the model does not fit these runs: look at them with "
                "`tirelib compare`",
                fitter.values,
                moved,
            )
        if outer and float(np.abs(fitter.z - begin).max()) < FOLLOWED:
            break
    if fitter.away > SETTLED:  # what is told is told of the whole model
        fitter.refresh(weigh=False)
    fitter.renew()
    return _result(fitter)


def settled(
    data: Data,
    values: Mapping[str, float | FloatArray],
    effects: Sequence[Effect],
    strengths: Sequence[FloatArray],
) -> Refit:
    """Return the model at values and strengths that have been fitted elsewhere, without a delay."""
    fitter = Fitter(data, dict(values), tuple(effects), list(strengths), 0.0, None)
    fitter.refresh()
    fitter.renew()
    return _result(fitter)


class Refits:
    """Fits of one campaign with effects added to a model, each made once.

    The bottom is the same whatever the strengths start from; whether a fit gets there is not.

    Parameters
    ----------
    data : Data
    progress : callable, optional
    """

    def __init__(self, data: Data, progress: Callable[[str], None] | None = None) -> None:
        self.data, self.progress = data, progress
        self._made: list[tuple[Refit, tuple[Effect, ...], Refit]] = []

    def __call__(
        self, model: Refit, effects: Sequence[Effect], strengths: Sequence[FloatArray]
    ) -> Refit | None:
        """Return the fit with effects from a fitted model; None if it does not settle."""
        for start, added, found in self._made:
            if start is model and added == tuple(effects):
                return found
        try:
            made = refit(
                self.data,
                model.values,
                effects,
                strengths,
                delay=model.delay,
                near=model.correction,
                progress=self.progress,
            )
        except TirelibError:
            return None
        self._made.append((model, tuple(effects), made))
        return made


def inside(effect: Effect, strength: FloatArray) -> FloatArray:
    """Return a start for a fit within an effect's range."""
    start: FloatArray = np.clip(strength, WITHIN * effect.low, WITHIN * effect.high)
    return start


def _flatter(values: Mapping[str, float | FloatArray]) -> dict[str, float | FloatArray]:
    """Return values whose sidewall follows the pressure a little less."""
    slopes = ("radial_pressure_slope", "tangential_pressure_slope")
    return {**values, **{name: FLATTER * np.asarray(values[name]) for name in slopes}}


def _result(fitter: Fitter) -> Refit:
    """Return the fitted model."""
    rest = fitter.whiten(fitter.data.strain - fitter.waveform)
    normal = fitter.rows @ fitter.rows.T + np.diag(fitter.width**-2)
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return Refit(
        fitter.values,
        fitter.effects,
        fitter.strengths(fitter.z),
        fitter.delay(fitter.z),
        fitter.waveform,
        fitter.deflection,
        fitter.slopes,
        fitter.large(fitter.z),
        fitter.whiten,
        covariance,
        float(np.sqrt(np.mean(rest**2))),
    )
