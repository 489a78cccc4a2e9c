"""Many comparisons here are of one model at one plan: its solution there is made once."""

import pickle
from collections.abc import Iterator
from typing import Any

import pytest

from tirelib.inference.compare import model


@pytest.fixture(autouse=True, scope="module")
def a_solution_of_the_plain_ring_is_made_once() -> Iterator[None]:
    made: dict[bytes, model.Prediction] = {}
    solve = model._rolling

    def once(values: Any, points: Any, changes: Any, low_pass: Any, start: Any) -> model.Prediction:
        if changes:
            return solve(values, points, changes, low_pass, start)
        key = pickle.dumps((sorted(values.items()), points, low_pass))
        if key not in made:
            made[key] = solve(values, points, changes, low_pass, start)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model, "_rolling", once)
        yield
