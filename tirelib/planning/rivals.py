"""What the present runs say of each suspect: a fit, and how well its numbers are known.

The fit is exact, in the metric in which a diagnosis ranks effects: what the ring's structure does
anyway (`tirelib.planning.structure`) stands beside the base coordinates and the strengths as
unknowns with a prior, so that no rival is blamed for it. Where even all suspects together leave
more than structure usually does, noise and structure count as that much larger.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.noise import white_noise
from tirelib.diagnose.refit import Refit, inside
from tirelib.diagnose.stage import USUAL
from tirelib.diagnose.structure import LEAST, spread_of
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.random_effects import Whitening, whitening
from tirelib.identify.waveform_fit import Data
from tirelib.planning.criterion import NOTHING
from tirelib.planning.fit import Fitted, Guess, Metric, started
from tirelib.planning.on_trial import fitted_rivals
from tirelib.planning.structure import Shapes, structure_shapes

FAINT = 0.02
"""Start of a strength where none is known, relative to the range."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A suspect fitted to the present runs.

    Attributes
    ----------
    name : str
        Of the effect, or `NOTHING`.
    fitted : Fitted
    in_range : bool
        Whether the strength lies within its plausible range; else an end of it holds it.
    """

    name: str
    fitted: Fitted
    in_range: bool

    @property
    def cost(self) -> float:
        """Chi-square left on the present runs."""
        return self.fitted.cost

    @property
    def strength(self) -> FloatArray:
        """In the effect's unit, (components,); empty for `NOTHING`."""
        return self.fitted.guess.strengths[-1] if self.name != NOTHING else np.zeros(0)


@dataclass(frozen=True, slots=True)
class Trial:
    """Rivals on the same runs, under the same noise.

    Attributes
    ----------
    base : Refit
        The model without the suspects.
    rivals : tuple of Rival
    left_out : mapping of name to reason
        Suspects whose fit failed.
    shapes : Shapes
        Of the structural misfit.
    size : float, [-]
        What even all suspects together leave, over what structure usually leaves, as a ratio of
        rms. Beyond 1, noise and structure count as that much larger.
    noise : float, [-]
        Standard deviation of a sample that nothing else explains.
    """

    base: Refit
    rivals: tuple[Rival, ...]
    left_out: dict[str, str]
    shapes: Shapes
    size: float
    noise: float


def repeated_noise(runs: StraightRuns, data: Data, base: Refit) -> float:
    """Return the noise of a waveform by repeats, as a diagnosis takes it; NaN without, [-].

    What set points or the tire's numbers explain of their differences is none, and smooth noise
    counts as much as the white one that meets a smooth shape alike.
    """
    if not np.isfinite(runs.noise.std):
        return float("nan")
    return white_noise(runs, base, data.strain).smooth * base.whiten.noise


def try_suspects(
    data: Data,
    base: Refit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    *,
    noise: float,
    shapes: Shapes | None = None,
    with_nothing: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Trial:
    """Fit every suspect to the present runs.

    Parameters
    ----------
    data : Data
    base : Refit
        The model without any of the suspects, fitted.
    suspects : sequence of (effect, start strength)
    noise : float, [-]
        Of a run's waveform, from repeats; NaN without.
    shapes : Shapes, optional
        Of the structural misfit; drawn if there are none.
    with_nothing : bool
        Whether the base itself is a rival.
    progress : callable, optional
    """
    if shapes is None:
        shapes = structure_shapes(data, base, progress=progress)
    plain = started(base.values, base.effects, base.strengths)
    guesses = [
        started(base.values, [*base.effects, effect], [*base.strengths, _start(effect, strength)])
        for effect, strength in suspects
    ]
    known = noise if np.isfinite(noise) else 0.0
    white = data.noise * spread_of(known / data.noise, len(data.points))
    metric = Metric(data, _whitening(data, base, white), shapes.present)
    nothing = metric.fit(plain)
    usual = ((known / data.noise) ** 2 + USUAL * LEAST**2) / (white / data.noise) ** 2
    size = float(np.sqrt(_left(metric, nothing.guess, guesses) / usual))
    if size > 1.0:
        shapes, white = Shapes(size * shapes.present, size * shapes.ahead), size * white
        metric = Metric(data, _whitening(data, base, white), shapes.present)
        nothing = metric.fit(nothing.guess)
    rivals, left_out = fitted_rivals(
        {guess.effects[-1].name: partial(_fit, metric, nothing, guess) for guess in guesses},
        Rival(NOTHING, nothing, True),
        with_nothing=with_nothing,
        progress=progress,
    )
    return Trial(base, rivals, left_out, shapes, size, white)


def _left(metric: Metric, plain: Guess, guesses: Sequence[Guess]) -> float:
    """Return the chi-square a sample that all suspects together leave, to first order."""
    data = metric.data
    found = plain.solved(data, data.points)
    rows, width = [plain.slopes(found, data, data.points)[0]], [plain.width]
    for guess in guesses:
        faint = guess.at(np.append(plain.z, np.zeros(guess.z.size - plain.z.size)))
        rows.append(faint.slopes(found, data, data.points)[0][plain.z.size :])
        width.append(guess.width[plain.z.size :])
    return metric.left(np.concatenate(rows), np.concatenate(width), found) / data.strain.size


def _start(effect: Effect, strength: FloatArray) -> FloatArray:
    """Return a start inside the range, and off zero."""
    start = inside(effect, strength)
    return start if np.any(start) else np.full(effect.components, FAINT * effect.toward)


def _fit(metric: Metric, nothing: Fitted, guess: Guess) -> Rival:
    """Return the minimum with an effect.

    The fit without the effect, at strength zero, is the second start: a one-sided effect that
    would serve with the other sign only stays there.
    """
    effect = guess.effects[-1]
    second = guess.at(np.concatenate([nothing.guess.z, np.zeros(effect.components)]))
    best: Fitted | None = None
    trouble: TirelibError | None = None
    for start in (guess, second):
        try:
            found = metric.fit(start)
        except TirelibError as error:
            trouble = error
            continue
        best = found if best is None or found.cost < best.cost else best
        if best.cost < nothing.cost:
            break
    if best is None:
        assert trouble is not None  # noqa: S101 - a start has failed
        raise trouble
    return Rival(effect.name, best, _in_range(best))


def _in_range(found: Fitted) -> bool:
    """Return whether no end of its range holds the last effect's strength."""
    return not bool(found.guess.held[-found.guess.effects[-1].components :].any())


def _whitening(data: Data, base: Refit, noise: float) -> Whitening:
    return whitening(
        base.waveform,
        base.values,
        data.points,
        data.tolerance,
        data.angle_std,
        noise,
        data.low_pass,
    )
