"""By how much the laws of a hypothesis are off: what that allows, and how likely it is.

Each law is off by a relative standard deviation of its own. Most laws that other simulators have do
not look like any other effect of the catalogue, and a few do to some extent. So what looks like
other effects is allowed for, or it is not, whichever is likelier.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.null import PRIOR, Null
from tirelib.inference.statistics.plain import BASE, ROUGHLY, Family
from tirelib.inference.statistics.posterior import Posterior
from tirelib.inference.statistics.size import Size
from tirelib.inference.statistics.views import View

LAWS = (0.03, 0.1, 0.3)
"""Relative standard deviations by which laws are off, each law by its own: a hypothesis stays if it
does with the likeliest ones, or with the same for all."""
LOOSEST = 1.0
"""That which is tried where a hypothesis is rejected: its laws are off by as much as themselves."""


class Errors(NamedTuple):
    """By how much laws are off.

    Attributes
    ----------
    laws : tuple of float
        Relative standard deviation of each law's error; zero for an exact law.
    lookalike : float
        How much of what rough laws do may look like any one other effect.
    """

    laws: tuple[float, ...]
    lookalike: float

    def but(self, index: int, law: float, lookalike: float) -> "Errors":
        """Return the same with another error of one law."""
        return Errors((*self.laws[:index], law, *self.laws[index + 1 :]), lookalike)


class Likelihoods:
    """The log likelihood of a fit by how far its laws are off, by the family that fits best.

    Parameters
    ----------
    fit : Posterior
    families : sequence of Family
    views : sequence of View
        Normal equations by the size of the misfit that a run has for itself, in order.

    Attributes
    ----------
    exact, loosest, likeliest : Errors
    alike : list of Errors
        With the same error for all laws that are only roughly right, the likeliest first.
    """

    def __init__(self, fit: Posterior, families: Sequence[Family], views: Sequence[View]) -> None:
        self.fit, self.families = fit, families
        self.exact, first, self.loosest = map(self._same, (0.0, LAWS[1], LOOSEST))
        exact = self._best(views, self.exact)
        for _ in range(2):
            self._nulls = {self.exact: exact, first: self._best(views, first)}
            # a run's own misfit is smaller where laws may be further off: it is chosen again
            self._view = self._nulls[first][0].view
            self.alike = sorted(map(self._same, LAWS), key=self.of, reverse=True)
            if self.alike[0] == first:
                break
            first = self.alike[0]
        self._searched = self._search()
        best = max(self._searched, key=lambda each: self._searched[each])
        self.likeliest = max((best, *self.alike, self.exact), key=self.of)

    def nulls(self, errors: Errors) -> tuple[Null, ...]:
        """Return the test by every family."""
        if errors not in self._nulls:
            self._nulls[errors] = self._at(self._view, errors)
        return self._nulls[errors]

    def of(self, errors: Errors) -> float:
        """Return the largest log likelihood, [nats]."""
        return _largest(self.nulls(errors))

    def gained(self, errors: Errors) -> dict[str, float]:
        """Return the largest log likelihood with each further effect, to first order, [nats]."""
        nulls = self.nulls(errors)
        return {name: max(null.gained[name] for null in nulls) for name in nulls[0].gained}

    def unnamed(self, errors: Errors) -> float:
        """Return the log likelihood where something without a name acts as well, [nats]."""
        return max(null.unnamed for null in self.nulls(errors))

    def exact_in(self, index: int) -> float:
        """Return `unnamed` where one effect's law is exact, and the others are roughly right."""
        found = self._searched
        best = max((e for e in found if not e.laws[index]), key=lambda each: found[each])
        return max(self.unnamed(best), self.unnamed(self.exact))

    def _search(self) -> dict[Errors, float]:
        """Return likelihoods on the way to the likeliest errors, one law after the other.

        They are at the likeliest sizes of what a tire shows with the same error for all laws.
        """
        start, best = self.nulls(self.alike[0]), self.alike[0]
        found = {best: self.of(best)}
        vague = [k for k, effect in enumerate(self.fit.effects) if not effect.exact]
        for k in vague if len(vague) == 1 else (*vague, *vague):
            for law in (0.0, *LAWS):
                for share in dict.fromkeys((0.0, self.fit.lookalike)):
                    each = best.but(k, law, share)
                    if each not in found:
                        found[each] = _largest(
                            null_of(null.view, self.fit, null.family, each, null.size)
                            for null in start
                        )
            best = max(found, key=lambda each: found[each])
        return found

    def _best(self, views: Sequence[View], errors: Errors) -> tuple[Null, ...]:
        """Return the tests by every family with the likeliest size of a run's own misfit.

        Every third size is tried first, and then those next to the best one, as far as it rises.
        """
        found = {place: self._at(views[place], errors) for place in range(0, len(views), 3)}
        best, before = max(found, key=lambda place: _largest(found[place])), None
        while best != before:
            near = [place for place in (best - 1, best + 1) if 0 <= place < len(views)]
            found |= {k: self._at(views[k], errors) for k in near if k not in found}
            best, before = max((best, *near), key=lambda place: _largest(found[place])), best
        return found[best]

    def _at(self, view: View, errors: Errors) -> tuple[Null, ...]:
        return tuple(null_of(view, self.fit, family, errors) for family in self.families)

    def _same(self, law: float) -> Errors:
        """Return one error for all laws that are only roughly right."""
        laws = tuple(0.0 if effect.exact else law for effect in self.fit.effects)
        return Errors(laws, self.fit.lookalike if any(laws) else 0.0)


def _largest(nulls: Iterable[Null]) -> float:
    return max(null.likelihood for null in nulls)


def null_of(
    view: View, fit: Posterior, family: Family, errors: Errors, size: Size | None = None
) -> Null:
    """Return the test of a fit by a family, its laws off by so much; as `Null`."""
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    allowed = {BASE: wide, **law_errors(fit, errors)}
    return Null(view, family, family.spread(fit.sizes), allowed, fit.sides, fit.gage, size)


def law_errors(fit: Posterior, errors: Errors) -> dict[str, float | FloatArray]:
    """Return variances by block where the laws are off by so much.

    They come on top of what plain tires show. A law's error has shapes of its own. To some extent
    it may look like each other effect: by a share of what the laws do, as far as neither the base
    nor what plain tires show can take it. Exact laws have no error.
    """
    laws = dict(zip(fit.names, errors.laws, strict=True))
    laws = {name: law for name, law in laws.items() if law}
    done = errors.lookalike**2 * sum(fit.seen[name] for name in laws)
    others = (effect.name for effect in fit.point.effects[fit.count :])
    out: dict[str, float | FloatArray] = {ROUGHLY + name: law**2 for name, law in laws.items()}
    return out | {name: done / fit.seen[name] for name in others if done and fit.seen[name] > 0.0}
