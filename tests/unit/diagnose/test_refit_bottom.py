"""A fit ends at the bottom of the cost of the whole model, large displacements and all."""

import numpy as np
import pytest

from tests.unit.diagnose.planted import EFFECT, STRENGTH, runs
from tests.unit.identify.model_waves import TIRE
from tirelib.arrays import FloatArray
from tirelib.diagnose.fitter import WIDTH
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE
from tirelib.effects.effect import State, effect
from tirelib.errors import ParameterError
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import BARE, large_displacements, move, predict, values_of


def cost(data: Data, model: Refit, z: FloatArray) -> float:
    """Return the squared error after a move, large displacements computed there anew."""
    values = move(model.values, z, BARE)
    large = large_displacements(values, data.points, low_pass=data.low_pass)
    state = predict(values, data.points, model.changes, low_pass=data.low_pass, correction=large)
    return float(np.sum(model.whiten(data.strain - state.wave) ** 2))


@pytest.fixture(scope="module")
def lacking() -> tuple[Data, Refit]:
    """Return runs and a fit that lacks their effect, so that it leaves much."""
    data = runs(EFFECT, STRENGTH).data(with_deflection=False)
    return data, refit(data, values_of(TIRE))


def test_its_error_is_that_of_the_whole_model(lacking: tuple[Data, Refit]) -> None:
    data, model = lacking
    nothing = refit(runs().data(with_deflection=False), values_of(TIRE))
    assert model.error > 3.0 * nothing.error, "it lacks the effect"
    whole = np.sqrt(cost(data, model, np.zeros(len(BARE))) / data.strain.size)
    assert whole == pytest.approx(model.error, rel=1e-3)


@pytest.mark.parametrize("k", range(len(BARE)), ids=[each.name for each in BARE])
def test_no_coordinate_goes_lower(lacking: tuple[Data, Refit], k: int) -> None:
    data, model = lacking
    here = cost(data, model, np.zeros(len(BARE)))
    step = min(0.03, 0.1 * float(WIDTH[BARE[k].name]))
    for side in (-step, step):
        z = np.zeros(len(BARE))
        z[k] = side
        there = cost(data, model, z)
        assert there > (1.0 - 2e-3) * here, f"{BARE[k].name} moved by {side:g}"


@pytest.mark.parametrize("name", ["belt_shear", "gage_saturation", "sidewall_pressure"])
def test_one_effect_more_leaves_no_more(lacking: tuple[Data, Refit], name: str) -> None:
    data, model = lacking
    effect = CATALOGUE[name]
    for share in (0.05, 0.5):
        start = np.full(effect.components, share * effect.toward)
        more = refit(data, model.values, [effect], [start], delay=model.delay)
        left = model.whiten(data.strain - more.waveform)  # by the same weights
        assert np.sqrt(np.mean(left**2)) < 1.005 * model.error


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_law_that_ends_at_zero_is_fitted_from_there_and_held_there(
    lacking: tuple[Data, Refit], side: float
) -> None:
    def softer(state: State, strength: float) -> State:
        if side * strength < 0.0:
            raise ParameterError("no such law")
        return state.but(k_u=state.k_u * (1.0 - 0.5 * np.abs(strength) * state.deflection / 0.02))

    low, high = sorted((0.0, 0.5 * side))
    law = effect(
        "softer",
        stage="stiffness",
        unit="1",
        low=low,
        high=high,
        varies_with=("load",),
        source="test",
    )(softer)
    data, model = lacking
    found = refit(data, model.values, [law], delay=model.delay)  # it starts from zero
    assert side * found.strengths[0][0] > 0.1
    assert found.error < 0.7 * model.error
    other = effect(
        "harder",
        stage="stiffness",
        unit="1",
        low=low,
        high=high,
        varies_with=("load",),
        source="test",
    )(
        lambda state, strength: softer(state, strength).but(
            k_u=2.0 * state.k_u - softer(state, strength).k_u
        )
    )
    held = refit(data, model.values, [other], [np.array([0.1 * side])], delay=model.delay)
    assert held.strengths[0][0] == pytest.approx(0.0, abs=1e-9)
