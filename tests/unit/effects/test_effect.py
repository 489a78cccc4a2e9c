"""The type of an effect: what it refuses, and how its law is guarded."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import read_tire
from tirelib.effects import CATALOGUE, Effect, effect
from tirelib.effects.state import State
from tirelib.model.base import predict, values_of
from tirelib.model.strain_bench import reference_plan

TIRE = read_tire("table-6-1").tire
POINTS = reference_plan(TIRE).points.take(np.array([0, 30, 65]))


def made(law: Any, **changes: Any) -> Effect:
    given: dict[str, Any] = {"stage": "stiffness", "unit": "1", "low": 0.0, "high": 1.0}
    return effect("mine", **{**given, **changes})(law)


def softer(state: State, strength: float) -> State:
    """Softer sidewall."""
    return state.but(k_u=state.k_u * (1.0 - strength))


def run(change: Any, points: Any = POINTS) -> State:
    return predict(values_of(TIRE), points, [change])


def test_the_nearest_of_points_is_nearest_by_ratios_of_load_and_pressure() -> None:
    every = np.arange(len(POINTS))
    np.testing.assert_array_equal(POINTS.nearest(POINTS), every)
    moved = replace(POINTS, load=1.1 * POINTS.load, pressure=0.95 * POINTS.pressure)
    np.testing.assert_array_equal(POINTS.nearest(moved), every)
    few = replace(POINTS, load=np.array([1e3, 3e3, 3e3]), pressure=np.array([2e5, 1e5, 2.4e5]))
    asked = replace(POINTS, load=np.array([1.8e3, 1.7e3, 2.9e3]), pressure=np.full(3, 2.2e5))
    np.testing.assert_array_equal(few.nearest(asked), [2, 0, 2])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"stage": "sidewall"}, ("stage 'sidewall'", "stiffness, inertia, tread")),
        ({"unit": "furlong"}, ("unit 'furlong'", "allowed are units")),
        ({"unit": ""}, ("unit ''",)),
        ({"unit": "1/"}, ("unit '1/'",)),
        ({"low": 0.5}, ("range 0.5 .. 1.0", "low <= 0 <= high")),
        ({"low": 0.0, "high": 0.0}, ("low < high",)),
        ({"high": float("inf")}, ("finite",)),
        ({"high": float("nan")}, ("range 0.0 .. nan",)),
        ({"varies_with": ("weather",)}, ("varies_with weather", "pressure")),
        ({"components": 0}, ("components 0",)),
    ],
)
def test_a_wrong_declaration_is_refused_with_file_line_and_what_is_allowed(
    changes: dict[str, Any], words: tuple[str, ...]
) -> None:
    with pytest.raises(ParameterError) as caught:
        made(softer, **changes)
    line = softer.__code__.co_firstlineno
    for word in ("'mine'", "test_effect.py", f"line {line}", *words):
        assert word in str(caught.value)


def test_all_faults_of_a_declaration_come_at_once() -> None:
    with pytest.raises(ParameterError, match=r"(?s)stage.*unit.*range"):
        made(softer, stage="x", unit="x", low=1.0)


@pytest.mark.parametrize(
    "unit", ["1", "1/MN", "mm^2", "kg m", "deg/kN", "ustrain", "N m^2", "1/m^2"]
)
def test_units_may_be_products_of_known_ones(unit: str) -> None:
    assert made(softer, unit=unit).unit == unit


def test_title_is_the_docstrings_first_line_and_the_step_points_to_the_wider_side() -> None:
    found = made(softer, low=-2.0)
    assert found.title == "Softer sidewall."
    assert found.step == pytest.approx(-2e-3)
    assert found.toward == -2.0
    assert found.scale == 2.0
    assert made(softer).trials == (1e-3,)


def test_several_components_take_a_sequence_and_one_takes_a_number() -> None:
    two = CATALOGUE["nonuniformity"]
    assert two.trials == ((0.3, 0.0), (0.0, 0.3))
    assert two.at((1.0, 2.0))[0] == "gage"
    with pytest.raises(ParameterError, match=r"1 numbers, 3\.0; 2 are needed, in ustrain"):
        two.at(3.0)
    with pytest.raises(ParameterError, match="2 numbers"):
        made(softer).at((1.0, 2.0))


def fails(state: State, strength: float) -> State:
    half = 1 / int(strength)
    return state.but(k_u=state.k_u * half)


def forgets(state: State, strength: float) -> None:
    state.but(k_u=state.k_u * strength)


def fails_below(state: State, strength: float) -> State:
    worse = np.linalg.inv(np.zeros((2, 2)))
    return state.but(k_u=state.k_u * worse)


LAWS: list[tuple[Any, tuple[str, ...]]] = [
    (fails, ("raised ZeroDivisionError", f"line {fails.__code__.co_firstlineno + 1}")),
    (fails_below, ("LinAlgError", f"line {fails_below.__code__.co_firstlineno + 1} ")),
    (forgets, ("returned NoneType", "return state.but(...)")),
    (lambda s, x: s.but(k_u=s.k_u * np.nan), ("k_u is not a number", "point 0")),
    (lambda s, x: s.but(k_u=5.0), ("k_u has shape ()", "(3,) is needed")),
    (lambda s, x: s.but(k_u=s.k_u[:2]), ("k_u has shape (2,)",)),
    (lambda s, x: s.but(k_u=s.k_u * 1j), ("k_u is complex",)),
    (lambda s, x: s.but(k_u=s.k_u > 0), ("k_u holds bool",)),
    (lambda s, x: s.but(stiffness=1.0), ("TypeError",)),
]


@pytest.mark.parametrize(("law", "words"), LAWS)
def test_a_broken_law_is_named_with_file_line_and_strength(
    law: Any, words: tuple[str, ...]
) -> None:
    with pytest.raises(ParameterError) as caught:
        run(made(law).at(0.5))
    for word in ("effect 'mine'", "test_effect.py", *words, "correct the law"):
        if word == "correct the law" and law is forgets:
            continue
        assert word in str(caught.value)


def test_an_error_of_the_ring_keeps_its_kind_and_says_where_it_came_from() -> None:
    def refuses(state: State, strength: float) -> State:
        raise ConvergenceError("contact: no", None, 1.0)

    with pytest.raises(ConvergenceError) as caught:
        run(made(refuses).at(0.5))
    assert "effect 'mine'" in caught.value.__notes__[0]


def test_infinite_stiffness_may_stay_infinite() -> None:
    assert np.isinf(run(made(lambda s, x: s.but(EA=s.EA * 2.0)).at(0.5)).EA).all()


def test_a_condition_that_is_needed_and_not_measured_is_named() -> None:
    unknown = POINTS.take(np.arange(3))
    assert CATALOGUE["belt_bending"].unknown(unknown) == ()
    unknown.side_force[1] = np.nan
    bending = CATALOGUE["belt_bending"]
    assert bending.unknown(unknown) == ("side_force",)
    with pytest.raises(ParameterError, match="'belt_bending' needs side_force"):
        run(bending.at(0.1), unknown)
