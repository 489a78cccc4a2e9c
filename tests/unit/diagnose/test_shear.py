"""The belt's shear, and one effect that takes most beside it, on stages that are made up."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose import shear as module
from tirelib.diagnose.refit import FELL
from tirelib.diagnose.shear import (
    APART,
    ERROR,
    HINTED,
    MISFIT,
    SHARE,
    beside_shear,
    shear_itself,
    with_shear,
)
from tirelib.diagnose.stage import ALARM
from tirelib.diagnose.unlisted import gain_by_load
from tirelib.effects import CATALOGUE

NAMES = ("gage_length", "roughness", "gain_by_load", "belt_shear")
EFFECTS = {name: CATALOGUE.get(name, gain_by_load) for name in NAMES}
BASE, SHEARED = 1.0, 0.8


def model(*names: str, error: float, part: float = 0.5) -> Any:
    effects = [EFFECTS[name] for name in names]
    return SimpleNamespace(
        error=error, effects=effects, strengths=[np.array([part * e.high]) for e in effects],
        strength_std=lambda k: np.array([1e-3 * effects[k].high]),
    )  # fmt: skip


def look(
    monkeypatch: pytest.MonkeyPatch,
    shares: dict[str, float],
    *,
    exact: float | None = None,
    ratio: float = 0.0,
    sheared: float | None = SHEARED,
    part: float = 0.5,
    alone: float = 0.7,
    misfit: float = 900.0,
    listed: bool = False,
    has: tuple[str, ...] = (),
) -> tuple[str, list[list[str]]]:
    """Return who is named (empty if nobody), and what has been fitted.

    Parameters
    ----------
    shares : by name
        Of the squared error beside the shear, to first order.
    exact : float, optional
        Of the leader, in the exact fit.
    ratio : float
        Of all scores to thresholds.
    sheared, alone : float
        Errors with the shear, and with the leader without it; None does not settle.
    part : float
        Of the range, where the leader ends.
    misfit : float
        Of the leader alone.
    listed : bool
        Whether what is unlisted has a twin in the catalogue.
    has : names
        That the model has.
    """
    leader = max(shares, key=lambda name: shares[name])
    base = model(*has, error=BASE)
    others = [name for name in NAMES if name not in has]
    made: list[list[str]] = []

    def candidates(_: Any, at: Any, effects: Any) -> Any:
        def alone(_: Any, here: Any, share: float) -> Any:
            return np.array([0.3]), here.error * float(np.sqrt(1.0 - share))

        living = [
            SimpleNamespace(effect=EFFECTS[name],
                            alone=lambda d, m, share=share: alone(d, m, share))
            for name, share in shares.items()
        ]  # fmt: skip
        return SimpleNamespace(living=living)

    def refitted(_: Any, effects: Any, strengths: Any) -> Any:
        names = [effect.name for effect in effects]
        made.append(names)
        if names[-1] == "belt_shear":
            return None if sheared is None else model(*names, error=sheared)
        if "belt_shear" in names:
            left = shares[leader] if exact is None else exact
            size = SHEARED if sheared is None else sheared
            return model(*names, error=size * float(np.sqrt(1.0 - left)), part=part)
        return model(*names, error=alone, part=part)

    stage = SimpleNamespace(
        model=base, names=others, in_range=np.ones(len(others), dtype=bool),
        ratio=np.full(len(others), ratio), scores=SimpleNamespace(misfit=1000.0),
        unlisted=np.array([name == "gain_by_load" and not listed for name in others]),
    )  # fmt: skip
    monkeypatch.setattr(module, "candidates", candidates)
    found = beside_shear(
        None, stage, with_shear(base, refitted), list(CATALOGUE.values()), refitted,
        lambda one: SimpleNamespace(model=one, scores=SimpleNamespace(misfit=misfit)),
    )  # fmt: skip
    return ("" if found is None else others[found[1]]), made


def test_who_takes_most_is_named_and_fitted_without_the_shear_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    named, made = look(monkeypatch, {"gage_length": SHARE + 0.01, "roughness": 0.2})
    assert named == "gage_length"
    assert made == [["belt_shear"], ["belt_shear", "gage_length"], ["gage_length"]]


@pytest.mark.parametrize(
    "changed",
    [
        {"shares": {"gage_length": SHARE - 0.01}},
        {"shares": {"gage_length": 0.7, "roughness": 0.7 * APART + 0.01}},
        {"exact": SHARE - 0.01},
        {"part": 1.5},
        {"alone": float(np.sqrt(1.0 - FELL)) + 0.01},
        {"misfit": 1000.1},
    ],
    ids=["too little", "another is near", "not exactly", "too strong", "none of the base's error",
         "more misfit"],
)  # fmt: skip
def test_nothing_is_named_where_it_does_not_stand_out(
    monkeypatch: pytest.MonkeyPatch, changed: dict[str, Any]
) -> None:
    given = {"shares": {"gage_length": 0.8}} | changed
    assert look(monkeypatch, **given)[0] == ""
    assert look(monkeypatch, {"gage_length": 0.8})[0] == "gage_length"


@pytest.mark.parametrize(("ratio", "named"), [(1.0, "gage_length"), (0.99, "")])
def test_a_hint_needs_less(monkeypatch: pytest.MonkeyPatch, ratio: float, named: str) -> None:
    assert look(monkeypatch, {"gage_length": HINTED + 0.01}, ratio=ratio)[0] == named
    assert look(monkeypatch, {"gage_length": HINTED - 0.01}, ratio=ratio)[0] == ""


@pytest.mark.parametrize("sheared", [None, float(np.sqrt(1.0 - FELL)) + 0.01])
def test_a_shear_that_takes_nothing_is_left_out(
    monkeypatch: pytest.MonkeyPatch, sheared: float | None
) -> None:
    named, made = look(monkeypatch, {"gage_length": 0.8}, sheared=sheared, alone=0.4)
    assert named == "gage_length"
    assert made == [["belt_shear"], ["gage_length"]]


def test_a_shear_that_the_model_has_is_not_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    named, made = look(monkeypatch, {"gage_length": 0.8}, has=("belt_shear",))
    assert named == "gage_length"
    assert made == [["belt_shear", "gage_length"]]


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
    stage = SimpleNamespace(
        model=base, names=NAMES, scores=SimpleNamespace(misfit=before),
        limit=np.array([1.0, 1.0, 1.0, LIMIT]),
    )  # fmt: skip
    after = SimpleNamespace(model=sheared, scores=SimpleNamespace(misfit=misfit), imitated=imitated)
    found = shear_itself(stage, with_shear(base, lambda *_: sheared), lambda _: after)
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
        stage = SimpleNamespace(model=base, names=NAMES[: 4 - len(base.effects)])
        same = with_shear(base, lambda *_: model("belt_shear", error=BASE))
        assert same is base
        assert shear_itself(stage, same, lambda _: pytest.fail("no stage is needed")) is None
