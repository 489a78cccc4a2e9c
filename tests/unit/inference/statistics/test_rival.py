"""A rival that explains the runs much better puts a hypothesis out of the set."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import EFFECTS, N, Toy, by_effect, drawn, family
from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.law_errors import LAWS
from tirelib.inference.statistics.posterior import Posterior
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.rival import _likelihood, p_against
from tirelib.inference.statistics.select import select

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))
LAW, WAYS = LAWS[1], 30
STRENGTH = 1.2


class Covered(Toy):
    """A vague law, twist, whose error covers an exact one, bend."""

    def __init__(self, measured: FloatArray) -> None:
        super().__init__(measured)
        random = np.random.default_rng(21)
        self.ways = random.standard_normal((WAYS, N))
        off = 0.6 * LAW * random.standard_normal(WAYS) @ self.ways
        self.by["bend"] = self.by["twist"] + off

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> list[FloatArray]:
        exact = {"swell": 1.0, "bend": 1e-3, "twist": 1.0}
        whole = float(np.linalg.norm(self.by["twist"]))
        done = [float(np.linalg.norm(r @ own)) for own, r in by_effect(point, slopes, count)]
        return [
            exact[effect.name] * each / whole * self.ways
            for effect, each in zip(point.effects, done, strict=False)
        ]


def planted(name: str, seed: int) -> Covered:
    random = np.random.default_rng(seed)
    toy = Covered(drawn(random))
    done = STRENGTH * toy.by[name][0]
    one = Point(toy.start.base, (EFFECTS[name],), (np.array([EFFECTS[name].scale]),))
    slopes = np.concatenate([toy.base, STRENGTH * toy.by[name]])
    (ways,) = toy.roughly(one, None, slopes, 1)
    toy.measured = toy.measured + done + LAW * random.standard_normal(WAYS) @ ways
    return toy


def test_an_exact_law_puts_a_vague_one_that_covers_it_out_of_the_set() -> None:
    found = select(planted("bend", 3), FAMILIES)
    assert found.sets == (("bend",),)
    covered = found.hypotheses.at(["twist"])
    assert covered is not None
    # the vague law passes the test by itself; only the likelihood ratio of its rival rejects it
    assert covered.p_of(covered.statistic)[0] > 0.05
    assert covered.rival == "bend"
    assert covered.p == covered.p_rival <= 0.05


def test_a_true_hypothesis_is_seldom_put_out_by_a_rival() -> None:
    out = 0
    for seed in range(16):
        among = Hypotheses(planted("twist", 40 + seed), FAMILIES)
        true, rival = among.at(["twist"]), among.at(["bend"])
        assert true is not None
        assert rival is not None
        out += p_against(among.problem, true, rival) <= 0.05
    assert out <= 3  # the upper 98 % bound of 5 % of 16


def test_a_rival_that_gains_nothing_puts_nothing_out() -> None:
    toy = Toy(drawn(np.random.default_rng(4)), alike=True)
    toy.measured = toy.measured + 0.6 * toy.by["twist"][0]
    among = Hypotheses(toy, FAMILIES)
    one, other = among.at(["twist"]), among.at(["bend"])
    assert one is not None
    assert other is not None
    assert p_against(toy, one, other) > 0.2
    # a family's tires are judged by the others and never by their own
    still = np.zeros((1, N))
    for own in one.nulls:
        others = replace(one, nulls=[each for each in one.nulls if each is not own])
        judged = [_likelihood(toy, each, own.family, still) for each in (one, others)]
        assert judged[0] == judged[1]


def test_a_rival_counts_even_where_it_is_itself_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    tested = Hypotheses._tested

    def rejected(self: Hypotheses, problem: Any, fit: Posterior) -> Hypothesis:
        """Return a hypothesis of the exact law as one that is rejected with all laws."""
        h = tested(self, problem, fit)
        return replace(h, p_rival=0.0, looseness=np.inf) if h.names == ("bend",) else h

    monkeypatch.setattr(Hypotheses, "_tested", rejected)
    found = select(planted("bend", 3), FAMILIES)
    assert ("twist",) not in found.sets
    covered = found.hypotheses.at(["twist"])
    assert covered is not None
    assert covered.rival == "bend"


def test_a_rival_out_of_its_range_puts_nothing_out(monkeypatch: pytest.MonkeyPatch) -> None:
    tested = Hypotheses._tested

    def outside(self: Hypotheses, problem: Any, fit: Posterior) -> Hypothesis:
        """Return a hypothesis of the exact law as one whose strength its range does not allow."""
        h = tested(self, problem, fit)
        return replace(h, plausible=False) if "bend" in h.names else h

    monkeypatch.setattr(Hypotheses, "_tested", outside)
    assert select(planted("bend", 3), FAMILIES).sets == (("twist",),)


def test_only_the_laws_that_plain_tires_are_weighed_by_count_against_a_hypothesis() -> None:
    """A rival that another law makes likelier gains nothing by the law that it stays with."""
    toy = Toy(drawn(np.random.default_rng(4)), alike=True)
    toy.measured = toy.measured + 0.6 * toy.by["twist"][0]
    among = Hypotheses(toy, FAMILIES)
    one, other = among.at(["twist"]), among.at(["bend"])
    assert one is not None
    assert other is not None
    likelier = replace(other, likelihood=other.likelihood + 60.0)
    assert p_against(toy, one, likelier) > 0.2
