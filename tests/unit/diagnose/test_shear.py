"""The belt's shear, and one effect that takes most beside it, on stages that are made up."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose import shear as module
from tirelib.diagnose.plain import BESIDE, BY_ITSELF, SHOWN
from tirelib.diagnose.refit import FELL
from tirelib.diagnose.shear import (
    APART,
    ERROR,
    FURTHER,
    HINTED,
    INDEPENDENT,
    MISFIT,
    SHARE,
    TAKES,
    beside_shear,
    on_top,
    shear_itself,
    with_shear,
)
from tirelib.diagnose.stage import ALARM
from tirelib.diagnose.unlisted import gain_by_load
from tirelib.effects import CATALOGUE

NAMES = ("gage_length", "roughness", "gain_by_load", "belt_shear")
EFFECTS = {name: CATALOGUE.get(name, gain_by_load) for name in NAMES}
FAINT = BY_ITSELF * SHOWN[EFFECTS["gage_length"]][0] / EFFECTS["gage_length"].high
"""Part of its range up to which structure shows what the gage's length does."""
BASE, SHEARED = 1.0, 0.8
SLIGHT = float(np.sqrt(1.0 - FELL)) + 0.001


def model(*names: str, error: float, part: float = 0.5) -> Any:
    effects = [EFFECTS[name] for name in names]
    return SimpleNamespace(
        error=error,
        effects=effects,
        strengths=[np.array([part * e.high]) for e in effects],
        strength_std=lambda k: np.array([1e-3 * effects[k].high]),
        needed=list,
    )


def stage_of(one: Any, misfit: float, ratio: float, **more: Any) -> Any:
    """Return what is looked at of the stage of a model."""
    has = {effect.name for effect in one.effects}
    names = [name for name in NAMES if name not in has]
    each = {"in_range": True, "independent": False} | more
    return SimpleNamespace(
        model=one,
        names=names,
        ratio=np.full(len(names), ratio),
        scores=SimpleNamespace(misfit=misfit),
        unlisted=np.array([name == "gain_by_load" for name in names]),
        **{key: np.full(len(names), value) for key, value in each.items()},
    )


def look(
    monkeypatch: pytest.MonkeyPatch,
    shares: dict[str, float],
    *,
    exact: float | None = None,
    sheared: float | None = SHEARED,
    alone: float = 0.5,
    shear: dict[str, Any] | None = None,
    part: float = 0.5,
    first: float = 0.3,
    misfit: float = 800.0,
    ratio: float = 0.0,
    listed: bool = False,
    has: tuple[str, ...] = (),
    among: tuple[str, ...] | None = None,
    **more: Any,
) -> tuple[str, list[list[str]]]:
    """Return who is named (empty if nobody), and what has been fitted.

    Parameters
    ----------
    shares : by name
        Of the squared error beside the shear, to first order.
    exact : float, optional
        Of the leader, in the exact fit.
    sheared : float
        Error with the shear; None does not settle.
    alone : float
        Error with the leader without the shear.
    shear : mapping, optional
        What the shear is beside the leader: its `part` of the range, and whether it is `needed`.
    part : float
        Of the range, where the leader ends.
    first : float
        Strength of all, to first order.
    misfit : float
        With the leader; it is 900 with the shear.
    ratio, more
        Of all beside the shear.
    listed : bool
        Whether what is unlisted has a twin in the catalogue.
    has : names
        That the model has.
    among : names, optional
        Who may be named.
    """
    leader = max(shares, key=lambda name: shares[name])
    made: list[list[str]] = []

    def candidates(_: Any, at: Any, effects: Any) -> Any:
        living = [
            SimpleNamespace(
                effect=EFFECTS[name],
                alone=lambda _, here, left=1.0 - share: (
                    np.array([first]),
                    here.error * float(np.sqrt(left)),
                ),
            )
            for name, share in shares.items()
        ]
        return SimpleNamespace(living=living)

    def refitted(_: Any, effects: Any, strengths: Any) -> Any:
        names = [effect.name for effect in effects]
        made.append(names)
        if names[-1] == "belt_shear":
            return None if sheared is None else model(*names, error=sheared)
        left = 1.0 - (shares[leader] if exact is None else exact)
        if "belt_shear" in names and not has:
            both = model(*names, error=(sheared or BASE) * float(np.sqrt(left)), part=part)
            each = {"part": 0.5, "needed": True} | (shear or {})
            both.strengths[0] = np.array([each["part"] * EFFECTS["belt_shear"].high])
            both.needed = lambda asked: [name for name in asked if each["needed"]]
            return both
        size = alone if len(made) > 2 else float(np.sqrt(left))
        return model(*names, error=size, part=part)

    def staged(one: Any) -> Any:
        last = one.effects[-1].name
        return stage_of(one, 900.0 if last == "belt_shear" else misfit, ratio, **more)

    stage = stage_of(model(*has, error=BASE), 900.0 if has else 1000.0, ratio, **more)
    stage.unlisted &= not listed
    monkeypatch.setattr(module, "candidates", candidates)
    with_it = with_shear(stage, refitted)
    found = beside_shear(None, stage, with_it, list(CATALOGUE.values()), refitted, staged, among)
    if found is None:
        return "", made
    after, where = found
    if not stage.unlisted[where]:
        assert [effect.name for effect in after.model.effects] == made[-1]
    return stage.names[where], made


def test_who_takes_most_is_named_beside_the_shear(monkeypatch: pytest.MonkeyPatch) -> None:
    named, made = look(monkeypatch, {"gage_length": SHARE + 0.01, "roughness": 0.2})
    assert named == "gage_length"
    assert made == [["belt_shear"], ["belt_shear", "gage_length"]]


@pytest.mark.parametrize(
    "changed",
    [
        {"shares": {"gage_length": SHARE - 0.01}},
        {"shares": {"gage_length": 0.7, "roughness": 0.7 * APART + 0.01}},
        {"exact": SHARE - 0.01},
        {"part": 1.5},
        {"misfit": 900.1},
    ],
    ids=["too little", "another is near", "not exactly", "too strong", "more misfit"],
)
def test_nothing_is_named_where_it_does_not_stand_out(
    monkeypatch: pytest.MonkeyPatch, changed: dict[str, Any]
) -> None:
    given = {"shares": {"gage_length": 0.8}} | changed
    assert look(monkeypatch, **given)[0] == ""
    assert look(monkeypatch, {"gage_length": 0.8})[0] == "gage_length"


@pytest.mark.parametrize(
    ("ratio", "independent", "least"),
    [
        (0.99, True, SHARE),
        (1.0, True, INDEPENDENT),
        (1.0, False, HINTED),
    ],
)
def test_a_hint_needs_less_and_one_that_nothing_imitates_least(
    monkeypatch: pytest.MonkeyPatch, ratio: float, independent: bool, least: float
) -> None:
    given: dict[str, Any] = {"ratio": ratio, "independent": independent}
    assert look(monkeypatch, {"gage_length": least + 0.01}, **given)[0] == "gage_length"
    assert look(monkeypatch, {"gage_length": least - 0.01}, **given)[0] == ""
    given["in_range"] = False
    assert look(monkeypatch, {"gage_length": SHARE - 0.01}, **given)[0] == ""


@pytest.mark.parametrize("sheared", [None, float(np.sqrt(1.0 - TAKES)) + 1e-3])
def test_a_shear_that_takes_nothing_is_left_out(
    monkeypatch: pytest.MonkeyPatch, sheared: float | None
) -> None:
    named, made = look(monkeypatch, {"gage_length": 0.8}, sheared=sheared)
    assert named == "gage_length"
    assert made == [["belt_shear"], ["gage_length"]]


@pytest.mark.parametrize(
    "without",
    [{"shear": {"part": 1.5}}, {"shear": {"needed": False}}, {"sheared": SLIGHT}],
    ids=["out of its range", "not needed beside it", "too little"],
)
def test_a_shear_that_stands_for_structure_is_not_named_with_it(
    monkeypatch: pytest.MonkeyPatch, without: dict[str, Any]
) -> None:
    named, made = look(monkeypatch, {"gage_length": 0.8}, **without)
    assert named == "gage_length"
    assert made == [["belt_shear"], ["belt_shear", "gage_length"], ["gage_length"]]
    assert look(monkeypatch, {"gage_length": 0.8}, alone=0.9, **without)[0] == ""


def test_a_shear_that_the_model_has_is_not_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    named, made = look(monkeypatch, {"gage_length": 0.8}, has=("belt_shear",))
    assert named == "gage_length"
    assert made == [["belt_shear", "gage_length"]]


@pytest.mark.parametrize(
    ("ratio", "independent", "least"),
    [(0.99, True, SHARE), (1.0, True, FURTHER), (1.0, False, SHARE)],
)
def test_beside_what_is_named_more_is_needed(
    monkeypatch: pytest.MonkeyPatch, ratio: float, independent: bool, least: float
) -> None:
    given: dict[str, Any] = {"ratio": ratio, "independent": independent, "among": ("gage_length",)}
    assert look(monkeypatch, {"gage_length": least + 0.01}, **given)[0] == "gage_length"
    assert look(monkeypatch, {"gage_length": least - 0.01}, **given)[0] == ""


def test_a_strength_that_structure_may_show_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert look(monkeypatch, {"gage_length": 0.8}, part=1.01 * FAINT)[0] == "gage_length"
    assert look(monkeypatch, {"gage_length": 0.8}, part=0.99 * FAINT)[0] == ""
    edge = BY_ITSELF * SHOWN[gain_by_load][0]
    assert look(monkeypatch, {"gain_by_load": 0.8}, first=1.01 * edge)[0] == "gain_by_load"
    assert look(monkeypatch, {"gain_by_load": 0.8}, first=0.99 * edge)[0] == ""


def test_beside_others_structure_may_show_more(monkeypatch: pytest.MonkeyPatch) -> None:
    twice, has = BESIDE / BY_ITSELF * FAINT, ("belt_shear", "roughness")
    assert look(monkeypatch, {"gage_length": 0.8}, part=1.01 * twice, has=has)[0]
    assert not look(monkeypatch, {"gage_length": 0.8}, part=0.99 * twice, has=has)[0]
    assert look(monkeypatch, {"gage_length": 0.8}, part=0.99 * twice, has=has[:1])[0]


def test_only_who_may_be_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    shares = {"gage_length": 0.8, "roughness": 0.2}
    assert look(monkeypatch, shares, among=("gage_length",))[0] == "gage_length"
    assert look(monkeypatch, shares, among=("roughness",))[0] == ""
    assert look(monkeypatch, {"gain_by_load": 0.8}, among=("roughness",))[0] == ""


def top(
    share: float, *, part: float = 0.5, misfit: float = 800.0, lost: str = "", idle: str = ""
) -> bool:
    """Return whether the shear is added to a stage with an effect.

    What is lost is needed no longer beside it, and what is idle neither with nor without it.
    """
    now = stage_of(model("gage_length", error=BASE), 900.0, 0.0)
    now.model.needed = lambda names: [name for name in names if name != idle]
    both = model("gage_length", "belt_shear", error=float(np.sqrt(1.0 - share)), part=part)
    both.needed = lambda names: [name for name in names if name not in (lost, idle)]
    after = stage_of(both, misfit, 0.0)
    found = on_top(now, both, 0.12, lambda _: after)
    assert found is after or found is now
    return found is after


def test_the_shear_comes_on_top_where_it_takes_enough_and_replaces_nothing() -> None:
    assert top(0.13)
    assert not top(0.11)
    assert not top(0.5, part=1.5), "too strong"
    assert not top(0.5, misfit=901.0), "more misfit"
    assert not top(0.5, lost="gage_length"), "it would replace what is named"
    assert not top(0.5, lost="belt_shear"), "it is not needed itself"
    assert top(0.5, idle="gage_length"), "what the model had for nothing is no reason"


def test_what_is_in_no_catalogue_is_told_unless_it_looks_like_an_effect(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shares = {"gain_by_load": 0.8, "roughness": 0.2}
    assert look(monkeypatch, shares) == ("gain_by_load", [["belt_shear"]])
    assert look(monkeypatch, shares, listed=True)[0] == ""


LIMIT = 0.01
JUST = (float(np.sqrt(1.0 - ERROR)) - 0.01, 1.0 - MISFIT - 0.01, ALARM - 0.1, 0.5)
"""Error, misfit, imitation and strength in its range, with which the shear just explains most."""


def itself(
    error: float, misfit: float, imitated: float, part: float, *, before: float = 1.0
) -> int | None:
    """Return the index of the shear, if it is named by itself."""
    base, sheared = model(error=BASE), model("belt_shear", error=error, part=part)
    stage = stage_of(base, before, 0.0, limit=LIMIT)
    after = SimpleNamespace(model=sheared, scores=SimpleNamespace(misfit=misfit), imitated=imitated)
    found = shear_itself(stage, with_shear(stage, lambda *_: sheared), lambda _: after)
    assert found is None or found[0] is after
    return None if found is None else found[1]


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, JUST[0] + 0.02), (1, JUST[1] + 0.02), (2, ALARM), (3, 1.5), (3, -0.5)],
    ids=["error stays", "misfit stays", "the impossible stays", "too strong", "wrong sign"],
)
def test_the_shear_is_named_only_where_it_explains_most_in_its_range(
    place: int, value: float
) -> None:
    given = list(JUST)
    assert itself(*given) == NAMES.index("belt_shear")
    given[place] = value
    assert itself(*given) is None


def test_a_misfit_that_variants_have_as_well_is_not_enough() -> None:
    assert MISFIT > ALARM * LIMIT, "the share is what counts for a large misfit"
    error, _, _, part = JUST
    assert itself(error, 1.0 - ALARM * LIMIT - 0.001, 0.0, part) is None
    assert itself(error, 0.1 - ALARM * LIMIT - 0.001, 0.0, part, before=0.1) is not None
    assert itself(error, 0.1 - ALARM * LIMIT + 0.001, 0.0, part, before=0.1) is None


def test_a_shear_that_the_model_has_or_that_takes_nothing_is_not_named() -> None:
    for base in (model("belt_shear", error=BASE), model(error=BASE)):
        stage = stage_of(base, 1.0, 0.0)
        same = with_shear(stage, lambda *_: model("belt_shear", error=BASE))
        assert same is base
        assert shear_itself(stage, same, lambda _: pytest.fail("no stage is needed")) is None
