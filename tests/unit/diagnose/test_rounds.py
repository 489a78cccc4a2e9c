"""Rounds of a diagnosis on stages that are made up: who is added, and who goes again."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tirelib.diagnose import rounds
from tirelib.diagnose.refit import FELL, Refits
from tirelib.diagnose.rounds import CLEAR, FURTHER, HALVED, LARGE, ON_TOP, ROUNDS, Rounds
from tirelib.diagnose.stage import ALARM, ALONE, NEAR, OWN, Stage
from tirelib.errors import ConvergenceError

NAMES = ("strong", "close", "weak")
LEFT = {(): 1000.0, ("strong",): 500.0, ("close",): 300.0, ("weak",): 990.0}
"""Misfit that is left by the names that a made-up model has."""


Need = Callable[[Any], bool]


def always(_: Any) -> bool:
    return True


def effect(name: str) -> Any:
    return SimpleNamespace(name=name, low=-1.0, high=1.0, scale=1.0, components=1)


def stage(
    has: tuple[str, ...],
    misfit: float,
    score: Sequence[float],
    leaders: Sequence[str] = (),
    over: Sequence[str] = (),
    strength: float = 0.5,
    independent: bool = False,
    error: float | None = None,
    imitated: Sequence[str] = (),
) -> Any:
    """Return a stage whose model has some effects and scores the others; with who leads there.

    What is over its range is barred together with all that it leads. Those `imitated` lead only
    where what cannot be does not count. The squared error goes with the misfit if it is not told.
    """
    others = [name for name in NAMES if name not in has]
    return SimpleNamespace(
        names=others,
        model=SimpleNamespace(
            effects=[effect(name) for name in has],
            strengths=[np.full(1, strength) for _ in has],
            strength_std=lambda _: np.full(1, 0.01),
            error=float(np.sqrt(misfit / 1000.0)) if error is None else error,
        ),
        unlisted=np.zeros(len(others), dtype=bool),
        found=SimpleNamespace(living=[SimpleNamespace(effect=effect(name)) for name in others]),
        scores=SimpleNamespace(
            misfit=misfit, score=np.array(score), strength=[np.array([0.5])] * len(others)
        ),
        limit=np.full(len(others), 10.0),
        over=np.isin(others, over),
        independent=np.full(len(others), independent),
        leaders=lambda suspects, bar, clear, barred, spared=False: (
            []
            if barred
            else [others.index(name) for name in (leaders if clear else [*leaders, *imitated])]
        ),
    )


def fit(left: dict[tuple[str, ...], float], strength: float = 0.5) -> Callable[..., Any]:
    """Return a fit that leaves what a table says; the order of the names does not count."""
    by_set = {frozenset(names): misfit for names, misfit in left.items()}

    def fitted(
        before: Any, effects: Sequence[Any], strengths: Sequence[Any], need: Need = always
    ) -> Any:
        names = tuple(each.name for each in effects)
        misfit = by_set.get(frozenset(names))
        if misfit is None:
            return None
        made = stage(names, misfit, [50.0] * (len(NAMES) - len(names)), strength=strength)
        return made if need(made.model) else None

    return fitted


SCORE = [400.0, 390.0, 5.0]
FIRST = stage((), 1000.0, SCORE)


def added(now: Any, fitted: Callable[..., Any]) -> str:
    """Return the name of what a round adds, empty if nothing."""
    before = len(now.model.effects)
    found = rounds._added(FIRST if before else now, now, set(NAMES), before, fitted)
    return "" if found is None else now.names[found[1]]


def test_of_near_leaders_the_one_whose_exact_refit_leaves_least_is_added() -> None:
    assert added(stage((), 1000.0, SCORE, ["strong", "close"]), fit(LEFT)) == "close"
    assert added(stage((), 1000.0, SCORE, ["strong"]), fit(LEFT)) == "strong"


def test_a_leader_that_the_exact_refit_does_not_need_is_not_added() -> None:
    needed = ALARM * FIRST.limit[2]
    assert 1000.0 - LEFT["weak",] < needed
    assert not added(stage((), 1000.0, SCORE, ["weak"]), fit(LEFT))


def test_what_a_plain_tire_shows_is_not_added(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rounds, "usual", lambda has, each, strength: each.name == "close")
    assert added(stage((), 1000.0, SCORE, ["strong", "close"]), fit(LEFT)) == "strong"
    assert not added(stage((), 1000.0, SCORE, ["close"]), fit(LEFT))


def test_a_refit_that_does_not_settle_adds_nothing() -> None:
    assert not added(stage((), 1000.0, SCORE, ["strong", "close"]), fit({}))


@pytest.mark.parametrize(("strength", "name"), [(1.0 + LARGE, "close"), (1.1 + LARGE, "")])
def test_what_is_too_large_to_first_order_is_named_where_its_exact_refit_is_not(
    strength: float, name: str
) -> None:
    now = stage((), 1000.0, SCORE, ["strong", "close"], over=["close"])
    assert added(now, fit(LEFT, strength)) == name


def test_what_the_laws_before_may_be_off_by_is_no_effect() -> None:
    left = {("strong", "close"): 300.0}
    rough = rounds.ROUGH * 600.0
    assert not added(stage(("strong",), 400.0, [rough - 0.1, 0.0], ["close"]), fit(left))
    assert added(stage(("strong",), 400.0, [rough + 0.1, 0.0], ["close"]), fit(left)) == "close"
    apart = stage(("strong",), 400.0, [rough - 0.1, 0.0], ["close"], independent=True)
    assert added(apart, fit(left)) == "close", "it has nothing to do with those before"


@pytest.mark.parametrize(("gone", "name"), [(HALVED + 0.01, "close"), (HALVED - 0.01, "")])
def test_what_takes_half_of_the_error_is_needed_whatever_imitates_it(
    gone: float, name: str
) -> None:
    fitted = fit({("strong", "close"): 400.0 * (1.0 - gone)})
    now = stage(("strong",), 400.0, [300.0, 0.0], imitated=["close"])
    assert added(now, fitted) == name
    alone = stage((), 400.0, [300.0, 0.0, 0.0], imitated=["close"])
    assert not added(alone, fit({("close",): 100.0})), "the first is not spared so"


def test_half_of_the_error_is_not_enough_for_what_is_too_large_in_the_exact_refit_too() -> None:
    left = {("strong", "close"): 100.0}
    for strength, name in ((1.0 + LARGE, "close"), (1.1 + LARGE, "")):
        now = stage(("strong",), 400.0, [300.0, 0.0], over=["close"], imitated=["close"])
        assert added(now, fit(left, strength)) == name


@pytest.mark.parametrize(
    ("gone", "strength", "name"),
    [(FURTHER + 0.01, 0.5, "close"), (FURTHER - 0.01, 0.5, ""), (0.9, -0.5, "")],
    ids=["enough", "too little", "of the other sign than the joint fit asks for"],
)
def test_a_further_effect_has_to_take_a_share_of_the_error_as_it_is_asked_to(
    gone: float, strength: float, name: str
) -> None:
    def fitted(before: Any, effects: Any, strengths: Any, need: Need) -> Any:
        error = float(np.sqrt(1.0 - gone))
        made = stage(("strong", "close"), 300.0, [0.0], error=error, strength=strength)
        return made if need(made.model) else None

    now = stage(("strong",), 400.0, [300.0, 0.0], ["close"], error=1.0)
    assert added(now, fitted) == name


@pytest.mark.parametrize(
    ("gone", "ratio", "name"),
    [(ON_TOP + 0.01, ALARM, "close"), (ON_TOP - 0.01, ALARM, ""), (0.9, ALARM - 0.1, "")],
    ids=["enough", "too little", "a hint"],
)
def test_the_first_beside_the_belts_has_to_be_an_alarm_and_take_more(
    gone: float, ratio: float, name: str
) -> None:
    now = stage(("belt_shear",), 400.0, [300.0, 300.0, 0.0], ["close"], error=1.0)
    now.ratio = np.array([0.0, ratio, 0.0])
    made = stage(("belt_shear", "close"), 300.0, [0.0], error=float(np.sqrt(1.0 - gone)))

    def fitted(_: Any, effects: Any, strengths: Any, need: Need) -> Any:
        return made if need(made.model) else None

    found = rounds._added(FIRST, now, set(NAMES), 0, fitted)
    assert (now.names[found[1]] if found else "") == name


def test_an_effect_without_which_the_error_stays_goes() -> None:
    both = stage(("strong", "close"), 290.0, [0.0], error=1.0)
    least = dict.fromkeys(NAMES, 10.0)
    for back, names in ((FELL - 0.01, {"strong"}), (FELL + 0.01, set())):
        without = stage(("close",), 600.0, [0.0] * 2, error=float(np.sqrt(1.0 / (1.0 - back))))
        _, gone = rounds._thinned(both, ["strong"], least, lambda *_, one=without: one)
        assert gone == names


def test_an_effect_that_a_later_one_replaces_goes() -> None:
    both = stage(("strong", "close"), 290.0, [0.0])
    least = dict.fromkeys(NAMES, 10.0)
    thinner, gone = rounds._thinned(both, ["strong"], least, fit(LEFT))
    assert gone == {"strong"}
    assert [each.name for each in thinner.model.effects] == ["close"]
    kept, none = rounds._thinned(both, ["strong"], least, fit({**LEFT, ("close",): 400.0}))
    assert none == set()
    assert kept is both


def judged(
    ratio: Sequence[float],
    alone: Sequence[float],
    outside: float = 0.0,
    score: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    apart: bool = False,
) -> Any:
    """Return a stage as far as its leaders go; all but the last may be named.

    `apart`: whether the last is independent.
    """
    scores = SimpleNamespace(
        alone=np.array([*alone, 1.0]), score=np.array([*score, 1.0 if apart else 0.0])
    )
    return SimpleNamespace(
        ratio=np.array([*ratio, outside]),
        in_range=np.array([True, True, True, False]),
        impossible=np.array([False, False, False, True]),
        over=np.zeros(4, dtype=bool),
        unlisted=np.zeros(4, dtype=bool),
        names=[*NAMES, "impossible"],
        scores=scores,
        independent=Stage.independent.__get__(SimpleNamespace(scores=scores)),
    )


@pytest.mark.parametrize(("outside", "told"), [(0.0, [0, 1]), (19.9, [0, 1]), (20.1, [])])
def test_leaders_are_near_the_best_and_none_where_an_impossible_effect_explains_more(
    outside: float, told: list[int]
) -> None:
    ratio = [20.0, 20.0 * NEAR + 0.1, 20.0 * NEAR - 0.1]
    stage = judged(ratio, [100.0, 0.0, 0.0], outside)
    assert Stage.leaders(stage, set(stage.names), ALARM, 1.0) == told


def test_a_hint_that_takes_away_as_much_alone_is_a_rival_however_little_it_adds_to_the_others() -> (
    None
):
    stage = judged([20.0, 0.9, 1.1], [100.0, 100.0 * ALONE + 1.0, 100.0 * ALONE + 1.0])
    assert Stage.leaders(stage, set(stage.names), ALARM, 1.0) == [0, 2]
    less = judged([20.0, 0.9, 1.1], [100.0, 0.0, 100.0 * ALONE - 1.0])
    assert Stage.leaders(less, set(less.names), ALARM, 1.0) == [0]


def test_a_further_effect_has_to_be_clear_of_what_imitates_the_impossible() -> None:
    for outside, told in ((9.9, [0]), (10.1, [])):
        stage = judged([20.0, 0.0, 0.0], [100.0, 0.0, 0.0], outside)
        assert Stage.leaders(stage, set(stage.names), ALARM, 2.0) == told


@pytest.mark.parametrize(
    ("share", "told"),
    [(OWN[0] - 0.01, []), (OWN[0] + 0.01, [1]), (OWN[1] - 0.01, [1]), (OWN[1] + 0.01, [])],
)
def test_what_nothing_else_could_take_is_no_imitation(share: float, told: list[int]) -> None:
    stage = judged([20.0, 15.0, 0.0], [100.0, 90.0, 0.0], 19.0, [10.0, share * 90.0, 0.0])
    names = set(stage.names)
    assert Stage.leaders(stage, names, ALARM, CLEAR, spared=True) == told
    assert Stage.leaders(stage, names, ALARM, CLEAR) == []
    clear = judged([20.0, 15.0, 0.0], [100.0, 90.0, 0.0], 13.0, [10.0, share * 90.0, 0.0])
    assert Stage.leaders(clear, names, ALARM, CLEAR, spared=True) == [0, 1]


@pytest.mark.parametrize(("outside", "told"), [(14.9, [0]), (15.1, [])])
def test_what_is_independent_has_to_be_clear_of_the_impossible_that_is_so_too(
    outside: float, told: list[int]
) -> None:
    stage = judged(
        [CLEAR * 15.0, 0.0, 0.0], [100.0, 90.0, 0.0], outside, [100.0, 0.0, 0.0], apart=True
    )
    assert stage.independent[[0, 3]].all()
    assert Stage.leaders(stage, set(stage.names), ALARM, CLEAR, spared=True) == told


def test_each_further_effect_has_to_stand_out_more() -> None:
    asked: list[tuple[float, float, bool]] = []

    def leaders(
        _: set[str], bar: float, clear: float, __: set[str], *, spared: bool = False
    ) -> list[int]:
        if clear:
            asked.append((bar, clear, spared))
        return []

    now = stage((), 1000.0, SCORE)
    now.leaders = leaders
    for before in range(ROUNDS):
        assert rounds._added(FIRST, now, set(NAMES), before, fit(LEFT)) is None
    assert [bar for bar, _, _ in asked] == sorted({bar for bar, _, _ in asked})
    assert asked[0] == (ALARM, 1.0, False)
    assert [each[1:] for each in asked[1:]] == [(CLEAR, True)] * (ROUNDS - 1)


def test_what_is_too_large_leads_until_it_is_barred_and_then_bars_the_others() -> None:
    stage = judged([20.0, 19.0, 0.0], [100.0, 90.0, 0.0], 40.0)
    stage.over[3] = True
    assert Stage.leaders(stage, set(stage.names), ALARM, 1.0) == [3, 0, 1]
    assert Stage.leaders(stage, set(stage.names), ALARM, 1.0, {"impossible"}) == []


def test_what_is_in_no_catalogue_contends_without_being_a_suspect() -> None:
    stage = judged([20.0, 19.0, 0.0], [100.0, 90.0, 0.0])
    stage.unlisted[1], stage.in_range[1] = True, False
    assert Stage.leaders(stage, {NAMES[0]}, ALARM, 1.0) == [0, 1]


def test_hints_alone_have_no_leader() -> None:
    stage = judged([ALARM - 0.1, 2.0, 1.0], [100.0, 100.0, 100.0])
    assert Stage.leaders(stage, set(stage.names), ALARM, 1.0) == []


@pytest.mark.parametrize(
    ("gone", "clear", "itself", "named"),
    [
        (FELL - 0.01, "", "close", "close"),
        (FELL + 0.01, "", "close", "strong"),
        (FELL - 0.01, "", "", "strong"),
        (None, "", "close", "close"),
        (None, "weak", "close", "weak"),
        (FELL + 0.01, "weak", "close", "strong"),
    ],
    ids=[
        "takes nothing",
        "takes something",
        "nothing takes most",
        "no leader",
        "one takes most beside the shear",
        "the joint fit goes first",
    ],
)
def test_what_takes_most_of_the_error_is_looked_for_where_no_leader_takes_any(
    monkeypatch: pytest.MonkeyPatch, gone: float | None, clear: str, itself: str, named: str
) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.in_range = np.ones(3, dtype=bool)
    leads = None
    if gone is not None:
        leads = stage(("strong",), 900.0, [0.0] * 2, error=float(np.sqrt(1.0 - gone))), 0

    def told(name: str) -> Any:
        return (stage((name,), 300.0, [0.0] * 2, error=0.3), NAMES.index(name)) if name else None

    found = iter([leads, None])
    monkeypatch.setattr(rounds, "_added", lambda *_: next(found))
    monkeypatch.setattr(
        rounds, "beside_shear", lambda _, now, *__: told(clear) if now is first else None
    )
    monkeypatch.setattr(rounds, "with_shear", lambda now, _: now.model)
    monkeypatch.setattr(rounds, "shear_itself", lambda *_: told(itself))
    made = rounds.rounds(None, first, [], None, 1e-6, None)
    assert made == Rounds(made.stage, [named], 1, None, ("weak",) if named == "weak" else ())


def test_beside_the_shear_of_every_belt_another_is_looked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.names[2] = "belt_shear"
    first.in_range = np.ones(3, dtype=bool)
    sheared = stage(("belt_shear",), 400.0, [0.0] * 3, error=0.5)
    both = stage(("belt_shear", "close"), 100.0, [0.0] * 2, error=0.3)
    asked: list[Any] = []

    def clear(_: Any, now: Any, *given: Any) -> Any:
        asked.append((now, given[-1]))
        return (both, 1) if now is sheared else None

    monkeypatch.setattr(rounds, "_added", lambda *_: None)
    monkeypatch.setattr(rounds, "beside_shear", clear)
    monkeypatch.setattr(rounds, "with_shear", lambda now, _: now.model)
    monkeypatch.setattr(rounds, "shear_itself", lambda *_: (sheared, 2))
    monkeypatch.setattr(rounds, "_thinned", lambda now, *_: (now, set()))
    made = rounds.rounds(None, first, [], None, 1e-6, None)
    assert (made.named, made.by_share) == (["belt_shear", "close"], ("close",))
    # beside an effect that hides, only the other hints of the first joint fit
    assert asked == [(first, None), (sheared, None), (both, {"strong"})]


def test_the_shear_is_named_last_where_it_is_needed_as_well(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.names[2] = "belt_shear"
    first.in_range = np.ones(3, dtype=bool)
    strong = stage(("strong",), 300.0, [0.0] * 2, error=0.5)
    both = stage(("strong", "belt_shear"), 100.0, [0.0] * 2, error=0.4)
    asked: list[Any] = []

    def on_top(now: Any, model: Any, least: float, _: Any) -> Any:
        asked.append((now, model, least))
        return both

    found = iter([(strong, 0), None])
    monkeypatch.setattr(rounds, "_added", lambda *_: next(found))
    made_once: list[Any] = []
    monkeypatch.setattr(rounds, "with_shear", lambda now, _: made_once.append(now) or both.model)
    monkeypatch.setattr(rounds, "beside_shear", lambda *_: None)
    monkeypatch.setattr(rounds, "on_top", on_top)
    made = rounds.rounds(None, first, [], None, 1e-6, None)
    assert made == Rounds(both, ["strong", "belt_shear"], 1, None, ())
    assert asked == [(strong, both.model, FURTHER)]
    assert made_once == [strong], "the shear is fitted once beside what is named"


@pytest.mark.parametrize("gone", [0.0, FELL - 0.01])
def test_where_nothing_is_named_that_takes_any_no_shear_comes_on_top(
    monkeypatch: pytest.MonkeyPatch, gone: float
) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.in_range = np.ones(3, dtype=bool)
    little = stage(("strong",), 900.0, [0.0] * 2, error=float(np.sqrt(1.0 - gone)))
    found = iter([(little, 0) if gone else None, None])
    monkeypatch.setattr(rounds, "_added", lambda *_: next(found))
    monkeypatch.setattr(rounds, "with_shear", lambda now, _: now.model)
    for name in ("beside_shear", "shear_itself"):
        monkeypatch.setattr(rounds, name, lambda *_: None)
    monkeypatch.setattr(rounds, "on_top", lambda *_: pytest.fail("not asked"))
    assert rounds.rounds(None, first, [], None, 1e-6, None).named == ["strong"] * (gone > 0.0)


def test_what_stands_out_beside_the_shear_is_named_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.in_range = np.ones(3, dtype=bool)
    both = stage(("belt_shear", "close"), 100.0, [0.0] * 2, error=0.3)
    monkeypatch.setattr(rounds, "_added", lambda *_: None)
    monkeypatch.setattr(rounds, "with_shear", lambda now, _: now.model)
    monkeypatch.setattr(
        rounds, "beside_shear", lambda _, now, *__: (both, 1) if now is first else None
    )
    made = rounds.rounds(None, first, [], None, 1e-6, None)
    assert made == Rounds(both, ["close", "belt_shear"], 1, None, ("close",))


def test_beside_what_is_named_a_suspect_may_stand_out(monkeypatch: pytest.MonkeyPatch) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.in_range = np.ones(3, dtype=bool)
    first.limit = np.array([1e-3, 1e-3, 1e9])
    first.scores.score = np.ones(3)
    strong = stage(("strong",), 300.0, [0.0] * 2, error=0.5)
    both = stage(("strong", "close"), 100.0, [0.0], error=0.3)
    asked: list[Any] = []

    def clear(_: Any, now: Any, *given: Any) -> Any:
        asked.append(set(given[-1]))
        return (both, 0) if now is strong else None

    found = iter([(strong, 0), None, None])
    monkeypatch.setattr(rounds, "_added", lambda *_: next(found))
    monkeypatch.setattr(rounds, "_thinned", lambda now, *_: (now, set()))
    monkeypatch.setattr(rounds, "with_shear", lambda now, _: now.model)
    monkeypatch.setattr(rounds, "beside_shear", clear)
    made = rounds.rounds(None, first, [], None, 1e-6, None)
    assert made == Rounds(both, ["strong", "close"], 2, None, ("close",))
    assert asked == [{"close"}, set()], "no hint, no suspect"


def test_a_shear_that_the_first_joint_fit_does_not_know_is_not_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = stage((), 1000.0, SCORE, error=1.0)
    first.in_range = np.ones(3, dtype=bool)
    strong = stage(("strong",), 300.0, [0.0] * 2, error=0.5)
    found = iter([(strong, 0), None])
    monkeypatch.setattr(rounds, "_added", lambda *_: next(found))
    monkeypatch.setattr(rounds, "with_shear", lambda *_: pytest.fail("no finding would tell it"))
    monkeypatch.setattr(rounds, "beside_shear", lambda *_: None)
    assert rounds.rounds(None, first, [], None, 1e-6, None).named == ["strong"]


def test_the_same_effects_are_fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[list[str]] = []

    def refit(_: Any, values: Any, effects: Any, *__: Any, **___: Any) -> Any:
        made.append([effect.name for effect in effects])
        if len(effects) > 2:
            raise ConvergenceError("it does not settle", None, 1.0)
        return object()

    monkeypatch.setattr("tirelib.diagnose.refit.refit", refit)
    nothing: Any = None
    model, other = (
        cast("Any", SimpleNamespace(values={}, delay=0.0, correction=None)) for _ in range(2)
    )
    refitted, effects = Refits(nothing), [effect("strong"), effect("close")]
    one, same = (refitted(model, effects, [np.array([s])] * 2) for s in (0.1, 0.2))
    assert one is same
    assert refitted(model, effects[:1], [np.array([0.1])]) is not one
    assert refitted(other, effects, [np.array([0.1])] * 2) is not one
    three = [*effects, effect("far")]  # from elsewhere it may settle
    assert [refitted(model, three, [np.array([0.1])] * 3) for _ in range(2)] == [None, None]
    both = ["strong", "close"]
    assert made == [both, ["strong"], both, [*both, "far"], [*both, "far"]]
