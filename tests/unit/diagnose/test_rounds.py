"""Rounds of a diagnosis on stages that are made up: who is added, and who goes again."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose import rounds
from tirelib.diagnose.stage import ALARM, NEAR, Stage

NAMES = ("strong", "close", "weak")
LEFT = {(): 1000.0, ("strong",): 500.0, ("close",): 300.0, ("weak",): 990.0}
"""Misfit that is left by the names that a made-up model has."""


def effect(name: str) -> Any:
    return SimpleNamespace(name=name, low=-1.0, high=1.0)


def stage(has: tuple[str, ...], misfit: float, score: Sequence[float]) -> Any:
    """Return a stage whose model has some effects and scores the others."""
    others = [name for name in NAMES if name not in has]
    return SimpleNamespace(
        names=others,
        model=SimpleNamespace(
            effects=[effect(name) for name in has], strengths=[np.zeros(1) for _ in has]
        ),
        found=SimpleNamespace(living=[SimpleNamespace(effect=effect(name)) for name in others]),
        scores=SimpleNamespace(
            misfit=misfit, score=np.array(score), strength=[np.array([0.5])] * len(others)
        ),
        limit=np.full(len(others), 10.0),
    )


def fit(left: dict[tuple[str, ...], float]) -> Callable[..., Any]:
    """Return a fit that leaves what a table says; the order of the names does not count."""
    by_set = {frozenset(names): misfit for names, misfit in left.items()}

    def fitted(before: Any, effects: Sequence[Any], strengths: Sequence[Any]) -> Any:
        names = tuple(each.name for each in effects)
        misfit = by_set.get(frozenset(names))
        others = len(NAMES) - len(names)
        return None if misfit is None else stage(names, misfit, [50.0] * others)

    return fitted


FIRST = stage((), 1000.0, [400.0, 390.0, 5.0])


def test_of_near_leaders_the_one_whose_exact_refit_leaves_least_is_added() -> None:
    found = rounds._added(FIRST, FIRST, [0, 1], fit(LEFT))
    assert found is not None
    assert found[1] == "close"
    alone = rounds._added(FIRST, FIRST, [0], fit(LEFT))
    assert alone is not None
    assert alone[1] == "strong"


def test_a_leader_that_the_exact_refit_does_not_need_is_not_added() -> None:
    needed = ALARM * FIRST.limit[2]
    assert 1000.0 - LEFT["weak",] < needed
    assert rounds._added(FIRST, FIRST, [2], fit(LEFT)) is None


def test_a_refit_that_does_not_settle_adds_nothing() -> None:
    assert rounds._added(FIRST, FIRST, [0, 1], fit({})) is None


def test_what_the_laws_before_may_be_off_by_is_no_effect() -> None:
    later = stage(("strong",), 400.0, [rounds.ROUGH * 600.0 - 0.1, 0.0])
    left = {("strong", "close"): 300.0}
    assert rounds._added(FIRST, later, [0], fit(left)) is None
    enough = stage(("strong",), 400.0, [rounds.ROUGH * 600.0 + 0.1, 0.0])
    assert rounds._added(FIRST, enough, [0], fit(left)) is not None


def test_an_effect_that_a_later_one_replaces_goes() -> None:
    both = stage(("strong", "close"), 290.0, [0.0])
    least = dict.fromkeys(NAMES, 10.0)
    thinner, gone = rounds._thinned(both, ["strong"], least, fit(LEFT))
    assert gone == {"strong"}
    assert [each.name for each in thinner.model.effects] == ["close"]
    kept, none = rounds._thinned(both, ["strong"], least, fit({**LEFT, ("close",): 400.0}))
    assert none == set()
    assert kept is both


@pytest.mark.parametrize(("outside", "told"), [(0.0, [0, 1]), (30.0, [])])
def test_leaders_are_near_the_best_and_none_where_an_impossible_effect_explains_more(
    outside: float, told: list[int]
) -> None:
    ratio = np.array([20.0, 20.0 * NEAR + 0.1, 20.0 * NEAR - 0.1, outside])
    judged = SimpleNamespace(
        ratio=ratio, alarms=np.array([True, True, True, False]), outside=outside,
        names=[*NAMES, "impossible"],
    )  # fmt: skip
    assert Stage.leaders(judged, set(judged.names), ALARM) == told
