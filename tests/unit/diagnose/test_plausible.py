"""What strengths outside their ranges say: by size, by sign, and beyond what structure imitates."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose.ensemble import ALIKE
from tirelib.diagnose.stage import IMITATION, RANGE_SLACK, _ranges
from tirelib.effects import CATALOGUE

STD = 1e-3


def far(name: str, strength: float) -> bool:
    """Return whether a strength lies farther outside its range than structure imitates."""
    effect = CATALOGUE[name]
    found: Any = SimpleNamespace(living=[SimpleNamespace(effect=effect)])
    scores: Any = SimpleNamespace(
        strength=[np.full(effect.components, strength)], std=[np.full(effect.components, STD)]
    )
    return bool(_ranges(found, scores)[-1][0])


@pytest.mark.parametrize("name", ["sidewall_damping", "hydroplaning"])
def test_structure_may_imitate_a_little_of_what_cannot_be(name: str) -> None:
    effect = CATALOGUE[name]
    assert effect.low == 0.0
    assert effect not in ALIKE
    edge = RANGE_SLACK * STD + IMITATION * effect.scale
    assert not far(name, -0.99 * edge)
    assert far(name, -1.01 * edge)
    assert not far(name, 0.5 * effect.high)


def test_what_the_metric_has_is_not_imitated_beyond_that() -> None:
    effect = CATALOGUE["sidewall_load"]
    assert effect in ALIKE
    assert effect.low == 0.0
    assert not far("sidewall_load", -0.99 * RANGE_SLACK * STD)
    assert far("sidewall_load", -1.01 * RANGE_SLACK * STD)
