"""The effect that by itself takes most of the error, where the joint fit names nothing."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose.sole import ERROR, MISFIT, TRIED, sole
from tirelib.diagnose.stage import ALARM
from tirelib.effects import CATALOGUE

LIMIT = 0.01


def candidate(name: str, share: float) -> Any:
    """Return a candidate that takes a share of the squared error to first order."""

    def alone(_: Any, model: Any) -> tuple[np.ndarray, float]:
        return np.array([10.0 * CATALOGUE[name].high]), model.error * float(np.sqrt(1.0 - share))

    return SimpleNamespace(effect=CATALOGUE[name], alone=alone)


def stage(
    error: float, misfit: float, imitated: float, strength: float, *living: Any,
    name: str = "belt_shear",
) -> Any:  # fmt: skip
    """Return what is looked at of a stage."""
    model = SimpleNamespace(
        error=error, effects=(CATALOGUE[name],) * (not living),
        strengths=(np.array([strength]),) * (not living), strength_std=lambda _: np.array([1e-4]),
    )  # fmt: skip
    return SimpleNamespace(
        model=model, scores=SimpleNamespace(misfit=misfit), imitated=imitated,
        found=SimpleNamespace(living=living), limit=np.full(len(living), LIMIT),
    )  # fmt: skip


def before(*living: Any, misfit: float = 1.0) -> Any:
    return stage(0.5, misfit, 5.0, 0.0, *living)


JUST = (0.5 * float(np.sqrt(1.0 - ERROR)) - 0.01, 1.0 - MISFIT - 0.01, ALARM - 0.1, 0.03)


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, JUST[0] + 0.02), (1, JUST[1] + 0.02), (2, ALARM), (3, 0.06), (3, -0.02)],
    ids=["error stays", "misfit stays", "the impossible stays", "too strong", "wrong sign"],
)
def test_only_what_explains_most_in_its_range_is_taken(place: int, value: float) -> None:
    after = list(JUST)

    def told() -> Any:
        now = before(candidate("belt_shear", 0.9))
        return sole(
            None, now, ["belt_shear"], lambda *_: stage(*after).model, lambda _: stage(*after)
        )

    assert told()[1] == 0
    after[place] = value
    assert told() is None


def test_a_misfit_that_variants_have_as_well_is_not_enough() -> None:
    after = stage(JUST[0], 1.0 - ALARM * LIMIT + 0.001, 0.0, 0.03)
    small = before(candidate("belt_shear", 0.9), misfit=1.0)
    assert MISFIT > ALARM * LIMIT, "the share is what counts for a large misfit"
    assert sole(None, small, ["belt_shear"], lambda *_: after.model, lambda _: after) is None
    tiny = before(candidate("belt_shear", 0.9), misfit=0.1)
    for left, taken in ((0.1 - ALARM * LIMIT - 0.001, True), (0.1 - ALARM * LIMIT + 0.001, False)):
        after = stage(JUST[0], left, 0.0, 0.03)
        found = sole(None, tiny, ["belt_shear"], lambda *_, one=after: one.model,
                     lambda _, one=after: one)  # fmt: skip
        assert (found is not None) is taken


def test_the_one_that_leaves_the_least_error_is_taken() -> None:
    left = {"belt_shear": 0.2, "roughness": 0.1, "gage_drift": 0.15}
    now = before(*(candidate(name, 0.9) for name in left))

    def made(name: str) -> Any:
        return stage(left[name], 0.5, 0.0, 0.02, name=name)

    def refitted(_: Any, effects: Any, strengths: Any) -> Any:
        return made(effects[-1].name).model

    def staged(model: Any) -> Any:
        return made(model.effects[-1].name)

    assert sole(None, now, list(left), refitted, staged)[1] == 1
    # the next best, if that may not be named
    assert sole(None, now, ["belt_shear", "gage_drift"], refitted, staged)[1] == 2


def test_only_what_takes_much_to_first_order_is_tried_from_where_it_does() -> None:
    now = before(candidate("belt_shear", TRIED + 0.01), candidate("roughness", TRIED - 0.01))
    tried: list[str] = []

    def refitted(_: Any, effects: Any, strengths: Any) -> None:
        tried.append(effects[-1].name)
        effect = effects[-1]
        assert strengths[-1][0] == pytest.approx(0.9 * effect.high), "as far as its range goes"

    assert sole(None, now, ["belt_shear", "roughness"], refitted, lambda _: None) is None
    assert tried == ["belt_shear"]
