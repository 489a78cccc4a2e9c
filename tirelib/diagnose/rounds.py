"""Rounds of a diagnosis: the leader is added, exactly refitted, and what it replaces is dropped."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from tirelib.arrays import FloatArray
from tirelib.diagnose.ensemble import Variants
from tirelib.diagnose.noise import WhiteNoise
from tirelib.diagnose.plain import BELT, SHEAR, usual
from tirelib.diagnose.refit import FELL, Refit, Refits, fall, inside
from tirelib.diagnose.shear import beside_shear, on_top, shear_itself, with_shear
from tirelib.diagnose.stage import ALARM, Stage, within
from tirelib.effects import Effect
from tirelib.identify.waveform_fit import Data

BARS = (ALARM, 6.0, 12.0)
"""Score over the variants' largest that the first, second and third effect have to reach: the laws
of those before are right but roughly, and each leaves more that looks like something else."""
CLEAR = 1.5
"""Times what imitates the impossible that a further effect has to reach, unless it is independent;
the first has to exceed it."""
ROUGH = 0.01
"""Share of the misfit that effects took away by which their laws may be off beside `FORM`; what is
independent of them has nothing to do with that."""
LARGE = 1.0
"""Share of its range by which an effect may be larger in the exact refit and yet be named, with a
word that it is: a range is what is plausible, and what explains the misfit speaks for itself."""
FURTHER, ON_TOP = 0.12, 0.3
"""Least share of the squared error that a further effect has to take when it is added, and the
first beside those of every belt, whose law leaves structure of its own."""
HALVED = 0.45
"""Share of the squared error from which a further alarm is needed whatever imitates it."""
ROUNDS = 3
LATEST = 4
"""Stages that are kept, in case that the same model is asked for again: each is large."""


@dataclass(frozen=True, slots=True)
class Rounds:
    """What the rounds found.

    Attributes
    ----------
    stage : Stage
        Of the model with the effects.
    named : list of str
        In the order in which they were added; those that a later one replaces are gone.
    count : int
        Of rounds.
    unlisted : int or None
        Index of the candidate of the stage in no catalogue that it needs most.
    by_share : tuple of str
        What was added for its share of the error beside the belt's shear.
    """

    stage: Stage
    named: list[str]
    count: int
    unlisted: int | None
    by_share: tuple[str, ...]


def rounds(
    data: Data,
    first: Stage,
    catalogue: Sequence[Effect],
    rests: Variants,
    noise: WhiteNoise,
    refitted: Refits,
) -> Rounds:
    """Add the leaders one after the other as long as the exact refit needs them.

    It ends where the exact refit needs something most that is in no catalogue.

    Parameters
    ----------
    data : Data
    first : Stage
        Of the model without any.
    catalogue : sequence of Effect
    rests : Variants
    noise : WhiteNoise
    refitted : Refits
    """
    # the joint ranking sees all effects at once: who is no hint now is no suspect later
    hints = (first.in_range | first.over) & (first.scores.score >= first.limit)
    suspects = {name for name, hint in zip(first.names, hints, strict=True) if hint}
    least = dict(zip(first.names, first.limit, strict=True))

    stages: deque[Stage] = deque(maxlen=LATEST)

    def staged(model: Refit) -> Stage:
        for known in stages:
            if known.model is model:
                return known
        stages.append(Stage.of(data, model, catalogue, rests, noise, least))
        return stages[-1]

    def fitted(
        stage: Stage,
        effects: Sequence[Effect],
        strengths: Sequence[FloatArray],
        need: Callable[[Refit], bool],
    ) -> Stage | None:
        """Return the stage of an exact fit; None if it does not settle or is not needed."""
        model = refitted(stage.model, effects, strengths)
        return None if model is None or not need(model) else staged(model)

    def with_its_shear(stage: Stage) -> Refit:
        known = SHEAR.name in first.names
        return with_shear(stage, refitted) if known else stage.model

    named: list[str] = []
    by_share: tuple[str, ...] = ()
    stage, count, sheared = first, 0, None
    while count < ROUNDS:
        hidden = [name for name in named if name not in BELT]
        found = _added(first, stage, suspects, len(hidden), fitted)
        if found is None or (not hidden and _idle(stage, *found)):
            sheared = with_its_shear(stage)
            among = suspects if hidden else None
            clear = beside_shear(data, stage, sheared, catalogue, refitted, staged, among)
            if clear is not None:
                by_share = tuple(dict.fromkeys((*by_share, stage.names[clear[1]])))
            elif not named:
                clear = shear_itself(stage, sheared, staged)
            found = clear or found
        if found is None:
            break
        after, index = found
        name = stage.names[index]
        if stage.unlisted[index]:
            return Rounds(stage, named, count, index, by_share)
        before, named = named, [*named, name, *_more(stage, after, name)]
        suspects.discard(name)
        count += 1
        stage, gone = _thinned(after, before, least, fitted)
        named, sheared = [name for name in named if name not in gone], None
    if fall(first.model, stage.model) >= FELL:
        last = on_top(stage, sheared or with_its_shear(stage), FURTHER, staged)
        named, stage = [*named, *_more(stage, last)], last
    return Rounds(stage, named, count, None, by_share)


_Fit = Callable[
    [Stage, Sequence[Effect], Sequence[FloatArray], Callable[[Refit], bool]], Stage | None
]


def _added(
    first: Stage, stage: Stage, suspects: set[str], before: int, fitted: _Fit
) -> tuple[Stage, int] | None:
    """Return the stage with the leader whose exact refit leaves least, and its index.

    A leader that is far too large for its range in the exact refit as well is barred, and so is
    what it leads.
    """
    bar, least = BARS[min(before, len(BARS) - 1)], FURTHER if before else ON_TOP
    clear = CLEAR if before else 1.0
    tried: dict[int, Stage | None] = {}
    barred: set[str] = set()
    while True:
        leaders = stage.leaders(suspects, bar, clear, barred, spared=before > 0)
        if not before and stage is not first:  # beside the belt's, a hint is no rival
            leaders = [index for index in leaders if stage.ratio[index] >= ALARM]
        for index in leaders:
            if index not in tried:
                tried[index] = _trial(first, stage, index, fitted, least)
        large = {
            stage.names[index] for index in leaders if stage.over[index] and not _fits(tried[index])
        }
        if not large:
            break
        barred |= large
    needed = [(after, index) for index in leaders if (after := tried[index]) is not None]
    if not needed and before:  # what imitates the impossible, but takes half of the error
        for index in stage.leaders(suspects, ALARM, 0.0, barred):
            after = tried[index] if index in tried else _trial(first, stage, index, fitted, least)
            fits = after is not None and (not stage.over[index] or _fits(after))
            if after is not None and fits and fall(stage.model, after.model) >= HALVED:
                needed.append((after, index))
    return min(needed, key=lambda pair: pair[0].scores.misfit, default=None)


def _more(before: Stage, after: Stage, *names: str) -> list[str]:
    """Return further effects that a stage has than those of another and some names."""
    known = {effect.name for effect in before.model.effects} | set(names)
    return [effect.name for effect in after.model.effects if effect.name not in known]


def _idle(before: Stage, after: Stage, index: int) -> bool:
    """Return whether an effect of the catalogue takes hardly any of the error."""
    return not before.unlisted[index] and fall(before.model, after.model) < FELL


def _trial(first: Stage, stage: Stage, index: int, fitted: _Fit, least: float) -> Stage | None:
    """Return the stage with one more effect, if the exact refit needs it.

    A further one has to take a least share of the squared error, and to be more than a plain tire
    shows.
    """
    model = stage.model
    effect, strength = stage.found.living[index].effect, stage.scores.strength[index]
    # the laws of those before are right but roughly: what they may be off by is no effect
    off = ROUGH * (first.scores.misfit - stage.scores.misfit)
    if stage.scores.score[index] < off and not stage.independent[index]:
        return None

    def need(found: Refit) -> bool:
        if usual(model.effects, effect, found.strengths[-1]):
            return False
        # the first may be hidden in the error by another that is to come
        if stage is first or stage.unlisted[index]:
            return True
        # what the joint fit asks for may not be what the exact refit adds
        other = effect.components == 1 and float(strength[0] * found.strengths[-1][0]) < 0.0
        return not other and fall(model, found) >= least

    start = [*model.strengths, inside(effect, strength)]
    after = fitted(stage, [*model.effects, effect], start, need)
    # to first order only if the exact refit does not need it
    if after is None or stage.scores.misfit - after.scores.misfit < ALARM * stage.limit[index]:
        return None
    return after


def _fits(after: Stage | None) -> bool:
    """Return whether what was added last is not too large to be named."""
    if after is None:
        return False
    model = after.model
    return within(model.effects[-1], model.strengths[-1], model.strength_std(-1), LARGE)


def _thinned(
    stage: Stage, before: Sequence[str], least: Mapping[str, float], fitted: _Fit
) -> tuple[Stage, set[str]]:
    """Return a stage without those effects that the one added last has made needless."""
    gone: set[str] = set()
    for name in before:
        kept = [k for k, effect in enumerate(stage.model.effects) if effect.name != name]
        effects = [stage.model.effects[k] for k in kept]
        strengths = [stage.model.strengths[k] for k in kept]
        without = fitted(stage, effects, strengths, lambda _: True)
        if without is None:
            continue
        back = without.scores.misfit - stage.scores.misfit
        if back < ALARM * least[name] or fall(without.model, stage.model) < FELL:
            stage = without
            gone.add(name)
    return stage, gone
