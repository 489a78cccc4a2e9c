"""Who comes first for a residual, on a stage that is made up."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose.plain import SHEAR
from tirelib.effects import CATALOGUE
from tirelib.planning.first_round import FirstRound

FRICTION = CATALOGUE["tread_friction"]
PULLED, BENT = np.array([0.05, 0.0]), np.array([0.05, 0.05])


def first(
    strength: np.ndarray, *has: Any, leaders: tuple[int, ...] = (0,), unlisted: bool = False
) -> str:
    stage: Any = SimpleNamespace(
        names=[FRICTION.name],
        model=SimpleNamespace(effects=has),
        found=SimpleNamespace(living=[SimpleNamespace(effect=FRICTION)]),
        scores=SimpleNamespace(strength=[strength]),
        unlisted=np.array([unlisted]),
        leaders=lambda *_: list(leaders),
    )
    stage.of_residual = lambda _: stage
    return FirstRound(stage).first(np.zeros((1, 1)))


def test_the_leader_comes_first_unless_it_is_in_no_catalogue() -> None:
    assert first(BENT) == "tread_friction"
    assert first(BENT, unlisted=True) == ""
    assert first(BENT, leaders=()) == ""


@pytest.mark.parametrize(("strength", "name"), [(PULLED, ""), (BENT, "tread_friction")])
def test_what_plain_tires_show_beside_the_shear_is_nobody(strength: np.ndarray, name: str) -> None:
    assert first(strength, SHEAR) == name
    assert first(strength) == "tread_friction", "without the shear nothing is known to be usual"
