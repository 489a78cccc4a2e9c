"""By how much laws are off: what is allowed for is what makes the runs likelier."""

import numpy as np
import pytest

from tests.unit.inference.statistics.linear_problem import N, family
from tests.unit.inference.statistics.test_larger import WAYS, Loud, planted
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.law_errors import LAWS, Likelihoods, law_errors
from tirelib.inference.statistics.null import OWN
from tirelib.inference.statistics.problem import Whitening
from tirelib.inference.statistics.views import Views

FAMILIES = (family(40, 1, "first"), family(40, 2, "second"))


def hypothesis(toy: Loud, *names: str) -> tuple[Hypothesis, Likelihoods, Hypotheses]:
    among = Hypotheses(toy, FAMILIES)
    found = among.at(names)
    assert found is not None
    likelihoods = Likelihoods(found.fit, FAMILIES, found.fit.views(among.problem, OWN))
    return found, likelihoods, among


@pytest.mark.parametrize(("also", "allowed"), [(0.0, False), (0.08, True)])
def test_a_law_may_look_like_another_effect_where_that_is_likelier(
    also: float, *, allowed: bool
) -> None:
    found, _, _ = hypothesis(planted(5, law=LAWS[1], twist=1.0, bend=also), "twist")
    assert any(found.errors.laws)
    assert bool(found.errors.lookalike) is allowed


def test_an_exact_law_looks_like_nothing_else() -> None:
    found, likelihoods, _ = hypothesis(planted(5, twist=1.0), "twist")
    assert law_errors(found.fit, likelihoods.exact) == {}
    one = likelihoods.alike[0].but(0, 0.0, found.fit.lookalike)
    assert law_errors(found.fit, one) == {}


def test_what_looks_like_another_effect_goes_with_what_the_rough_laws_do() -> None:
    found, likelihoods, _ = hypothesis(planted(5, twist=1.0, swell=1.0), "twist", "swell")
    share = found.fit.lookalike
    both = likelihoods.loosest
    whole = float(law_errors(found.fit, both)["bend"])
    parts = [float(law_errors(found.fit, both.but(k, 0.0, share))["bend"]) for k in range(2)]
    assert sum(parts) == pytest.approx(whole)
    assert min(parts) > 0.1 * whole
    double = law_errors(found.fit, both._replace(lookalike=2.0 * share))["bend"]
    assert double == pytest.approx(4.0 * whole)


def test_what_is_seen_of_an_effect_is_what_neither_base_nor_shapes_can_take() -> None:
    found, _, among = hypothesis(planted(5, twist=1.0), "twist")
    fit, whiten = found.fit, among.problem.whitener(among.own)
    first = len(fit.point.base)
    shapes = [name for name in fit.rows if "," in name]
    assert shapes
    rows = whiten(np.concatenate([fit.rows["base"][:first], *(fit.rows[k] for k in shapes)]))
    variance = [fit.widths[:first] ** 2]
    variance += [np.full(len(fit.rows[name]), among.spread[name]) for name in shapes]
    inner = np.linalg.inv(rows @ rows.T + np.diag(1.0 / np.concatenate(variance)))
    (size,) = fit.point.ranges[0]
    effects = {"twist": size * fit.rows["base"][first], "bend": fit.rows["bend"][0]}
    for name, effect in effects.items():
        white = whiten(effect[None])[0]
        taken = rows @ white
        assert fit.seen[name] == pytest.approx(white @ white - taken @ inner @ taken, rel=1e-5)


def test_the_likeliest_errors_are_as_likely_as_any_others() -> None:
    for law in (0.0, *LAWS):
        _, found, _ = hypothesis(planted(9, law=law, twist=1.0, swell=1.0), "twist", "swell")
        best = found.of(found.likeliest)
        assert best >= max(found.of(each) for each in (*found.alike, found.exact, found.loosest))
        uneven = found.likeliest.but(1, LAWS[2], 0.0)
        assert best >= found.of(uneven) - 1e-9


def test_one_exact_law_beside_rough_ones_is_between_all_exact_and_all_rough() -> None:
    found, likelihoods, _ = hypothesis(
        planted(9, law=LAWS[1], twist=1.0, swell=1.0), "twist", "swell"
    )
    exact = likelihoods.unnamed(likelihoods.exact)
    # the law of the twist is off, and that of the swell may be off in the same ways
    assert exact + 10.0 < min(found.exact_in)
    assert max(found.exact_in) <= found.unnamed + 1e-9


def test_a_law_whose_errors_explain_all_and_which_itself_explains_nothing_is_not_supported() -> (
    None
):
    random = np.random.default_rng(3)
    true, _, among = hypothesis(planted(4, twist=1.0), "twist")
    assert among.supported(true)
    assert among.supported(among.base)
    toy = planted(4)
    toy.measured = toy.measured + 2.0 / np.sqrt(WAYS) * random.standard_normal(WAYS) @ toy.ways
    wrong, _, among = hypothesis(toy, "twist")
    assert wrong.likelihood > wrong.exact + 20.0
    assert not among.supported(wrong)


@pytest.mark.parametrize("misfit", [0.0, 3.0, 30.0])
def test_the_likeliest_size_of_a_misfit_is_found_without_trying_all(misfit: float) -> None:
    toy = planted(5, twist=1.0)
    toy.measured = toy.measured + misfit * np.random.default_rng(1).standard_normal(N)
    found, likelihoods, among = hypothesis(toy, "twist")
    views = found.fit.views(among.problem, OWN)
    sizes = [view.own for view in views]
    by_size = [likelihoods._best([view], likelihoods.exact)[0].view.own for view in views]
    assert by_size == sizes == list(OWN)
    every = [
        max(null.likelihood for null in likelihoods._best([view], likelihoods.exact))
        for view in views
    ]
    best = likelihoods._best(views, likelihoods.exact)[0].view.own
    assert best == OWN[int(np.argmax(every))]


def test_normal_equations_are_made_once_and_only_where_they_are_asked_for() -> None:
    found, _, among = hypothesis(planted(5, twist=1.0), "twist")
    asked: list[float] = []

    def whitener(own: float) -> Whitening:
        asked.append(own)
        return among.problem.whitener(own)

    views = Views(found.fit.rows, found.fit.rest, whitener, OWN)
    assert not asked
    assert views[3] is views[3]
    assert sorted(asked) == [OWN[0], OWN[3]]  # what no size changes, and the one
    assert [view.own for view in views[2:5]] == list(OWN[2:5])
    assert len(views) == len(OWN)
