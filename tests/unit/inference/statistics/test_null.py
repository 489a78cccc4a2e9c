"""Standard scores, and the limit that plain tires of unlike families set."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.unit.inference.statistics.linear_problem import SHAPES, N, Toy, drawn, family
from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics import null, size
from tirelib.inference.statistics.hypothesis import Hypothesis, judged
from tirelib.inference.statistics.null import standard
from tirelib.inference.statistics.plain import Family
from tirelib.inference.statistics.posterior import posterior

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
    fit = posterior(toy, (), FAMILIES[0].shown(), toy.whitener(0.001))
    return judged(toy, fit, families, 0.05, own_effects=0)


def over(found: Hypothesis, name: str) -> float:
    """Return a standard score before it is held against its distribution on plain tires."""
    mean, std = found.null.usual
    place = found.null.names.index(name)
    return float(found.scores[name] * std[place] + mean[place])


def test_what_is_on_the_side_of_no_effect_is_unknown_and_counts_half(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A twist is 0 to 2: less than none is not a twist, and something is there all the same."""
    toy = Toy(drawn(np.random.default_rng(2), twist=-1.0))
    fit = posterior(toy, (), FAMILIES[0].shown(), toy.whitener(0.001))
    found = judged(toy, fit, FAMILIES, 0.05, own_effects=0)
    assert found.p <= 0.05
    twist, bend = over(found, "twist"), over(found, "bend")
    monkeypatch.setattr(null, "OPPOSITE", 1.0)
    whole = judged(toy, fit, FAMILIES, 0.05, own_effects=0)
    assert twist == pytest.approx(0.5 * over(whole, "twist"))
    assert bend == pytest.approx(over(whole, "bend"))
    more = Toy(drawn(np.random.default_rng(2), twist=1.0))
    fit = posterior(more, (), FAMILIES[0].shown(), more.whitener(0.001))
    assert judged(more, fit, FAMILIES, 0.05, own_effects=0).scores["twist"] > 5.0


def test_a_tire_like_one_family_is_not_rejected_because_others_show_less() -> None:
    """A family that shows more sets the limit for every user, in whatever stands out."""
    toy = Toy(drawn(np.random.default_rng(5), size=4.0))
    fit = posterior(toy, (), FAMILIES[0].shown(), toy.whitener(0.001))
    alike, unlike = (
        judged(toy, fit, families, 0.05, own_effects=0)
        for families in (FAMILIES, (*FAMILIES, LOUD))
    )
    assert alike.p <= 0.05
    assert unlike.p > 0.05
    assert np.median(unlike.plain[2]) > np.median(unlike.plain[0])


def test_shapes_that_plain_tires_often_show_do_not_hide_an_effect_that_they_never_show() -> None:
    """Each score is held against its own distribution, not against the largest of all."""
    wavy = []
    for each in FAMILIES:
        draws = each.draws.copy()
        draws[:, -2 * SHAPES : -SHAPES] *= 6.0
        wavy.append(replace(each, draws=draws))
    toy = Toy(drawn(np.random.default_rng(2), bend=0.3))
    fit = posterior(toy, (), FAMILIES[0].shown(), toy.whitener(0.001))
    found = judged(toy, fit, wavy, 0.05, own_effects=0)
    mean, std = found.null.usual
    shape = found.null.names.index("smooth, all")
    # a tenth of the plain tires shows more of the shapes, and none as much of the effect
    assert over(found, "bend") < mean[shape] + 1.3 * std[shape]
    assert found.against == "bend"
    assert found.p <= 0.05


def test_a_score_that_plain_tires_hardly_show_keeps_its_unit() -> None:
    mean, std = plain(FAMILIES).null.usual
    assert (mean >= 0.0).all()
    assert (std >= 1.0).all()
    assert std.min() == 1.0


def test_a_familys_tires_are_judged_by_the_others_and_never_by_their_own() -> None:
    """What a family alone shows, its own tires would excuse: a user's tire is of no family."""
    own = family(40, 3, "wide")
    scale = np.where(np.arange(own.draws.shape[1]) == 0, 20.0, 1.0)
    square = np.where(np.arange(own.squares.shape[1]) == 0, 400.0, 1.0)
    wide = replace(own, draws=scale * own.draws, squares=square * own.squares)
    found, swell = plain((FAMILIES[0], wide)), 0
    assert found.null.names[swell] == "swell"
    assert found.null.usual[1][swell] > 3.0
    assert np.median(found.plain[1]) > np.median(found.plain[0])


def test_the_limit_is_where_the_p_value_falls_to_the_level() -> None:
    found = plain(FAMILIES)
    limit = found.limit(0.05)
    assert found.p_of(float(np.nextafter(limit, np.inf)))[0] <= 0.05
    assert found.p_of(0.5 * limit)[0] > 0.05


def test_the_free_belt_has_a_size_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """What shows away from the contact only is as likely as what shows everywhere."""

    class Belt(Toy):
        def remainder(self, point: Any, solved: Any) -> dict[str, FloatArray]:
            return {"smooth, contact": self.shapes, "smooth, free belt": self.there}

    def belt(each: Family) -> Family:
        """Return a family with as much on the free belt as in the contact."""
        n = each.blocks["smooth, all"]
        names = [*list(each.blocks)[:-2], "smooth, contact", "smooth, free belt"]
        blocks = dict(zip(names, [1, 1, 1, n, n], strict=True))
        squares = np.concatenate([each.squares[:, :-1], each.squares[:, -2:-1]], axis=1)
        return replace(each, blocks=blocks, squares=squares)

    def judged_by(families: tuple[Family, ...]) -> Hypothesis:
        random = np.random.default_rng(2)
        toy = Belt(random.standard_normal(N))
        shown = np.sqrt(families[0].shown()["smooth, free belt"])
        toy.measured = toy.measured + 1.8 * shown * random.standard_normal(SHAPES) @ toy.there
        fit = posterior(toy, (), families[0].shown(), toy.whitener(0.001))
        return judged(toy, fit, families, 0.05, own_effects=0)

    families = tuple(belt(each) for each in FAMILIES)
    apart = judged_by(families)
    assert apart.null.size.free == 2.0 * apart.null.size.whole
    monkeypatch.setattr(size, "APART", (1.0,))
    together = judged_by(families)
    assert together.null.size.free == together.null.size.whole
    assert together.likelihood < apart.likelihood
    assert together.scores["smooth, free belt"] >= apart.scores["smooth, free belt"]


def test_what_a_tire_shows_at_least_does_not_depend_on_the_unit_of_a_strength() -> None:
    """With strengths in other units, rows and what is shown change, and the strain does not."""
    family, sizes = FAMILIES[0], {"a": 2.0, "b": 1.0, "smooth, all": 0.5}
    blocks = {"a": 1, "b": 1, "smooth, all": 2}
    shown = replace(family, blocks=blocks, squares=np.array([[1e-8, 4e-4, 1e-6]]))
    other = replace(shown, squares=shown.squares * np.array([9.0, 1.0, 1.0]))
    usual = shown.spread(sizes)
    turned = other.spread({**sizes, "a": sizes["a"] / 9.0})
    assert turned["a"] == pytest.approx(9.0 * usual["a"])
    assert turned["b"] == pytest.approx(usual["b"])
    # a quarter of what all show on the average; the family does not know the user's own effect
    least = 0.25**2 * float(np.mean([2.0 * 1e-8, 4e-4, 0.5 * 1e-6]))
    at_least = shown.spread({**sizes, "own": 3.0})
    assert at_least["b"] == 4e-4
    assert 2.0 * at_least["a"] == pytest.approx(least)
    assert 3.0 * at_least["own"] == pytest.approx(least)


def test_a_test_about_other_rows_holds_scores_against_the_same_plain_tires() -> None:
    found = plain((FAMILIES[0], LOUD)).null
    assert found.usual[1].max() > 1.2
    assert found.about(found.view).scores == pytest.approx(found.scores)


def shown_always(bend: float) -> null.Null:
    """Return a toy tire in a family that always bends by 1.5 ranges and shows little else."""
    squares = 1e-8 * np.ones_like(FAMILIES[0].squares)
    bent = replace(FAMILIES[0], squares=squares, means={"bend": 1.5})
    toy = Toy(drawn(np.random.default_rng(2), size=0.0, bend=bend))
    fit = posterior(toy, (), bent.shown(), toy.whitener(0.001))
    return null.Null(fit.views(toy, [0.001])[0], bent, bent.shown(), {}, {})


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_a_tire_that_shows_a_multiple_of_its_familys_mean_has_that_size(factor: float) -> None:
    """And what explains it is that multiple, though the family hardly varies."""
    found = shown_always(1.5 * factor)
    assert found.size.whole == factor
    place = found.view.normal.blocks["bend"].start
    assert found.explained()[place] == pytest.approx(1.5 * factor, abs=1e-3)
