"""Standard scores, and the limit that plain tires of unlike families set."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.unit.infer.linear_problem import Toy, drawn, family
from tirelib.infer.hypothesis import Hypothesis, judged
from tirelib.infer.null import standard
from tirelib.infer.plain import Family
from tirelib.infer.posterior import posterior

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))
LOUD = replace(family(40, 3, "loud"), draws=4.0 * family(40, 3).draws)
"""Plain tires that show more than their family's variances say."""


@pytest.mark.parametrize("count", [1, 2, 12])
def test_a_chi_square_has_normal_scores(count: int) -> None:
    square = stats.chi2(count).isf([0.5, 0.05, 0.001]) / count
    found = standard(square, np.array(count))
    assert found == pytest.approx(stats.norm.isf([0.5, 0.05, 0.001]), abs=0.1)


def plain(families: tuple[Family, ...]) -> Hypothesis:
    toy = Toy(drawn(np.random.default_rng(2)))
    fit = posterior(toy, (), FAMILIES[0].spread(), 0.001)
    return judged(toy, fit, families, 0.05, own_effects=0)


def test_a_family_unlike_the_others_is_judged_in_its_own_units() -> None:
    """Its tires stand out where the others judge them; by how much decides what counts."""
    alike, unlike = plain(FAMILIES), plain((*FAMILIES, LOUD))
    loud = next(judge for judge in unlike.judges if judge.family is LOUD)
    usual = next(judge for judge in unlike.judges if judge.family is FAMILIES[0])
    excess = [
        max(float((null.centre + null.deviation).max()) for null in judge.nulls)
        for judge in (loud, usual)
    ]
    assert excess[0] > excess[1] + 0.3
    # in these units its limit is as low as that of tires which are alike
    assert loud.limit(0.05) < 1.5 * alike.limit(0.05)


def test_a_tire_like_the_loud_ones_is_plain() -> None:
    random, rejected = np.random.default_rng(2), np.zeros(2, dtype=int)
    for _ in range(12):
        toy = Toy(drawn(random, size=4.0))
        fit = posterior(toy, (), FAMILIES[0].spread(), 0.001)
        for k, families in enumerate((FAMILIES, (*FAMILIES, LOUD))):
            rejected[k] += judged(toy, fit, families, 0.05, own_effects=0).p <= 0.05
    assert rejected[0] >= 5
    assert rejected[1] <= 2  # the upper 98 % bound of 5 % of 12


def test_the_limit_is_where_the_p_value_falls_to_the_level() -> None:
    judge = plain(FAMILIES).judge
    limit = judge.limit(0.05)
    assert judge.p(np.nextafter(limit, np.inf))[0] <= 0.05
    assert judge.p(0.5 * limit)[0] > 0.05
