"""A model fitted to straight runs: where it starts, what it reaches, which delay it finds."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import optimize

from tests.unit.inference.diagnose.planted import EFFECT, STRENGTH, model_file, runs
from tests.unit.inference.identify.model_waves import TIRE
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.effects.effect import Effect, effect
from tirelib.effects.harmonics import orders, with_gain
from tirelib.effects.state import State
from tirelib.inference.compare.error import Yardstick, error_of
from tirelib.inference.compare.model import model_of
from tirelib.inference.diagnose.diagnose import plain_tires
from tirelib.inference.diagnose.strain_models import Fitted
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.identify.delay import UNIT, by_delay, earlier
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.problems.strain_prior import WIDTH
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.posterior import Posterior, posterior
from tirelib.measured.waveforms import GRID
from tirelib.model.base import BARE, move, values_of

DELAY = 4e-5
FIRST_ORDER, SECOND_ORDER = (0.2, 0.02), (0.3, 0.0)
"""Lags of first order, s_2 = s_1^2 / 2, and of Butterworth's second one, [ms]."""
LIKE = [CATALOGUE[name] for name in (EFFECT, "temperature", "tread_load", "tread_friction")]
"""The planted effect and some that look like it."""


def hypotheses(
    measured: StraightRuns, values: Mapping[str, float | FloatArray], *catalogue: Effect
) -> Hypotheses:
    return Hypotheses(StrainProblem(measured, values, catalogue), plain_tires())


def base_of(
    measured: StraightRuns, values: Mapping[str, float | FloatArray] | None = None
) -> Fitted:
    found = hypotheses(measured, values or values_of(TIRE))
    return Fitted.of(found, found.base, Yardstick.of(measured))


def delay_of(model: Fitted) -> float:
    return UNIT * float(model.hypothesis.fit.point.base[-1])


def delay_std(model: Fitted) -> float:
    k = len(model.hypothesis.fit.point.base) - 1
    return UNIT * float(np.sqrt(model.covariance[k, k]))


def late(state: State, delay: float) -> State:
    """Return a state whose waveform comes later, as a gain of each order."""
    angle = delay * np.asarray(state.conditions.omega)[:, None]
    return with_gain(state, np.exp(-1j * orders(state) * angle))


def late_runs(measured: StraightRuns, delay: float) -> StraightRuns:
    """Return runs as gages show them that are late."""
    state = State.of(values_of(TIRE), measured.data().points, GRID).but(waveform=measured.strain)
    return replace(measured, strain=late(state, delay).wave)


@pytest.fixture(scope="module")
def plain() -> Fitted:
    return base_of(runs())


@pytest.fixture(scope="module")
def lacking() -> Fitted:
    """Return a fit that lacks the runs' effect, so that it leaves much."""
    return base_of(runs(EFFECT, STRENGTH))


def test_a_tire_of_the_model_is_fitted_to_the_noise(plain: Fitted) -> None:
    assert plain.error == pytest.approx(1.0, abs=0.1)


def test_its_error_is_that_of_the_model_file(lacking: Fitted) -> None:
    told = error_of(runs(EFFECT, STRENGTH), lacking.model)
    assert lacking.error == pytest.approx(told.value, rel=1e-6)
    assert lacking.error > 10.0


@pytest.mark.parametrize("k", range(len(BARE)), ids=[each.name for each in BARE])
def test_no_coordinate_goes_much_lower(plain: Fitted, k: int) -> None:
    """The likeliest numbers beside what plain tires show give little of the error away."""
    yardstick, step = Yardstick.of(runs()), 0.02 * float(WIDTH[BARE[k].name])
    for side in (-step, step):
        z = np.zeros(len(BARE))
        z[k] = side
        moved = replace(plain.model, values=move(plain.values, z, BARE))
        there = yardstick.error(moved, start=plain.rolling)
        assert there.value > 0.96 * plain.error, f"{BARE[k].name} moved by {side:g}"


@pytest.mark.parametrize("away", [-0.1, 0.1])
def test_no_other_numbers_have_less_than_the_least_error(lacking: Fitted, away: float) -> None:
    """From numbers a little away from the likeliest, every coordinate moved alike."""
    measured = runs(EFFECT, STRENGTH)
    yardstick = Yardstick.of(measured)
    fit = lacking.hypothesis.fit
    there = replace(fit, point=replace(fit.point, base=fit.point.base + away))
    start = Fitted.of(lacking.hypotheses, replace(lacking.hypothesis, fit=there), yardstick)
    given, least = start.least_error(model_of(model_file()), yardstick)
    assert given.value == pytest.approx(error_of(measured, model_of(model_file())).value)
    assert least.value < min(given.value, start.error, lacking.error)

    def left(z: FloatArray) -> FloatArray:
        model = replace(lacking.model, values=move(lacking.values, z, BARE))
        return np.asarray(yardstick.error(model, start=lacking.rolling).by_run)

    found = optimize.least_squares(left, np.zeros(len(BARE)), diff_step=1e-3, max_nfev=12)
    assert least.value < 1.05 * np.sqrt(np.mean(found.fun**2))


def test_numbers_that_have_the_least_error_already_are_kept(plain: Fitted) -> None:
    measured = runs()
    given, least = plain.least_error(plain.model, Yardstick.of(measured))
    assert given.value == pytest.approx(plain.error, rel=1e-6)
    assert 0.9 * given.value < least.value <= given.value


@pytest.mark.parametrize("factor", [0.75, 1.3])
def test_a_start_far_away_ends_where_one_nearby_does(plain: Fitted, factor: float) -> None:
    near = values_of(TIRE)
    moved = ("radial_stiffness", "radial_pressure_slope", "extension_stiffness", "tread_stiffness")
    far = base_of(runs(), {**near, **{n: factor * np.asarray(near[n]) for n in moved}})
    assert far.error == pytest.approx(plain.error, rel=0.01)
    apart = plain.reached.prediction.strain - far.reached.prediction.strain
    assert np.sqrt(np.mean(plain.reached.white_of(apart) ** 2)) < 0.3, "a third of the noise"


def test_a_strength_does_not_depend_on_where_the_fit_starts() -> None:
    measured, near = runs(EFFECT, STRENGTH), values_of(TIRE)
    moved = ("radial_stiffness", "radial_pressure_slope", "extension_stiffness", "tread_stiffness")
    found = []
    for factor in (1.0, 0.75):
        values = {**near, **{n: factor * np.asarray(near[n]) for n in moved}}
        made = hypotheses(measured, values, *LIKE).at((EFFECT,))
        assert made is not None
        found.append(made.fit)
    one, other = found
    assert abs(one.strengths[0] - other.strengths[0])[0] < 0.3 * min(one.std(0)[0], other.std(0)[0])


def test_the_base_is_fitted_once_from_each_start_and_its_whitening_is_about_that_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    starts = []

    def counted(problem: StrainProblem, *words: Any, **named: Any) -> Posterior:
        starts.append(named.get("near"))
        return posterior(problem, *words, **named)

    monkeypatch.setattr("tirelib.inference.statistics.hypotheses.posterior", counted)
    measured, near = runs(), values_of(TIRE)
    given = StrainProblem(measured, {**near, "tread_stiffness": 2.0 * TIRE.tread_stiffness}, ())
    among = Hypotheses(given, plain_tires())
    # a rough fit from each start; these end alike, so that one of them is fitted on
    count = len(given.starts)
    assert count > 1
    assert [start is None for start in starts[: count + 1]] == [True] * (count + 1)
    assert all(start is not None for start in starts[count + 1 :])
    assert isinstance(among.problem, StrainProblem)
    apart = among.base.fit.solved.waveform - among.problem.reference.waveform
    assert np.std(apart) < 0.01 * np.std(measured.strain)
    assert np.std(given.reference.waveform - among.problem.reference.waveform) > 0.0


def ends_at_zero(name: str, side: float) -> Effect:
    """Return a law that has strengths on one side of zero only."""

    def softer(state: State, strength: float) -> State:
        if side * strength < 0.0:
            raise ParameterError("no such law")
        return state.but(k_u=state.k_u * (1.0 - 0.5 * np.abs(strength) * state.deflection / 0.02))

    low, high = sorted((0.0, 0.5 * side))
    return effect(
        name, stage="stiffness", unit="1", low=low, high=high, varies_with=("load",), source="test"
    )(softer)


def test_a_law_that_ends_at_zero_is_fitted_from_there(lacking: Fitted) -> None:
    sides = {"above": 1.0, "below": -1.0}
    laws = [ends_at_zero(name, side) for name, side in sides.items()]
    measured = runs(EFFECT, STRENGTH)
    among = hypotheses(measured, lacking.values, *laws)
    for name, side in sides.items():
        found = among.at((name,))
        assert found is not None
        with_it = Fitted.of(among, found, Yardstick.of(measured))
        assert side * with_it.strengths[0][0] > 0.1
        assert with_it.error < 0.7 * lacking.error


def test_each_run_comes_later_by_its_speed() -> None:
    points = runs().data().points
    wave = np.cos(3.0 * GRID) + 0.2 * np.sin(7.0 * GRID)
    state = State.of(values_of(TIRE), points, GRID)
    moved = late(state.but(waveform=np.tile(wave, (len(points), 1))), DELAY).wave
    angle = GRID - DELAY * np.asarray(points.omega)[:, None]
    np.testing.assert_allclose(moved, np.cos(3.0 * angle) + 0.2 * np.sin(7.0 * angle), atol=1e-12)
    assert np.ptp(points.omega) > 10.0, "speeds differ"


def test_delays_add_up_and_none_changes_no_bit(plain: Fitted) -> None:
    measured, omega = runs(), runs().data().points.omega
    assert np.array_equal(late_runs(measured, 0.0).strain, measured.strain)
    smooth = replace(measured, strain=plain.reached.prediction.strain)
    twice = late_runs(late_runs(smooth, DELAY), DELAY).strain
    np.testing.assert_allclose(twice, late_runs(smooth, 2.0 * DELAY).strain, atol=1e-12)
    np.testing.assert_allclose(earlier(twice, omega, 2.0 * DELAY), smooth.strain, atol=1e-12)


def test_the_slope_is_the_derivative() -> None:
    measured, step = runs(), 1e-7
    change = late_runs(measured, step).strain - late_runs(measured, -step).strain
    slope = by_delay(measured.strain, measured.data().points.omega) / UNIT
    np.testing.assert_allclose(slope, change / (2.0 * step), atol=1e-6 * np.abs(slope).max())


def test_a_late_campaign_is_fitted_as_well_as_one_on_time(plain: Fitted) -> None:
    behind = base_of(late_runs(runs(), DELAY))
    # the runs' own misfits could be part of it, so the fit takes a little less than all
    assert abs(delay_of(behind) - delay_of(plain) - DELAY) < 2.0 * delay_std(behind)
    assert delay_std(behind) < 0.3 * DELAY
    assert abs(delay_of(plain)) < 2e-6
    assert behind.error == pytest.approx(plain.error, rel=0.01)
    apart = behind.reached.delay - plain.reached.delay
    assert abs(apart - DELAY) < 2.0 * delay_std(behind)


@pytest.mark.parametrize("lag", [FIRST_ORDER, SECOND_ORDER])
def test_an_effect_that_comes_late_is_told_from_a_delay(lag: tuple[float, float]) -> None:
    measured = runs("low_pass", lag)
    among = hypotheses(measured, values_of(TIRE), CATALOGUE["low_pass"])
    base = Fitted.of(among, among.base, Yardstick.of(measured))
    found = among.at(("low_pass",))
    assert found is not None
    after = Fitted.of(among, found, Yardstick.of(measured))
    assert (np.abs(after.strengths[0] - lag) < 3.0 * after.strength_std(0)).all()
    assert (after.strength_std(0) < 0.05).all()
    assert abs(delay_of(after)) < 2.0 * delay_std(after)
    assert after.error < 0.3 * base.error
