"""Where the calibrated data end: what is lost there is measured, what was not checked is told."""

from collections.abc import Callable

import numpy as np
import pytest

from tirelib.estimators.border import Border
from tirelib.estimators.ends import growth, outermost
from tirelib.estimators.fit import Fit, bands_of, fit_best
from tirelib.estimators.laws import SLOWEST, ConditionLaws


def fitted(y_of: Callable[[np.ndarray, np.ndarray], np.ndarray], *, ends: bool = True) -> Fit:
    """A quadratic in two regressors that rise together, so that corners were never measured."""
    rng = np.random.default_rng(5)
    a = np.repeat(np.linspace(-1.0, 1.0, 13), 3)
    b = a + 0.2 * rng.standard_normal(a.size)
    terms = [{}, {"a": 1}, {"a": 2}, {"b": 1}, {"b": 2}, {"a": 1, "b": 1}]
    y = y_of(a, b) + 0.01 * rng.standard_normal(a.size)
    return fit_best(
        {"a": a, "b": b},
        y,
        np.arange(a.size),
        [terms],
        outermost=list(outermost({"a": a})) if ends else [],
    )


def surprise(fit: Fit, y_of: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """Error over standard deviation a little beyond either end."""
    a = np.array([-1.3, -1.2, -1.1, 1.1, 1.2, 1.3])
    value, std = fit.model.predict({"a": a, "b": a})
    return np.asarray((value - y_of(a, a)) / std)


def bent(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(0.1 * a**5 + 0.3 * b)


def test_beyond_the_data_the_deviation_holds_what_the_polynomial_loses() -> None:
    """A quadratic cannot follow a fifth power; without the ends held out it does not know."""
    assert (np.abs(surprise(fitted(bent), bent)) < 2.5).all()
    assert np.abs(surprise(fitted(bent, ends=False), bent)).max() > 3.0


def test_where_the_polynomial_is_right_little_grows() -> None:
    right, wrong = fitted(lambda a, b: 1.0 + a * b).model.border, fitted(bent).model.border
    assert right is not None
    assert wrong is not None
    assert right.growth < 0.1 * wrong.growth


def test_a_combination_that_was_never_measured_lies_beyond_though_each_part_was() -> None:
    model = fitted(bent).model
    corners = {"a": np.array([0.0, 0.9, 0.9]), "b": np.array([0.0, 0.9, -0.9])}
    assert model.judge(corners)[2].tolist() == [True, True, False]


def test_errors_at_the_worst_end_are_one_standard_deviation_on_average() -> None:
    beyond = [np.linspace(1.0, 2.0, 5), np.full(6, 4.0)]
    inside = [np.ones(5), np.ones(6)]
    errors = [np.sqrt(1.0 + g * far) for g, far in zip((0.5, 3.0), beyond, strict=True)]
    assert growth(errors, inside, beyond) == pytest.approx(3.0, rel=1e-2)
    assert growth([0.5 * e for e in errors[:1]], inside[:1], beyond[:1]) == 0.0
    few, none = [np.full(4, 9.0)], [np.full(5, 9.0)]
    assert growth(few, [np.ones(4)], [np.ones(4)]) == 0.0
    assert growth(none, [np.ones(5)], [np.zeros(5)]) == 0.0


def test_a_level_is_left_out_whole_and_two_levels_have_no_outer_one() -> None:
    loads = np.repeat([1000.0, 2000.0, 3000.0, 4000.0], 5) + np.random.default_rng(1).normal(
        0.0, 5.0, 20
    )
    upper, lower = outermost({"load": loads})
    assert np.flatnonzero(upper).tolist() == list(range(15, 20))
    assert np.flatnonzero(lower).tolist() == list(range(5))
    assert list(outermost({"camber": np.repeat([0.0, 1.0], 5)})) == []
    assert list(outermost({"speed": np.full(5, np.nan)})) == []


def test_growth_begins_where_the_data_end() -> None:
    border = Border(near=2.0, growth=5.0, far=9.0)
    np.testing.assert_allclose(border.grown(np.array([1.0, 2.0, 3.0])), [1.0, 2.0, 8.0])


def laws(*, fitted: bool) -> ConditionLaws:
    return ConditionLaws((2.3e5, 2.3e5), (8.0, 30.0), False, fitted, 0.16, 0.3)


@pytest.mark.parametrize("fitted", [True, False])
def test_a_calibration_has_a_lowest_speed_as_it_has_a_fastest(fitted: bool) -> None:
    speed = np.array([0.9 * SLOWEST, 1.1 * SLOWEST, 8.0, 30.0, 70.0, np.nan, -1.0])
    values = {"speed": speed, "pressure": np.full(speed.shape, 2.3e5)}
    of = laws(fitted=fitted)
    assert of.allowed(values).tolist() == [False, True, True, True, False, True, False]
    assert of.extrapolated(values)[:5].tolist() == [True, True, False, False, True]
    doubt = of.spread(values, np.full(speed.shape, 5000.0))
    assert doubt[0] > doubt[1] > 0.0
    assert doubt[2] == doubt[3] == 0.0
    assert doubt[4] > doubt[1]


def test_a_crawling_calibration_holds_as_slow_as_it_was_made() -> None:
    of = ConditionLaws((2.3e5, 2.3e5), (1.0, 2.0), False, True, 0.16, 0.3)
    values = {"speed": np.array([0.9, 0.96, 2.0]), "pressure": np.full(3, 2.3e5)}
    assert of.allowed(values).tolist() == [False, True, True]


def evenly(n: int, *, banded: bool) -> Fit:
    """A polynomial through n conditions that lie evenly, none at a level."""
    rng = np.random.default_rng(7)
    a = np.sort(rng.uniform(-1.0, 1.0, n))
    y = np.sin(3.0 * a) + 0.01 * rng.standard_normal(n)
    terms = [{}, *({"a": k} for k in range(1, 9))]
    return fit_best({"a": a}, y, np.arange(n), [terms], between=[bands_of(a)] if banded else [])


def test_more_conditions_of_the_same_range_do_not_make_it_narrower() -> None:
    """Leverage falls as conditions are added; so does a border learned from single ones."""
    outer = {"a": np.array([-0.98, 0.95])}
    for n in (120, 240, 480):
        assert evenly(n, banded=True).model.judge(outer)[2].all()
    assert not evenly(240, banded=False).model.judge(outer)[2].any()


def held_between_levels(fit: Fit, y_of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Error over standard deviation midway between the levels of `at_levels`."""
    between = np.arange(-0.75, 0.8, 0.5)
    value, std = fit.at_any_load(fit.model).predict({"a": between})
    return np.asarray((value - y_of(between)) / std)


def at_levels(y_of: Callable[[np.ndarray], np.ndarray]) -> Fit:
    """A fourth power of what was measured at five levels, eight times each."""
    level = np.repeat(np.arange(5), 8)
    a = -1.0 + 0.5 * level
    y = y_of(a) + 0.002 * np.random.default_rng(6).standard_normal(a.size)
    terms = [{}, *({"a": power} for power in range(1, 4))]
    return fit_best({"a": a}, y, np.arange(a.size), [terms], level=level)


def test_between_load_levels_the_deviation_holds_what_the_polynomial_errs() -> None:
    """Conditions at the same level stay in the fit: they say nothing of others."""

    def wavy(a: np.ndarray) -> np.ndarray:
        return np.asarray(0.1 * np.cos(2.0 * np.pi * a) + a)

    fit = at_levels(wavy)
    value, std = fit.model.predict({"a": np.arange(-0.75, 0.8, 0.5)})
    alone = (value - wavy(np.arange(-0.75, 0.8, 0.5))) / std
    assert np.sqrt(np.mean(held_between_levels(fit, wavy) ** 2)) < 2.0
    assert np.sqrt(np.mean(alone**2)) > 1.5 * np.sqrt(np.mean(held_between_levels(fit, wavy) ** 2))
    straight = at_levels(lambda a: a)
    assert straight.between < 0.5 * straight.model.residual
