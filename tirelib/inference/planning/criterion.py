"""Possible runs, judged by how well they part suspects, for strain and for forces."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.planning.envelope import Envelope

NOTHING = "no_effect"
"""Name of the rival that needs no further effect."""
LEAST_SEPARATION = 1.0
"""Separation below which a run tells nothing: noise alone moves the chi-square of one number so."""
WANTED = 20.0
"""Separation that one asks for: odds of e^10 against the wrong rival."""
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
"""Repeats of the best run that are looked at."""
ENDLESS = 1e6
"""Repeats that average everything that repeats can average."""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A suspect fitted to the present runs.

    Attributes
    ----------
    name : str
        Name of the effect, or `NOTHING`.
    cost : float
        Chi-square left on the present runs, less that of no effect.
    strength : shape (components,)
        In the effect's unit; empty for `NOTHING`.
    in_range : bool
        Whether it is plausible, give or take two standard deviations.
    """

    name: str
    cost: float
    strength: FloatArray
    in_range: bool


@dataclass(frozen=True, slots=True)
class Trial:
    """Suspects on the present runs.

    Attributes
    ----------
    rivals : tuple of Suspect
        Those whose fits have settled.
    left_out : mapping of name to reason
    size : float
        Size of the structural misfit; 1 is that of plain tires.
    """

    rivals: tuple[Suspect, ...]
    left_out: Mapping[str, str]
    size: float


@dataclass(frozen=True, slots=True)
class Noise:
    """Random parts of a run's samples.

    Attributes
    ----------
    random : float
        Between repeated runs.
    staying : float
        Misfit that a run has for itself, which repeats do not average.
    """

    random: float
    staying: float


@dataclass(frozen=True, slots=True)
class PairForecast:
    """Two rivals, now and at every possible run.

    Attributes
    ----------
    names : (str, str)
    gap : float
        Chi-square by which the second is worse on the present runs; negative: the first.
    resolved : bool
        Whether the present runs leave exactly one of them in the confidence set.
    separation : shape (n,)
        Expected further chi-square by one run.
    probability : shape (n,)
        That one run puts one of them out of it; NaN where both are out already.
    repeats : mapping of number to float
        Separation by so many repeats of the best run.
    limit : float
        Separation that no number of repeats exceeds.
    """

    names: tuple[str, str]
    gap: float
    resolved: bool
    separation: FloatArray
    probability: FloatArray
    repeats: Mapping[int, float]
    limit: float

    @property
    def better(self) -> str:
        """The rival that the present runs like better."""
        return self.names[0] if self.gap >= 0.0 else self.names[1]

    def needed(self, wanted: float) -> int | None:
        """Return the fewest repeats of the best run with a separation, None beyond `REPEATS`."""
        return next((n for n, reached in self.repeats.items() if reached >= wanted), None)


@dataclass(frozen=True, slots=True)
class NextTest:
    """The possible runs, judged.

    Attributes
    ----------
    envelope : Envelope
    points : shape (n, axes), SI
        The possible runs on the envelope's axes, best first.
    score, std, probability : shape (n,)
        Separation of the pair that is hardest there, its standard deviation, and mean chance to
        rule a rival out.
    hardest : tuple of int
        Index of that pair, per run.
    pairs : tuple of PairForecast
        In the order of the points.
    trial : Trial
        The rivals on the present runs, and who is none.
    dropped : int
        Possible runs at which a rival has no solution.
    noise : Noise
    """

    envelope: Envelope
    points: FloatArray
    score: FloatArray
    std: FloatArray
    probability: FloatArray
    hardest: tuple[int, ...]
    pairs: tuple[PairForecast, ...]
    trial: Trial
    dropped: int
    noise: Noise

    @property
    def open_pairs(self) -> tuple[PairForecast, ...]:
        """Pairs that the present runs do not part."""
        return tuple(pair for pair in self.pairs if not pair.resolved)

    @property
    def hopeless(self) -> bool:
        """Whether no run parts any of the open pairs."""
        return bool(self.open_pairs) and all(
            float(np.max(pair.separation)) < LEAST_SEPARATION for pair in self.open_pairs
        )
