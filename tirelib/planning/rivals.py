"""What the present runs say of each suspect: a fit, and how well its numbers are known.

What the ring's structure does anyway (`tirelib.planning.structure`) stands beside the base
coordinates and the strengths as unknowns with a prior, so that no rival is blamed for it. How large
it is, the present runs tell: the size that makes them most likely. What is left then is the noise
that counts, with its correlation over the angle.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.random_effects import Whitening, whitening
from tirelib.identify.waveform_fit import Data
from tirelib.planning.criterion import NOTHING
from tirelib.planning.fit import Fitted, Guess, Metric, started
from tirelib.planning.structure import Shapes, structure_shapes

SIZES = 2.0 ** np.arange(-4.0, 1.5, 0.5)
"""Sizes of the structural misfit that are tried, relative to the variants' of a diagnosis; what
is left beyond twice that counts as noise, or structure would explain every effect."""
FAINT = 0.02
"""Start of a strength where none is known, relative to the range."""
LOST = 0.5
"""Chi-square by which a rival may be worse than without its effect before its fit has failed."""
ROUNDS = 3
"""Times that noise and size of the misfit are brought in line."""
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A suspect fitted to the present runs.

    Attributes
    ----------
    name : str
        Of the effect, or `NOTHING`.
    fitted : Fitted
    in_range : bool
        Whether the strength lies in its plausible range, give or take two standard deviations.
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
        Of the structural misfit; 1 is that of the variants of a diagnosis.
    noise : float, [-]
        White noise over the angle that counts as what is left does.
    spread : float, [-]
        Over the rms of what is left: larger than 1, for neighbouring angles agree.
    """

    base: Refit
    rivals: tuple[Rival, ...]
    left_out: dict[str, str]
    shapes: Shapes
    size: float
    noise: float
    spread: float


def try_suspects(
    data: Data,
    base: Refit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    *,
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
    shapes : Shapes, optional
        Of the structural misfit; drawn if there are none.
    with_nothing : bool
        Whether the base itself is a rival.
    progress : callable, optional
    """
    plain = started(base.values, base.effects, base.strengths)
    if shapes is None:
        shapes = structure_shapes(data, base, progress=progress)
    guesses = [
        started(base.values, [*base.effects, effect], [*base.strengths, _start(effect, strength)])
        for effect, strength in suspects
    ]
    noise, spread, size = _levels(data, plain, guesses, shapes)
    metric = Metric(data, _whitening(data, base, noise), shapes.present, shapes.sizes(size))
    nothing = metric.fit(plain)
    rivals, left_out = [Rival(NOTHING, nothing, True)] if with_nothing else [], {}
    for guess in guesses:
        name = guess.effects[-1].name
        if progress is not None:
            progress(f"fit with {name}")
        found = _fit(metric, nothing, guess)
        if isinstance(found, str):
            left_out[name] = found
        else:
            rivals.append(Rival(name, found, _in_range(found)))
    return Trial(base, tuple(rivals), left_out, shapes, size, noise, spread)


def _start(effect: Effect, strength: FloatArray) -> FloatArray:
    """Return a start inside the range, and off zero."""
    start: FloatArray = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
    return start if np.any(start) else np.full(effect.components, FAINT * effect.toward)


def _fit(metric: Metric, nothing: Fitted, guess: Guess) -> Fitted | str:
    """Return the minimum with an effect, or why none was found.

    The fit without the effect, at strength zero, is the second start: a one-sided effect that
    would serve with the other sign only stays there.
    """
    effect = guess.effects[-1]
    second = guess.at(np.concatenate([nothing.guess.z, np.zeros(effect.components)]))
    best: Fitted | None = None
    said = ""
    for start in (guess, second):
        try:
            found = metric.fit(start)
        except TirelibError as error:
            said = f"its fit did not converge: {error}"
            continue
        if best is None or found.cost < best.cost:
            best = found
        if best.cost < nothing.cost:
            break
    if best is None:
        return said
    if best.cost > nothing.cost + LOST:
        return (
            f"its fit did not reach the minimum: chi-square {best.cost:.1f} with it, "
            f"{nothing.cost:.1f} without"
        )
    return best


def _in_range(found: Fitted) -> bool:
    guess = found.guess
    effect, strength = guess.effects[-1], guess.strengths[-1]
    last = guess.z.size
    own = np.arange(last - effect.components, last)
    slack = RANGE_SLACK * effect.scale * np.sqrt(found.covariance[own, own])
    return bool(((strength >= effect.low - slack) & (strength <= effect.high + slack)).all())


def _whitening(data: Data, base: Refit, noise: float) -> Whitening:
    return whitening(
        base.waveform, base.values, data.points, data.tolerance, data.angle_std, noise,
        data.low_pass,
    )  # fmt: skip


def _levels(
    data: Data, plain: Guess, guesses: Sequence[Guess], shapes: Shapes
) -> tuple[float, float, float]:
    """Return noise that counts, its excess over the rms, and size of the structural misfit.

    All suspects at once may serve: what they can explain is no noise.
    """
    found = plain.solved(data, data.points)
    slopes, _ = plain.slopes(found, data, data.points)
    rows, width = [slopes], [plain.width]
    for guess in guesses:
        faint = guess.at(np.append(plain.z, np.zeros(guess.z.size - plain.z.size)))
        more, _ = faint.slopes(found, data, data.points)
        rows.append(more[plain.z.size :])
        width.append(guess.width[plain.z.size :])
    every = np.concatenate([*rows, shapes.present])
    known = np.concatenate(width)
    rest = data.strain - found.waveform
    noise, spread, size = data.noise, 1.0, 1.0
    for _ in range(ROUNDS):
        whiten = whitening(
            found.waveform, plain.values, data.points, data.tolerance, data.angle_std, noise,
            data.low_pass,
        )  # fmt: skip
        white, flat = whiten(rest), whiten(every).reshape(len(every), -1)
        gram, project = flat @ flat.T, flat @ white.ravel()

        def precision(size: float) -> FloatArray:
            return np.concatenate([known, shapes.sizes(size)]) ** -2.0

        likely = [_likelihood(gram, project, precision(float(s))) for s in SIZES]
        size = float(SIZES[int(np.argmax(likely))])
        moved = np.linalg.solve(gram + np.diag(precision(size)), project)
        left = white - (moved @ flat).reshape(white.shape)
        spread = correlation(left)
        noise = min(data.noise, noise * spread * float(np.sqrt(np.mean(left**2))))
    return noise, spread, size


def correlation(left: FloatArray) -> float:
    """Return the noise that counts over the rms: root of samples over independent samples.

    From the power spectrum over the turn, sum P^2 / (sum P)^2 is one over the independent ones.

    Examples
    --------
    >>> correlation(np.random.default_rng(0).standard_normal((400, 360)))
    1.00
    """
    power = np.mean(np.abs(np.fft.rfft(left, axis=1)[:, 1:]) ** 2, axis=0)
    independent = 2.0 * float(np.sum(power)) ** 2 / float(np.sum(power**2))
    return float(np.sqrt(left.shape[1] / independent))


def _likelihood(gram: FloatArray, project: FloatArray, precision: FloatArray) -> float:
    """Return twice the log likelihood of the runs, up to a constant."""
    factor = linalg.cho_factor(gram + np.diag(precision), lower=True)
    volume = 2.0 * np.log(np.diag(factor[0])).sum() - np.log(precision).sum()
    return float(project @ linalg.cho_solve(factor, project) - volume)
