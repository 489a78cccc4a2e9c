"""The confidence set on a linear problem whose truth is known."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import SHAPES, N, Solved, Toy, drawn, family
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.inference.statistics.hypotheses import Hypotheses, _apart
from tirelib.inference.statistics.hypothesis import Hypothesis, judged
from tirelib.inference.statistics.posterior import Posterior, posterior
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.select import _further, select

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))


def test_plain_tires_are_seldom_said_to_lack_something() -> None:
    random = np.random.default_rng(5)
    kinds = [select(Toy(drawn(random)), FAMILIES).kind for _ in range(40)]
    # 5 % wanted; 5 of 40 is the upper 98 % bound of a binomial
    assert sum(kind != "none" for kind in kinds) <= 5


def test_p_values_of_plain_tires_lie_under_the_diagonal() -> None:
    random = np.random.default_rng(6)
    spread = FAMILIES[0].shown()
    p = []
    for _ in range(60):
        toy = Toy(drawn(random))
        fit = posterior(toy, (), spread, toy.whitener(0.001))
        p.append(judged(toy, fit, FAMILIES, 0.05, own_effects=0).p)
    for level in (0.05, 0.1, 0.2, 0.5):
        share = np.mean(np.array(p) <= level)
        assert share <= level + 2.5 * np.sqrt(level * (1.0 - level) / len(p))


def test_a_probability_that_so_few_tires_cannot_tell_is_refused() -> None:
    with pytest.raises(
        ParameterError, match=r"0\.01: with 40 plain tires .* can be had is 0\.0244"
    ):
        select(Toy(np.zeros(N)), FAMILIES, false_alarm=0.01)


@pytest.mark.parametrize("name", ["swell", "bend", "twist"])
def test_what_is_hidden_is_named_with_its_strength(name: str) -> None:
    random = np.random.default_rng(8)
    right = 0
    for _ in range(12):
        found = select(Toy(drawn(random, **{name: 0.6})), FAMILIES)
        right += found.sets == ((name,),)
        if found.sets == ((name,),):
            strength = found.best.fit.point.strengths[0] / 2.0
            assert strength == pytest.approx(0.6, abs=0.3)
    assert right >= 10  # 11 expected: a true hypothesis is rejected with at most 5 %


def test_what_does_nothing_to_the_model_is_at_a_right_angle_to_all() -> None:
    toy = Toy(drawn(np.random.default_rng(9)), alike=True)
    toy.by["swell"] = np.zeros((1, N))
    null = Hypotheses(toy, FAMILIES).base.null
    assert null.angle("swell", "twist") == null.angle("twist", "swell") == np.pi / 2.0
    assert null.angle("bend", "twist") < 1e-3


def test_two_are_found_together() -> None:
    found = select(Toy(drawn(np.random.default_rng(2), bend=0.6, twist=0.6)), FAMILIES)
    assert {frozenset(names) for names in found.sets} == {frozenset(("bend", "twist"))}


def test_an_effect_as_large_as_plain_tires_show_it_is_not_missing() -> None:
    random, larger = np.random.default_rng(3), []
    for _ in range(40):
        hypotheses = Hypotheses(Toy(drawn(random, bend=0.6)), FAMILIES)
        alone, both = hypotheses.at(("bend",)), hypotheses.at(("bend", "twist"))
        assert alone is not None
        assert both is not None
        assert hypotheses.explains(alone)
        larger.append(both.p_plain(both.names.index("twist")) <= 0.05)
        assert not hypotheses.explains(both)
    # 5 % wanted; 5 of 40 is the upper 98 % bound of a binomial
    assert sum(larger) <= 5
    plain = Hypotheses(Toy(drawn(random)), FAMILIES)
    twist = plain.at(("twist",))
    assert twist is not None
    assert not plain.explains(twist)


def test_what_looks_alike_is_a_set() -> None:
    measured = drawn(np.random.default_rng(4))
    toy = Toy(measured, alike=True)
    toy.measured = measured + 0.6 * toy.by["twist"][0]
    found = select(toy, FAMILIES)
    assert found.kind == "indistinguishable"
    assert {"bend", "twist"} <= {name for names in found.sets for name in names}


def test_what_no_effect_explains_is_unknown() -> None:
    random = np.random.default_rng(9)
    strange = Toy(np.zeros(N)).there[2] * 6.0
    assert select(Toy(drawn(random) + strange), FAMILIES).kind == "unknown"


def test_a_strength_outside_its_range_is_not_named() -> None:
    found = select(Toy(drawn(np.random.default_rng(3), twist=-0.6)), FAMILIES)
    assert ("twist",) not in found.sets
    assert found.kind == "unknown"


def test_a_set_is_listed_once_whichever_effect_led_to_it() -> None:
    found = select(Toy(drawn(np.random.default_rng(2), bend=0.6, twist=0.6)), FAMILIES)
    assert len(found.sets) == len({frozenset(names) for names in found.sets})


def test_tires_that_leave_twice_as_much_of_everything_are_plain_too() -> None:
    random = np.random.default_rng(12)
    kinds = [select(Toy(drawn(random, size=2.0)), FAMILIES).kind for _ in range(25)]
    # 5 % wanted; 4 of 25 is the upper 99 % bound of a binomial
    assert sum(kind != "none" for kind in kinds) <= 4


def test_a_tire_that_leaves_little_shows_less_of_an_effect_sooner() -> None:
    found = {}
    for size in (0.2, 1.0):
        random = np.random.default_rng(13)
        verdicts = [select(Toy(drawn(random, size=size, swell=0.25)), FAMILIES) for _ in range(12)]
        found[size] = sum(verdict.sets == (("swell",),) for verdict in verdicts)
    assert found[0.2] > found[1.0]


def test_samples_with_more_misfit_of_their_own_hide_nothing() -> None:
    random = np.random.default_rng(14)
    kinds = [
        select(Toy(drawn(random) + 3.0 * random.standard_normal(N)), FAMILIES).kind
        for _ in range(12)
    ]
    assert sum(kind != "none" for kind in kinds) <= 2  # 98 % bound of 5 %


class Rough(Toy):
    """A strong law that is off in the shapes of which plain tires show least."""

    OFF = 0.08

    def __init__(self, measured: FloatArray, *, exact: bool) -> None:
        super().__init__(measured)
        self.by["bend"] = 10.0 * self.by["bend"]
        size = np.linalg.norm(self.by["bend"]) / np.linalg.norm(self.there)
        self.ways = size * self.there
        self.living = tuple(replace(effect, exact=exact) for effect in self.living)

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> list[FloatArray]:
        return [np.linalg.norm(size) * self.ways for size in point.ranges[:count]]


@pytest.mark.parametrize(("share", "named"), [(0.0, {"bend", "twist"}), (0.075, {"bend"})])
def test_a_small_part_of_a_strong_effect_that_looks_like_another_gets_no_name(
    share: float, named: set[str]
) -> None:
    """Its law is only roughly right: a twentieth of what it does may be of another shape."""
    toy = Toy(drawn(np.random.default_rng(2)))
    toy.by["bend"] = 10.0 * toy.by["bend"]
    toy.measured = toy.measured + toy.by["bend"][0] + 0.05 * 10.0 * toy.by["twist"][0]
    toy.lookalike = share
    found = select(toy, FAMILIES)
    assert {frozenset(names) for names in found.sets} == {frozenset(named)}


class Uneven(Toy):
    """Two strong effects, each with errors of its own law that look like nothing else."""

    def __init__(self, measured: FloatArray) -> None:
        super().__init__(measured)
        random = np.random.default_rng(41)
        self.by = {name: 10.0 * rows for name, rows in self.by.items()}
        self.ways = {name: random.standard_normal((8, N)) for name in self.by}

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> list[FloatArray]:
        effects = point.effects[:count]
        sizes = [float(np.linalg.norm(size)) for size in point.ranges[:count]]
        return [10.0 * size * self.ways[e.name] for e, size in zip(effects, sizes, strict=True)]


def test_every_law_is_off_by_its_own_share() -> None:
    """One that is not right leaves the error of one that is right small."""
    random = np.random.default_rng(7)
    toy = Uneven(drawn(random))
    done = toy.by["bend"][0] + toy.by["twist"][0]
    toy.measured = toy.measured + done + 3.0 * random.standard_normal(8) @ toy.ways["bend"]
    both = Hypotheses(toy, FAMILIES).at(["bend", "twist"])
    assert both is not None
    bend, twist = both.errors.laws
    assert bend >= 0.1
    assert twist == 0.0  # exact


def test_a_law_that_is_a_definition_has_no_error() -> None:
    named = {}
    for exact in (False, True):
        random = np.random.default_rng(32)
        toy = Rough(drawn(random), exact=exact)
        off = Rough.OFF * random.standard_normal(SHAPES) @ toy.ways
        toy.measured = toy.measured + 0.8 * (toy.by["bend"][0] + off)
        named[exact] = select(toy, FAMILIES).sets
    assert named[False] == (("bend",),)
    assert named[True] == ()  # it may not be off, and nothing else explains what it leaves


def reject_all(monkeypatch: pytest.MonkeyPatch, *, unless_loose: int) -> None:
    """Reject every hypothesis, one of so many effects only unless its laws are loose."""
    tested = Hypotheses._tested

    def rejected(self: Hypotheses, problem: Any, fit: Posterior) -> Hypothesis:
        h = tested(self, problem, fit)
        loose = len(fit.effects) == unless_loose
        return replace(h, p_rival=0.0, looseness=10.0 / 3.0 if loose else np.inf)

    monkeypatch.setattr(Hypotheses, "_tested", rejected)


@pytest.mark.parametrize(("twist", "kind"), [(0.0, "unknown"), (0.6, "form_inadequate")])
def test_where_no_law_is_right_effects_that_are_all_larger_than_on_plain_tires_are_named(
    monkeypatch: pytest.MonkeyPatch, twist: float, kind: str
) -> None:
    reject_all(monkeypatch, unless_loose=2)
    found = select(Toy(drawn(np.random.default_rng(2), bend=0.6, twist=twist)), FAMILIES)
    assert found.kind == kind
    assert [set(names) for names in found.sets] == [{"bend", "twist"}] * (kind != "unknown")


@pytest.mark.parametrize(("bend", "sets"), [(0.6, (("bend",),)), (0.0, ())])
def test_of_many_effects_whose_laws_are_all_wrong_those_that_plain_tires_show_are_not_told(
    monkeypatch: pytest.MonkeyPatch, bend: float, sets: tuple[tuple[str, ...], ...]
) -> None:
    reject_all(monkeypatch, unless_loose=3)
    found = select(Toy(drawn(np.random.default_rng(2), bend=bend)), FAMILIES, many=True)
    assert found.kind == ("form_inadequate" if sets else "unknown")
    assert found.sets == sets


@pytest.mark.parametrize(("least", "kind"), [(1, "unknown"), (2, "form_inadequate")])
def test_more_effects_that_are_not_likelier_do_not_show_that_they_are_there(
    monkeypatch: pytest.MonkeyPatch, least: int, kind: str
) -> None:
    """Fewer effects, with something that has no name, explain the runs as well."""
    toy = Toy(drawn(np.random.default_rng(2), bend=0.6, twist=0.6 * (least - 1)))
    tested = Hypotheses._tested

    def dearer(self: Hypotheses, problem: Any, fit: Posterior) -> Hypothesis:
        """Return a hypothesis of so many effects as one that explains all, but is less likely."""
        h = tested(self, problem, fit)
        if len(fit.effects) < least:
            return h
        return replace(h, likelihood=h.likelihood - 1e4, unnamed=h.unnamed - 1e4)

    named = select(toy, FAMILIES)
    assert named.kind == "named"
    assert len(named.sets[0]) == least
    monkeypatch.setattr(Hypotheses, "_tested", dearer)
    found = select(toy, FAMILIES)
    assert found.kind == kind
    if least == 2:
        ((name,),) = found.sets
        one = max((h for h in found.tried if len(h.names) == 1), key=lambda h: h.likelihood)
        assert one.names == (name,)


def test_a_hypothesis_is_as_likely_as_with_laws_that_are_exact() -> None:
    toy = Rough(drawn(np.random.default_rng(32)), exact=False)
    exact = Rough(drawn(np.random.default_rng(32)), exact=True)
    for each in (toy, exact):
        each.measured = each.measured + 0.8 * each.by["bend"][0]
    found = [Hypotheses(problem, FAMILIES).at(["bend"]) for problem in (toy, exact)]
    roughly, exactly = (h.likelihood for h in found if h is not None)
    assert roughly == pytest.approx(exactly, abs=0.1)


class Costly(Toy):
    """A strong law that may be off in many ways, one of which is a group of smooth shapes."""

    def __init__(self, measured: FloatArray, *, exact: bool) -> None:
        super().__init__(measured)
        self.by["bend"] = 10.0 * self.by["bend"]
        ways = np.random.default_rng(5).standard_normal((40, N)) / 5.0
        self.ways = 10.0 * np.concatenate([self.shapes, ways])
        self.living = tuple(replace(effect, exact=exact) for effect in self.living)

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> list[FloatArray]:
        return [np.linalg.norm(size) * self.ways for size in point.ranges[:count]]


def test_something_without_a_name_may_stand_beside_exact_laws() -> None:
    """It is no less likely beside a law that may be off, which could be exact as well."""
    found = []
    for exact in (False, True):
        toy = Costly(drawn(np.random.default_rng(32)), exact=exact)
        toy.measured = toy.measured + toy.by["bend"][0] + 6.0 * toy.shapes[0]
        found.append(Hypotheses(toy, FAMILIES).at(["bend"]))
    roughly, exactly = (h.unnamed for h in found if h is not None)
    assert roughly >= exactly - 0.1


class Valleys(Toy):
    """The first number of the base acts as z^3 - 3 z: from below a fit ends at z = -1."""

    def __init__(self, *starts: float) -> None:
        super().__init__(np.zeros(N))
        self.measured = drawn(np.random.default_rng(5)) + 12.0 * self.base[0]
        self.starts = tuple(Point(np.array([z, 0.0, 0.0])) for z in starts)
        self.start = self.starts[0]

    def solve(self, point: Point, near: Any = None) -> Solved:
        z = float(point.base[0])
        bent = np.array([z**3 - 3.0 * z, *point.base[1:]])
        return super().solve(replace(point, base=bent), near)

    def slopes(self, point: Point, solved: Any, *, near: bool = False) -> FloatArray:
        out = super().slopes(point, solved, near=near)
        out[0] *= 3.0 * point.base[0] ** 2 - 3.0
        return out


@pytest.mark.parametrize("starts", [(-1.5, 2.0), (2.0, -1.5)])
def test_the_base_is_the_best_fit_of_those_from_all_starts(starts: tuple[float, float]) -> None:
    stuck = Hypotheses(Valleys(-1.5), FAMILIES).base.fit
    best = Hypotheses(Valleys(*starts), FAMILIES).base.fit
    # z^3 - 3 z is 12 near 2.7; below zero it is at most 2, at z = -1
    assert stuck.point.base[0] == pytest.approx(-1.0, abs=0.1)
    assert best.point.base[0] == pytest.approx(2.71, abs=0.1)
    assert best.cost < 0.1 * stuck.cost


class Parted(Valleys):
    """Has a part in which fits begin: its own start stands in the valley of the best fit."""

    def __init__(self, *, solved: bool) -> None:
        super().__init__(-1.5)
        self.solved = solved
        self.began: list[float] = []

    def thinned(self) -> Toy:
        part = Valleys(-1.5)
        if not self.solved:
            part.solve = refuse  # type: ignore[method-assign]
        part.measured = part.measured - 14.0 * part.base[0]
        return part

    def solve(self, point: Point, near: Any = None) -> Solved:
        self.began.append(float(point.base[0]))
        return super().solve(point, near)


def refuse(point: Point, near: Any = None) -> Solved:
    raise ParameterError("the part: no solution; use the whole")


@pytest.mark.parametrize("solved", [True, False])
def test_a_fit_begins_where_that_of_a_part_ended(solved: bool) -> None:
    whole = Parted(solved=solved)
    Hypotheses(whole, FAMILIES)
    # z^3 - 3 z is -2 for the part, at z = -2
    first = next(z for z in whole.began[1:] if z != whole.began[0]) if solved else whole.began[1]
    assert first == pytest.approx(-2.0 if solved else -1.5, abs=0.1)


class Followed(Valleys):
    """A problem whose whitening follows the model."""

    def about(self, solved: Any) -> Toy:
        there = getattr(self, "there", self.measured)
        if np.abs(solved.rest - there).max() < 0.1:
            return self
        out = Followed(*(point.base[0] for point in self.starts))
        out.there = solved.rest
        return out


def test_starts_that_end_in_one_model_go_on_as_one() -> None:
    toy = Followed(2.0, -1.5, 3.0)
    spread = FAMILIES[0].shown()
    fits = [posterior(toy, (), spread, toy.whitener(0.001), start=start) for start in toy.starts]
    best, stuck = _apart(toy, toy.starts, fits)
    assert best.base[0] == pytest.approx(2.71, abs=0.1)
    assert stuck.base[0] == pytest.approx(-1.0, abs=0.1)
    # a start from which the part does not settle is tried on the whole
    assert _apart(toy, toy.starts, [fits[0], None, fits[2]])[1] is toy.starts[1]


def leading(
    scores: dict[str, float], *, exact: dict[str, float], rough: dict[str, float] | None = None
) -> Any:
    """Return a hypothesis beside which effects have these scores and gain so much, [nats]."""
    gained = {name: 100.0 + gain for name, gain in (rough or dict.fromkeys(exact, 1.0)).items()}
    null = SimpleNamespace(
        names=list(exact),
        left=lambda names: dict.fromkeys(names, 6.0),
        likelihood=100.0,
        gained=gained,
    )
    further = {name: 50.0 + gain for name, gain in exact.items()}
    promises = (50.0, further), (100.0, gained)
    return SimpleNamespace(null=null, scores=scores, exact=50.0, further=further, promises=promises)


def test_effects_that_stand_out_are_tried_though_all_leave_the_same() -> None:
    """A shape that no effect explains to first order leaves its own score beside every effect."""
    scores = {"a": 0.1, "b": 0.0, "c": 0.2, "d": 3.7, "e": 5.7, "shape": 6.0}
    leader = leading(scores, exact={**dict.fromkeys("acde", 0.4), "b": 3.0})
    effects: Any = dict.fromkeys("abcde")
    assert _further(leader, effects, 1) == ["e"]
    # one that the error of a law hides is the likeliest with an exact law
    assert _further(leader, effects, 2) == ["e", "b"]
    assert {"d", "b", "e"} <= set(_further(leader, effects, 4))
    assert set(_further(leader, effects, 9)) == set("abcde")


def test_an_effect_is_not_fitted_that_promises_little_beside_another() -> None:
    scores = {"a": 9.0, "b": 8.0, "c": 3.0, "d": 2.0, "e": 1.0}
    effects: Any = dict.fromkeys("abcde")
    gains = {"a": 400.0, "b": 41.0, "c": 39.0, "d": 5.0, "e": -60.0}
    leader = leading(scores, exact=gains, rough=gains)
    assert _further(leader, effects, 5) == ["a", "b"]
    # the error of a law hides one, another one fits the error of a law
    leader = leading(scores, exact={**gains, "c": 700.0}, rough={**gains, "d": 300.0})
    assert set(_further(leader, effects, 5)) == {"a", "c", "d", "b"}
    # none gains to first order
    leader = leading(scores, exact=dict.fromkeys("abcde", -3.0), rough=dict.fromkeys("abcde", -3.0))
    assert set(_further(leader, effects, 5)) == set("abcde")


@pytest.mark.parametrize(("start", "tried"), [((0.5,), True), ((), False)])
def test_an_effect_that_states_a_start_is_tried_whatever_it_does_at_zero(
    start: tuple[float, ...], tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One hypothesis of one effect is fitted, that which stands out; and this one."""
    monkeypatch.setattr("tirelib.inference.statistics.select.SINGLES", 1)
    toy = Toy(drawn(np.random.default_rng(8), swell=0.6))
    toy.living = (*toy.living[:2], replace(toy.living[2], start=start))
    found = select(toy, FAMILIES)
    assert found.sets == (("swell",),)
    assert (("twist",) in [h.names for h in found.tried]) is tried


@pytest.mark.parametrize("strength", [0.2, 0.6])
def test_where_all_is_linear_a_fit_gains_what_the_effect_promised(strength: float) -> None:
    """The gain to first order is that of a fit, up to what plain tires show of the effect.

    An effect that is not fitted may show what plain tires show in addition; a fitted one may not.
    """
    toy = Toy(drawn(np.random.default_rng(8), swell=strength))
    hypotheses = Hypotheses(toy, FAMILIES)
    base = hypotheses.base
    for name in ("swell", "bend"):
        alone = hypotheses.at([name])
        assert alone is not None
        assert alone.exact - base.exact == pytest.approx(base.gain(name), abs=0.5)
