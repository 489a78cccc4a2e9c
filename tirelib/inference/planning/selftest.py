"""What a diagnosis of strain can find at the user's own plan and noise.

Every effect of the catalogue is planted, one at a time, in plain tires of the families that the
library knows (`tirelib.inference.statistics.chance`), so strong that the error grows by a given
ratio, and judged by the statistic and the level of `tirelib diagnose`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.threads import one_thread
from tirelib.effects import Effect
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, plain_tires, twins_of
from tirelib.inference.diagnose.strain_models import problem_of
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.chance import Plans
from tirelib.inference.statistics.select import Hypotheses

RATIOS = (1.05, 1.2, 1.5)
"""Error with the planted effect, over the error without."""
REPEATS = 30


@dataclass(frozen=True, slots=True)
class Planting:
    """One effect at one strength, in several tires.

    Attributes
    ----------
    ratio : float
        The error with the effect over that without.
    strength : float
        In the effect's unit.
    reachable : bool
        Whether that strength lies in the plausible range; nothing is planted if not.
    named : tuple of tuple of str
        Effects in the confidence set, per tire; empty where nothing is missing, and where no single
        effect explains what is.
    seen : int
        Tires in which that nothing is missing is rejected.
    """

    effect: Effect
    ratio: float
    strength: float
    reachable: bool
    named: tuple[tuple[str, ...], ...]
    seen: int

    @property
    def right(self) -> int:
        """Tires in which the planted effect and no other is in the set."""
        return sum(names == (self.effect.name,) for names in self.named)

    @property
    def held(self) -> int:
        """Tires in which it is in the set, alone or with others."""
        return sum(self.effect.name in names for names in self.named)

    @property
    def wrong(self) -> int:
        """Tires in which only others are in the set."""
        return sum(bool(names) and self.effect.name not in names for names in self.named)


@dataclass(frozen=True, slots=True)
class SelfTest:
    """What the plan can find.

    Attributes
    ----------
    alarms : int
        Tires without any effect in which that nothing is missing is rejected.
    twins : mapping of name to sequence of (name, angle [rad])
    largest : mapping of name to float
        Error ratio at the end of the range, to first order.
    size : float, [-]
        What this tire shows in addition to its model, over what plain tires of the family that
        excuses most show.
    noise : float, [-]
    """

    plantings: tuple[Planting, ...]
    alarms: int
    dead: Mapping[str, str]
    twins: Mapping[str, Sequence[tuple[str, float]]]
    largest: Mapping[str, float]
    size: float
    noise: float
    false_alarm: float
    repeats: int
    seed: int
    campaign: str


@one_thread()
def selftest(
    runs: StraightRuns,
    values: Mapping[str, float | FloatArray],
    catalogue: Sequence[Effect],
    *,
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    only: Sequence[str] = (),
    ratios: Sequence[float] = RATIOS,
    repeats: int = REPEATS,
    false_alarm: float = FALSE_ALARM,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> SelfTest:
    """Plant effects at a campaign's plan and noise and count how often they are found.

    Parameters
    ----------
    values : mapping
        Numbers of the model's tire; it has the `effects` at these `strengths` already.
    catalogue : sequence of Effect
        Everyone that a diagnosis looks at.
    only : sequence of str
        Effects to plant; all living ones if empty.
    ratios : sequence of float
        Errors with the effect over those without, above 1.
    repeats : int
        Tires in which each effect is planted; the seed decides which plain tires these are.

    Raises
    ------
    ConvergenceError
        If the model does not fit.
    ParameterError
        If there are fewer plain tires than asked for.
    """
    families = plain_tires()
    most = len(families) * min(map(len, families))
    if repeats > most:
        raise ParameterError(
            f"selftest: {repeats} tires are asked for each planting; the library has {most}: give "
            "a smaller --repeats"
        )
    given = StrainProblem(runs, values, catalogue, effects, strengths)
    among = Hypotheses(given, families, false_alarm, progress)
    problem, base = problem_of(among), among.base
    plans = Plans(problem, base, false_alarm, repeats, seed)
    plantings = []
    for effect in problem.living:
        if only and effect.name not in only:
            continue
        if progress is not None:
            progress(effect.name)
        for ratio in ratios:
            size = plans.strength(effect.name, ratio)
            strength = float(np.sign(effect.toward)) * size * effect.scale
            reachable = size <= abs(effect.toward) / effect.scale
            named: tuple[tuple[str, ...], ...] = ()
            seen = 0
            if reachable:
                found = plans.planted(effect.name, strength / effect.scale)
                named, seen = found.named(), int(found.rejected.sum())
            plantings.append(Planting(effect, ratio, strength, reachable, named, seen))
    return SelfTest(
        tuple(plantings),
        int(plans.plain().rejected.sum()),
        problem.dead,
        {effect.name: twins_of(effect.name, base) for effect in problem.living},
        {e.name: plans.ratio(e.name, abs(e.toward) / e.scale) for e in problem.living},
        base.null.size.whole,
        float(np.mean(problem.noise)),
        false_alarm,
        repeats,
        seed,
        runs.waves.header.name,
    )
