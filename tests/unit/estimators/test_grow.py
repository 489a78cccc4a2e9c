"""Families of terms are taken up where they help with what was not seen, and only there."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tirelib.estimators import basis
from tirelib.estimators.fit import design_for, inner_levels
from tirelib.estimators.grow import Errors, grow, held_out_errors
from tirelib.estimators.regressors import ODD, SHAPE
from tirelib.estimators.ridge import Ridge

N = 60
ODD_HERE = ("slope",)


def values(seed: int = 1) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    names = ("angle", "bow", "slope", "noise_1", "noise_2", "noise_3")
    return {name: rng.uniform(-1.0, 1.0, N) for name in names}


BASE: list[basis.Powers] = [{}, {"angle": 1}]
FAMILIES: dict[str, list[basis.Powers]] = {
    "bow": [{"bow": 1}, {"bow": 1, "angle": 1}],
    "slopes": [{"slope": 2}],
    **{f"noise_{k}": [{f"noise_{k}": 1}, {f"noise_{k}": 2}] for k in (1, 2, 3)},
}


def test_a_family_that_carries_the_load_is_taken_up_whole_and_chance_is_not() -> None:
    x = values()
    y = 4.0 + 3.0 * x["angle"] + x["bow"] + 0.5 * x["bow"] * x["angle"] + 0.8 * x["slope"] ** 2
    y = y + 0.05 * np.random.default_rng(2).standard_normal(N)
    grown = grow(x, y, np.arange(N), [BASE], FAMILIES, odd=ODD_HERE)
    assert grown == [*BASE, *FAMILIES["bow"], *FAMILIES["slopes"]]


def test_nothing_is_taken_up_where_the_candidate_says_all() -> None:
    x = values()
    y = 4.0 + 3.0 * x["angle"] + 0.05 * np.random.default_rng(2).standard_normal(N)
    assert grow(x, y, np.arange(N), [BASE], FAMILIES, odd=ODD_HERE) == BASE


def test_terms_stay_below_a_share_of_the_conditions() -> None:
    """Ten rows of each of six conditions say no more than six do."""
    x = values()
    y = 4.0 + 3.0 * x["angle"] + x["bow"]
    few = np.repeat(np.arange(6), 10)
    assert grow(x, y, few, [BASE], FAMILIES, odd=ODD_HERE) == BASE
    assert grow(x, y, np.zeros(N, dtype=np.int64), [BASE], FAMILIES, odd=ODD_HERE) == []


ONE_MORE: list[basis.Powers]
TWO_MORE: list[basis.Powers]
ONE_MORE, TWO_MORE = [{"bow": 1}], [{"noise_1": 1}, {"noise_2": 1}]
BY_SIZE: dict[str, list[basis.Powers]] = {"one": ONE_MORE, "two": TWO_MORE}
LARGER: list[basis.Powers] = [{}, *({"angle": k} for k in range(1, 7))]


@pytest.mark.parametrize(
    ("errors", "wanted"),
    [
        ({2: (1.0, 1.0), 3: (0.96, 0.96), 4: (0.9, 0.98)}, [*BASE, *ONE_MORE]),
        ({2: (1.0, 1.0), 3: (0.96, 0.96), 4: (0.98, 0.9)}, BASE),
        ({2: (1.0, 1.0), 3: (0.98, 0.5), 4: (1.1, 0.9)}, BASE),
        ({2: (1.0, 1.0), 3: (0.5, 0.98), 4: (0.5, 1.2)}, BASE),
        ({2: (1.0, 1.0), 3: (0.9, 0.9), 4: (0.8, 0.8), 5: (0.7, 0.79)}, [*BASE, *TWO_MORE]),
        (
            {2: (1.0, 1.0), 3: (0.9, 0.9), 4: (0.8, 0.8), 5: (0.7, 0.7)},
            [*BASE, *TWO_MORE, *ONE_MORE],
        ),
    ],
)
def test_the_best_family_goes_first_and_both_errors_must_fall(
    monkeypatch: pytest.MonkeyPatch,
    errors: dict[int, tuple[float, float]],
    wanted: list[basis.Powers],
) -> None:
    """Errors by the number of terms; where the best family helps with one error only, none."""
    monkeypatch.setattr(
        "tirelib.estimators.grow.held_out_errors",
        lambda x, *_: Errors(*errors.get(x.shape[1], (9.0, 9.0))),
    )
    x = values()
    assert grow(x, x["angle"], np.arange(N), [BASE], BY_SIZE) == wanted


def test_of_what_has_grown_the_least_error_of_both_questions_wins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors = {2: Errors(0.5, 1.0), 7: Errors(1.0, 0.9)}
    monkeypatch.setattr(
        "tirelib.estimators.grow.held_out_errors",
        lambda x, *_: errors.get(x.shape[1], Errors(9.0, 9.0)),
    )
    x = values()
    assert grow(x, x["angle"], np.arange(N), [BASE, LARGER], BY_SIZE) == LARGER


def test_the_same_terms_in_another_order_are_judged_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    honest = held_out_errors

    def counted(x: np.ndarray, *others: Any) -> Errors:
        asked.append(x.shape[1])
        return honest(x, *others)

    monkeypatch.setattr("tirelib.estimators.grow.held_out_errors", counted)
    x = values()
    y = x["angle"] + x["angle"] ** 2
    turned = [BASE[1], BASE[0]]
    once = grow(x, y, np.arange(N), [BASE, turned], {})
    assert (once, asked) == (BASE, [2])
    grow(x, y, np.arange(N), [BASE, [{}, {"angle": 2}]], {})  # another power is another term
    assert asked == [2, 2, 2]


def test_whole_loads_between_others_are_asked_of_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every inner level in turn, on the rows that the rest of the data can be asked of."""
    x, penalty = values(), 0.3
    level = np.arange(N) % 4
    x["bow"][(level == 1) & (np.arange(N) % 3 == 0)] = 3.0  # reached at one level only
    y = 2.0 * x["angle"] + x["bow"] + np.random.default_rng(4).standard_normal(N)
    design = design_for(x, [*BASE, {"bow": 1}], ())[2]
    monkeypatch.setattr(
        "tirelib.estimators.grow.ridge_fit",
        lambda *_: Ridge(np.zeros(3), np.eye(3), 1.0, np.ones(3), penalty),
    )
    means = []
    for test, inside in inner_levels(design, level):
        rest = design[~test]
        found = np.linalg.solve(rest.T @ rest + penalty * np.eye(3), rest.T @ y[~test])
        means.append(np.mean((y - design @ found)[test][inside] ** 2))
    assert len(means) == 2
    assert not all(inside.all() for _, inside in inner_levels(design, level))
    errors = held_out_errors(design, y, np.arange(N), level, centre=False)
    both = 0.5 * errors.conditions**2 + 0.5 * np.mean(means)
    assert errors.both == pytest.approx(np.sqrt(both), rel=1e-9)


@pytest.mark.parametrize("centre", [True, False])
def test_held_out_errors_are_those_of_fits_without_the_rows(
    monkeypatch: pytest.MonkeyPatch, centre: bool
) -> None:
    """With the penalty held, the identity is exact: against fitting anew, group by group."""
    x, penalty = values(), 0.3
    terms = [*BASE, *FAMILIES["bow"]]
    y = 2.0 * x["angle"] + x["slope"] + np.random.default_rng(4).standard_normal(N)
    groups = np.repeat(np.arange(20), 3)
    groups[:10] = 100 + np.arange(10)  # some alone
    groups[10:14] = [200, 200, 201, 201]  # some in pairs
    design = design_for(x, terms, ODD_HERE)[2]

    def held(*_: object) -> Ridge:
        return Ridge(np.zeros(4), np.eye(4), 1.0, np.ones(4), penalty)

    monkeypatch.setattr("tirelib.estimators.grow.ridge_fit", held)
    about = y - y.mean() if centre else y
    square = []
    for group in np.unique(groups):
        rest = groups != group
        a = design[rest].T @ design[rest] + penalty * np.eye(4)
        found = np.linalg.solve(a, design[rest].T @ about[rest])
        square += ((about - design @ found)[~rest] ** 2).tolist()
    errors = held_out_errors(design, y, groups, None, centre)
    assert errors.conditions == pytest.approx(np.sqrt(np.mean(square)), rel=1e-9)
    assert errors.both == errors.conditions


def test_families_keep_the_symmetry_of_what_they_describe() -> None:
    """Fz is even in left and right, Fy odd; every term counts its odd regressors."""
    varying = {*SHAPE, *ODD, "traction", "camber", "contact_angle", "compression"}
    odd = {*ODD, "camber"}

    def count(term: basis.Powers) -> int:
        return sum(power for name, power in term.items() if name in odd)

    load, force = basis.load_families(varying), basis.force_families(varying)
    assert {count(term) % 2 for family in load.values() for term in family} == {0}
    assert {count(term) % 2 for family in force.values() for term in family} == {1}
    for families in (load, force):
        for family in families.values():
            assert all(a != b for a, b in pairwise(family))
    # what stood still is in no family
    for families in (basis.load_families({"cp1_slope"}), basis.force_families({"cp1_slope"})):
        names = {name for family in families.values() for term in family for name in term}
        assert not names & set(SHAPE)
