"""A hypothesis whose law may cover a further effect gives way to both, if both are likelier."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import EFFECTS, N, Toy, by_effect, drawn, family
from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics import hypotheses
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.law_errors import LAWS
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.select import select

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))
LOUD = 30.0
"""By how much the effects are louder than those of the other toys."""
COVERED = 0.06
"""Strength of an effect that the error of the twist's law may show, in ranges."""


WAYS = 30
"""In how many ways a law may be off."""


class Loud(Toy):
    """Effects far above the noise, whose laws may be off in many ways, as those of strain are."""

    def __init__(self, measured: FloatArray) -> None:
        super().__init__(measured)
        self.by = {name: LOUD * rows for name, rows in self.by.items()}
        self.ways = LOUD * np.random.default_rng(21).standard_normal((WAYS, N))

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> list[FloatArray]:
        each = by_effect(point, slopes, count)
        return [np.linalg.norm(size) / np.sqrt(WAYS) * self.ways for _, size in each]


def planted(seed: int, *, law: float = 0.0, **ranges: float) -> Loud:
    """Return a tire with effects planted, the twist's law off by a relative deviation."""
    random = np.random.default_rng(seed)
    toy = Loud(drawn(random))
    for name, strength in ranges.items():
        toy.measured = toy.measured + strength * toy.by[name][0]
    one = Point(toy.start.base, (EFFECTS["twist"],), (np.array([EFFECTS["twist"].scale]),))
    (ways,) = toy.roughly(one, None, np.concatenate([toy.base, toy.by["twist"]]), 1)
    toy.measured = toy.measured + law * random.standard_normal(WAYS) @ ways
    return toy


def test_an_effect_that_the_error_of_a_law_may_show_is_named_beside_an_exact_law() -> None:
    found = select(planted(3, twist=1.0, bend=COVERED), FAMILIES)
    assert set(found.sets) == {("twist", "bend")}
    alone = found.hypotheses.at(["twist"])
    assert alone is not None
    # nothing stands out beside the one: the error of its law may look like the other
    assert alone.p_of(alone.statistic)[0] > 0.05
    assert set(alone.rival.split(" and ")) == {"twist", "bend"}
    assert alone.p == alone.p_rival <= 0.05


@pytest.mark.parametrize("kinked", [hypotheses.KINKED, 1e9])
def test_one_effect_more_is_fitted_only_where_it_could_reject_the_hypothesis(
    kinked: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hypotheses, "KINKED", kinked)
    found = select(planted(60, twist=1.0), FAMILIES)
    assert found.sets == (("twist",),)
    alone = found.hypotheses.at(["twist"])
    assert alone is not None
    worth = [found.hypotheses.may_reject(alone, name) for name in ("bend", "swell")]
    assert any(len(h.names) > 1 for h in found.tried) is any(worth) is (kinked > 1e3)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_further_effect_may_promise_enough_where_laws_do_not_look_like_it(share: float) -> None:
    among = Hypotheses(planted(3, twist=1.0), FAMILIES)
    alone = among.at(["twist"])
    assert alone is not None
    nothing = dict.fromkeys(among.effects, -np.inf)
    # laws that may look like the further effect cover it; others are 20 nats less likely
    own = alone.likelihood - 20.0
    gained = own + share * (np.log(2 / 0.05) + 20.0) / hypotheses.KINKED
    each = (alone.exact, nothing), (own, {**nothing, "bend": gained}), (alone.likelihood, nothing)
    assert among.may_reject(replace(alone, promises=each), "bend") is (share > 1.0)


@pytest.mark.parametrize("law", [0.0, LAWS[0]])
def test_a_true_hypothesis_seldom_gives_way_to_one_effect_more(law: float) -> None:
    found = [select(planted(60 + seed, law=law, twist=1.0), FAMILIES).sets for seed in range(8)]
    assert sum(each != (("twist",),) for each in found) <= 2  # upper 99 % bound of 5 % of 8


def twist_and_bend(among: Hypotheses) -> tuple[Hypothesis, Hypothesis]:
    """Return the hypothesis of the twist, and that of the twist and the bend."""
    alone, both = among.at(["twist"]), among.at(["twist", "bend"])
    assert alone is not None
    assert both is not None
    return alone, both


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_one_effect_more_is_not_there_if_plain_tires_show_as_much_of_it(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    among = Hypotheses(planted(3, twist=1.0, bend=COVERED), FAMILIES)
    alone, both = twist_and_bend(among)
    assert among.against_larger(alone).rival
    further = both.names.index("bend")
    # it is one of three that might be there
    monkeypatch.setattr(
        Hypothesis, "p_plain", lambda _, k: share * 0.05 / 3 if k == further else 0.0
    )
    assert bool(among.against_larger(alone).rival) is (share < 1.0)


@pytest.mark.parametrize("share", [0.99, 1.01])
@pytest.mark.parametrize("others", ["exact", "roughly right"])
def test_an_effect_counts_only_if_its_exact_law_makes_the_runs_likelier(
    others: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    among = Hypotheses(planted(3, twist=1.0), FAMILIES)
    alone, both = twist_and_bend(among)
    monkeypatch.setattr(Hypothesis, "p_plain", lambda *_: 0.0)
    # the likelihood ratio is that of one of three effects at five percent; the hypothesis with
    # "bend" alone was not fitted, and "twist" is not weighed
    odds, further = share * np.log(3 / 0.05), both.names.index("bend")
    exact = alone.unnamed_exact + (odds if others == "exact" else 0.0)
    own = alone.unnamed + (odds if others == "roughly right" else 0.0)
    likelier = [own if k == further else 0.0 for k in range(2)]
    each = replace(both, unnamed_exact=exact, exact_in=tuple(likelier))
    assert among.explains(each) is (share > 1.0)


@pytest.mark.parametrize("ahead", [-0.01, 0.01])
def test_a_single_effect_counts_if_its_exact_law_makes_the_runs_likelier_at_all(
    ahead: float,
) -> None:
    """That nothing is missing is rejected already."""
    among = Hypotheses(planted(3, twist=1.0), FAMILIES)
    alone, _ = twist_and_bend(among)
    assert among.explains(alone)
    (_, further), *off = alone.promises
    likelier = replace(alone, promises=((among.base.exact + ahead, further), *off))
    assert among.explains(likelier) is (ahead > 0.0)


def test_what_only_errors_of_laws_explain_is_neither_a_member_nor_a_rival(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    toy = planted(3, twist=1.0)
    assert select(toy, FAMILIES).sets == (("twist",),)
    told = Hypotheses.explains
    monkeypatch.setattr(
        Hypotheses, "explains", lambda self, h: "twist" not in h.names and told(self, h)
    )
    assert not any("twist" in names for names in select(toy, FAMILIES).sets)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_one_effect_more_has_to_be_likelier_than_something_without_a_name(share: float) -> None:
    among = Hypotheses(planted(3, twist=1.0, bend=COVERED), FAMILIES)
    alone, both = twist_and_bend(among)
    # two effects may be the further one beside "twist"
    likely = alone.unnamed + share * np.log(2 / 0.05)
    among._made[frozenset(both.names)] = replace(both, unnamed=likely)
    assert bool(among.against_larger(alone).rival) is (share > 1.0)


def test_one_effect_more_is_not_there_if_its_exact_law_explains_nothing() -> None:
    among = Hypotheses(planted(3, twist=1.0, bend=COVERED), FAMILIES)
    alone, both = twist_and_bend(among)
    assert among.against_larger(alone).rival
    nothing = replace(both, unnamed_exact=alone.unnamed_exact, exact_in=(alone.unnamed,) * 2)
    among._made[frozenset(both.names)] = nothing
    assert among.against_larger(alone) is alone


def test_one_effect_more_is_not_there_if_it_is_out_of_its_range() -> None:
    among = Hypotheses(planted(3, twist=1.0, bend=COVERED), FAMILIES)
    alone, both = twist_and_bend(among)
    assert among.against_larger(alone).rival
    among._made[frozenset(both.names)] = replace(both, plausible=False)
    assert among.against_larger(alone) is alone
