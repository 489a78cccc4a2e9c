"""What a diagnosis of strain can find at the user's own plan and noise.

Every effect of the catalogue is planted, one at a time, in plain tires of the families that the
library knows (`tirelib.inference.statistics.chance`), so strong that the error grows by a given
ratio, and judged by the statistic and the level of `tirelib diagnose`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.threads import one_thread
from tirelib.effects import Effect
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, plain_tires, twins_of, twins_told
from tirelib.inference.diagnose.strain_models import problem_of
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.chance import Plans
from tirelib.inference.statistics.hypotheses import Hypotheses

FORMAT = "tirelib-selftest/1"
NOTE = (
    "The tires are plain ones of the library's three simulators, each judged by the two others "
    "with the statistic of the diagnosis, to first order and without exact fits. Effects follow "
    "the laws of the catalogue, which real tires do only roughly: these chances are optimistic."
)
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


def selftest_document(found: SelfTest) -> dict[str, Any]:
    """Return a self-test as ``tirelib-selftest/1``; strains in microstrain, angles in deg."""
    by_name: dict[str, list[Planting]] = {}
    for planting in found.plantings:
        by_name.setdefault(planting.effect.name, []).append(planting)
    ratios = list(dict.fromkeys(planting.ratio for planting in found.plantings))
    return {
        "format": FORMAT,
        "campaign": found.campaign,
        "axes": "iso",
        "quantity": "strain",
        "note": NOTE,
        "optimistic": True,
        "ratios": ratios,
        "repeats": found.repeats,
        "false_alarm": found.false_alarm,
        "seed": found.seed,
        "noise_ustrain": 1e6 * found.noise,
        "misfit_size": found.size,
        "false_alarms": {"share": found.alarms / found.repeats, "n": found.repeats},
        "summary": [_summary(found, ratio) for ratio in ratios],
        "effects": [
            {
                "effect": name,
                "title": each[0].effect.title,
                "unit": each[0].effect.unit,
                "largest_ratio": found.largest[name],
                "twins": twins_told(found.twins[name]),
                "results": [_result(planting) for planting in each],
            }
            for name, each in by_name.items()
        ],
        "dead": dict(found.dead),
    }


def _summary(found: SelfTest, ratio: float) -> dict[str, Any]:
    """Return the shares over all effects that can be planted at a ratio."""
    done = [p for p in found.plantings if p.ratio == ratio and p.reachable]
    return {"ratio": ratio, "effects": len(done), **_shares(done)}


def _result(planting: Planting) -> dict[str, Any]:
    low, high = chance_range(planting.right, len(planting.named))
    return {
        "ratio": planting.ratio,
        "strength": planting.strength,
        "reachable": planting.reachable,
        **_shares([planting]),
        "found_low": low,
        "found_high": high,
        "named": sorted({name for names in planting.named for name in names}),
    }


def _shares(plantings: Sequence[Planting]) -> dict[str, Any]:
    """Return the number of tires in which effects were planted, and the shares of what was said."""
    n = sum(len(p.named) for p in plantings)
    counts = {
        "found": sum(p.right for p in plantings),
        "in_set": sum(p.held for p in plantings),
        "wrong": sum(p.wrong for p in plantings),
        "seen": sum(p.seen for p in plantings),
    }
    return {"n": n, **{key: count / n if n else None for key, count in counts.items()}}


def chance_range(right: int, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a chance by Wilson's score; NaN without trials.

    Examples
    --------
    >>> [round(x, 3) for x in chance_range(9, 10)]
    [0.596, 0.982]
    """
    if n == 0:
        return float("nan"), float("nan")
    interval = binomtest(right, n).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)
