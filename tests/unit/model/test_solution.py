"""Effects act on the rolling ring: a changed constant is that of another tire, slopes are exact."""

import numpy as np
import pytest

from tests.unit.model.test_whole import GRIPPING, POINTS
from tirelib.arrays import FloatArray
from tirelib.effects import CATALOGUE
from tirelib.model.base import coordinates, move, predict
from tirelib.model.chain import Changes
from tirelib.model.solution import (
    Solution,
    added_by_values,
    by_effects,
    by_values,
    made_with,
    solved,
)
from tirelib.model.state import State
from tirelib.signal import LowPass

LOW_PASS = LowPass()
FREE = coordinates(GRIPPING)


def at(values: dict[str, float | FloatArray], changes: Changes = ()) -> Solution:
    return solved(values, POINTS, changes, low_pass=LOW_PASS)


@pytest.mark.parametrize(
    ("name", "strength", "field"),
    [("temperature", 0.0, "k"), ("temperature", 0.2, "k"), ("tread_load", 0.3, "tread")],
)
def test_an_effect_is_a_tire_with_other_constants(name: str, strength: float, field: str) -> None:
    found = at(GRIPPING, [CATALOGUE[name].at(strength)])
    values = dict(GRIPPING)
    if field == "k":
        # the temperature is not measured: the place in the campaign stands for it
        soft = np.exp(-strength * POINTS.order)
        for stiffness in ("radial", "tangential"):
            values[f"{stiffness}_stiffness"] = values[f"{stiffness}_stiffness"] * soft
            values[f"{stiffness}_pressure_slope"] = values[f"{stiffness}_pressure_slope"] * soft
        values["tread_stiffness"] = values["tread_stiffness"] * soft
    if field == "tread":
        values["tread_stiffness"] = values["tread_stiffness"] * (POINTS.load / 4000.0) ** strength
    assert found.waveform == pytest.approx(at(values).waveform, abs=1e-11)


def test_constants_follow_the_deflection_that_they_cause() -> None:
    effect = CATALOGUE["sidewall_load"]
    found = at(GRIPPING, [effect.at(0.4)])
    again = made_with(GRIPPING, POINTS, [effect.at(0.4)[1]], found.deflection)
    assert found.made.constants.k_u == pytest.approx(again.constants.k_u, rel=1e-6)
    # softer than at no strength where the tire is pressed beyond 20 mm, stiffer where less
    change = found.deflection - at(GRIPPING).deflection
    assert (change[found.deflection > 0.021] > 0.0).all()


def test_what_the_rolling_ring_has_not_is_what_the_linear_one_changes() -> None:
    def damped(state: State) -> State:
        return state.but(damping=state.damping + 0.05)

    changes = [("constants", damped)]
    found = at(GRIPPING, changes)
    linear = predict(GRIPPING, POINTS, changes, low_pass=LOW_PASS).wave
    plain = predict(GRIPPING, POINTS, low_pass=LOW_PASS).wave
    assert found.waveform - at(GRIPPING).waveform == pytest.approx(linear - plain, abs=1e-10)
    assert np.abs(linear - plain).max() > 1e-6


@pytest.mark.parametrize(
    "effects",
    [
        {"temperature": 0.1},
        {"sidewall_load": 0.4},
        {"gage_saturation": 0.5},
        {"roughness": 0.1},
        {"sidewall_load": 0.3, "roughness": 0.1, "gage_saturation": 0.3},
    ],
)
def test_slopes_are_differences(effects: dict[str, float]) -> None:
    def with_them(z: FloatArray, more: dict[str, float]) -> FloatArray:
        values = move(GRIPPING, z, FREE)
        return at(values, [CATALOGUE[name].at(s) for name, s in more.items()]).waveform

    zero = np.zeros(len(FREE))
    found = at(GRIPPING, [CATALOGUE[name].at(s) for name, s in effects.items()])
    slopes = by_values(found, FREE).waveform[: len(FREE)] + added_by_values(found, FREE, 1e-3)
    step = 1e-3
    for k in range(len(FREE)):
        there, back = zero.copy(), zero.copy()
        there[k], back[k] = step, -step
        difference = (with_them(there, effects) - with_them(back, effects)) / (2.0 * step)
        assert np.linalg.norm(slopes[k] - difference) < 0.01 * np.linalg.norm(difference), FREE[k]
    there_effects, steps = [], []
    for name in effects:
        effect = CATALOGUE[name]
        moved = {**effects, name: effects[name] + 1e-3 * effect.toward}
        changes = [CATALOGUE[n].at(s) for n, s in moved.items()]
        there_effects.append((effect.hook, changes))
        steps.append(1e-3 * effect.toward)
    rows = by_effects(found, there_effects, steps).waveform
    for row, name, h in zip(rows, effects, steps, strict=True):
        moved = {**effects, name: effects[name] + h}
        less = {**effects, name: effects[name] - h}
        difference = (with_them(zero, moved) - with_them(zero, less)) / (2.0 * h)
        assert np.linalg.norm(row - difference) < 0.02 * np.linalg.norm(difference), name
