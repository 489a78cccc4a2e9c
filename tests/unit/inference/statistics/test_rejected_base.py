"""A model that leaves far more than noise does need not settle, unless a comparison hangs on it."""

from typing import Any

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import N, Solved, Toy, drawn, family
from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.hypotheses import REJECTED, Hypotheses
from tirelib.inference.statistics.posterior import FAR, LOOSE, posterior
from tirelib.inference.statistics.problem import Point

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))
BENT = 0.03


class Bent(Toy):
    """A model that is curved, so that its fit takes several steps."""

    def solve(self, point: Point, near: Any = None) -> Solved:
        curved = BENT * (point.base[0] - 1.0) ** 2 * self.base[1] * self.base[0]
        return Solved(super().solve(point).rest - curved)


def left(size: float) -> FloatArray:
    """Return a toy tire that leaves about so many times what noise leaves, by its twist."""
    return drawn(np.random.default_rng(4), twist=np.sqrt(size - 1.0))


def test_a_rejected_base_is_settled_only_where_another_hypothesis_is_nearly_as_likely() -> None:
    toy = Bent(left(4.0))
    among = Hypotheses(toy, FAMILIES)
    rough = among.base
    assert rough.p <= 0.05
    assert REJECTED * N < rough.fit.cost < FAR * N
    assert rough.fit.short == pytest.approx(
        LOOSE * (rough.fit.cost - REJECTED * N), rel=0.05, abs=1.0
    )
    assert among._base_against(0.5 * rough.fit.short + 1.0) is rough
    assert among._base_against(-1.0) is rough
    settled = among._base_against(0.5 * rough.fit.short - 1.0)
    assert settled is among.base
    assert settled is not rough
    assert settled.fit.short < 1.0
    assert settled.fit.cost <= rough.fit.cost
    assert among._base_against(1.0) is settled


def test_a_base_that_is_not_rejected_has_settled() -> None:
    among = Hypotheses(Bent(left(1.0)), FAMILIES)
    assert among.base.p > 0.05
    assert among.base.fit.short < 2.0


def test_a_loose_fit_ends_within_what_it_may_be_short_of() -> None:
    toy = Bent(left(5.0))
    spread, whiten = FAMILIES[0].shown(), toy.whitener(0.00025)
    loose = posterior(toy, (), spread, whiten, loose_from=REJECTED)
    exact = posterior(toy, (), spread, whiten)
    assert exact.cost <= loose.cost <= exact.cost + loose.short
