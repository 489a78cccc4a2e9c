"""Errors of a law on strain: how large they are, where they act, and with what they go."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import TIRE, operating
from tirelib.effects.state import State
from tirelib.inference.identify.discrepancy import REFERENCE_OMEGA
from tirelib.inference.problems.strain_laws import (
    LARGER,
    as_large,
    beside,
    law_errors,
    stiffened,
)
from tirelib.measured.waveforms import GRID
from tirelib.model.base import PLAIN, values_of

LOAD = np.array([2000.0, 4000.0, 6000.0])
POINTS = operating(LOAD, np.full(3, 2.2e5))
HALF = np.array([0.12, 0.16, 0.2])
BUMP = np.exp(-0.5 * (GRID / (0.5 * HALF[:, None])) ** 2)


def share_outside(row: np.ndarray, errors: np.ndarray) -> float:
    """Return the share of a row that no mixture of errors makes."""
    flat = errors.reshape(len(errors), -1).T
    found = np.linalg.lstsq(flat, row.ravel(), rcond=1e-6)[0]
    return float(np.linalg.norm(row.ravel() - flat @ found) / np.linalg.norm(row))


def test_components_that_oppose_each_other_are_off_by_what_they_leave() -> None:
    rows = np.stack([BUMP, 1.1 * BUMP])
    scaled = as_large(rows, np.array([1.0, -1.0]))
    left = np.sqrt(np.mean((0.1 * BUMP) ** 2))
    assert np.sqrt(np.mean(scaled**2, axis=(1, 2))) == pytest.approx([left, left])


def test_one_component_is_off_by_a_share_of_what_it_does() -> None:
    assert as_large(BUMP[None], np.array([-0.3]))[0] == pytest.approx(0.3 * BUMP)


def likely(row: np.ndarray, errors: np.ndarray) -> float:
    """Return the size of the errors that make a row but for its mean, which no gage measures."""
    row = row - row.mean(axis=1, keepdims=True)
    flat = errors.reshape(len(errors), -1).T
    left = np.linalg.svd(flat, full_matrices=False)
    size = 0.01 * np.linalg.norm(row)
    damped = left.S**2 + size**2
    found = left.Vh.T @ (left.S / damped * (left.U.T @ row.ravel()))
    assert np.linalg.norm(row.ravel() - flat @ found) < 0.05 * np.linalg.norm(row)
    return float(np.sqrt(np.sum(found**2)))


def between(start: float, end: float) -> np.ndarray:
    """Return what acts between two places, in half contacts, and ends sharply."""
    place = GRID / HALF[:, None]
    return 0.5 * (np.tanh((place - start) / 0.1) - np.tanh((place - end) / 0.1))


@pytest.mark.parametrize("shift", [(0.05, 0.0), (0.0, 0.05), (0.05, 0.05)])
def test_each_edge_of_what_an_effect_does_may_be_displaced(shift: tuple[float, float]) -> None:
    """As the place where a tread begins to slide, which no law knows exactly."""
    row, moved = between(-0.5, 0.5), between(-0.5 + shift[0], 0.5 + shift[1])
    assert likely(moved - row, law_errors(row[None], HALF, POINTS, 3)) < 1.5


def test_the_error_of_an_edge_is_as_sharp_as_the_edge() -> None:
    change = between(-0.5, 0.52) - between(-0.5, 0.5)
    change = change - change.mean(axis=1, keepdims=True)
    sharp, smooth = (
        share_outside(change, law_errors(row[None], HALF, POINTS, 3))
        for row in (between(-0.5, 0.5), BUMP)
    )
    assert sharp < 0.1
    assert smooth > 2.0 * sharp


@pytest.mark.parametrize("condition", ["", "load", "speed"])
def test_an_effect_may_be_larger_in_one_place(condition: str) -> None:
    points = replace(POINTS, omega=POINTS.omega * np.array([0.7, 1.2, 0.9]))
    errors = law_errors(BUMP[None], HALF, points, 3)
    larger = BUMP * np.exp(-0.5 * ((GRID - 0.5 * HALF[:, None]) / (0.3 * HALF[:, None])) ** 2)
    if condition:
        by = np.log(LOAD) if condition == "load" else (points.omega / REFERENCE_OMEGA) ** 2
        larger = larger * (by - by.mean())[:, None]
    assert likely(larger, errors) < 2.5


def test_a_law_may_do_nothing_where_the_tire_does() -> None:
    """Just ahead of what an effect does, there may be something as well."""
    row = between(-0.5, 0.5)
    ahead = np.exp(-0.5 * ((GRID / HALF[:, None] + 1.2) / 0.3) ** 2)
    ahead = ahead - ahead.mean(axis=1, keepdims=True)
    assert share_outside(ahead, law_errors(row[None], HALF, POINTS, 3)) < 0.3


def test_a_law_may_be_off_in_each_place_by_what_it_does_there() -> None:
    """A sharp effect has sharp errors: its part in a place ends where the effect does."""
    errors = law_errors(between(-0.5, 0.5)[None], HALF, POINTS, 3)
    for place in (-0.4, 0.0, 0.4):
        part = between(-0.5, 0.5) * np.exp(-0.5 * ((GRID / HALF[:, None] - place) / 0.2) ** 2)
        assert likely(part, errors) < 1.0


def test_a_narrow_effect_has_errors_in_few_places() -> None:
    narrow, wide = (
        law_errors(
            np.exp(-0.5 * (GRID / width) ** 2)[None, None] * np.ones((1, 3, 1)), HALF, POINTS, 3
        )
        for width in (0.05, 1.0)
    )
    assert len(narrow) < 0.7 * len(wide)


def test_an_effect_may_be_sharper() -> None:
    errors = law_errors(BUMP[None], HALF, POINTS, 3)
    sharper = np.exp(-0.5 * (GRID / (0.45 * HALF[:, None])) ** 2) / 0.9
    assert share_outside(sharper - BUMP, errors) < 0.15


def test_an_effect_may_go_otherwise_with_load_about_its_mean() -> None:
    with_load = law_errors(BUMP[None], HALF, POINTS, 3)[0]
    factor = np.log(LOAD) - np.log(LOAD).mean()
    assert with_load == pytest.approx(LARGER * factor[:, None] * BUMP)


def test_an_effect_may_level_off_with_load() -> None:
    load = np.linspace(2000.0, 6000.0, 9)
    half = np.full(9, 0.15)
    rows = np.exp(-0.5 * (GRID / (0.5 * half[:, None])) ** 2)
    errors = law_errors(rows[None], half, operating(load, np.full(9, 2.2e5)), 9)
    levels_off = np.tanh((load - 2500.0) / 1000.0)[:, None] * rows
    slope = share_outside(levels_off, np.stack([rows, errors[0]]))
    curvature = share_outside(levels_off, np.stack([rows, errors[0], errors[4]]))
    assert curvature < 0.5 * slope


def test_errors_of_runs_ahead_count_from_the_mean_of_those_that_are_measured() -> None:
    two = law_errors(BUMP[None], HALF, POINTS, 2)
    factor = np.log(LOAD) - np.log(LOAD[:2]).mean()
    assert two[0] == pytest.approx(LARGER * factor[:, None] * BUMP)
    # a run ahead in which the effect acts elsewhere changes no error of those that are measured
    other = BUMP.copy()
    other[2] = np.exp(-0.5 * ((GRID - 2.0) / 0.2) ** 2)
    there = law_errors(other[None], HALF, POINTS, 2)
    assert there[:, :2] == pytest.approx(two[:, :2])


def test_a_law_may_be_wrong_opposite_to_the_contact() -> None:
    """What a heavy spot does, and gets wrong, ends nowhere."""
    turn = np.cos(GRID) * np.ones((3, 1))
    errors = law_errors(turn[None], HALF, POINTS, 3)
    far = np.exp(-0.5 * ((GRID - 2.3) / 0.4) ** 2) * np.ones((3, 1))
    assert share_outside(far - far.mean(), errors) < 0.25


def test_errors_grow_with_the_effect() -> None:
    one, three = (law_errors(k * BUMP[None], HALF, POINTS, 3) for k in (1.0, 3.0))
    assert three == pytest.approx(3.0 * one)


def test_a_law_of_one_stiffness_is_off_by_what_else_that_part_of_the_tire_is_made_of() -> None:
    state = State.of(values_of(TIRE), POINTS, GRID)
    soft = np.array([0.9, 1.0, 1.1])
    random = np.random.default_rng(3)
    slopes = random.standard_normal((len(PLAIN), 3, GRID.size))
    for change, part, stiffness, others in (
        (
            {"k_t": state.k_t * soft},
            "tread",
            "tread_stiffness",
            ("tread_poisson", "tread_shear_stiffness"),
        ),
        (
            {"k_u": state.k_u * soft},
            "sidewall",
            "radial_stiffness",
            ("tangential_stiffness", "section_pull"),
        ),
    ):
        found = stiffened(state, state.but(**change))
        assert list(found) == [part]
        assert found[part] == pytest.approx(np.log(soft))
        names = [coordinate.name for coordinate in PLAIN]
        own = np.log(soft)[:, None] * slopes[[names.index(stiffness)]]
        errors = beside(slopes, PLAIN, part, found[part], own, 3)
        # the effect itself is no error of its law
        assert share_outside(own, errors) == pytest.approx(1.0)
        for name in others:
            # a constant of the same part changes run by run, as the stiffness does
            row = np.log(soft)[:, None] * slopes[names.index(name)]
            assert share_outside(row, np.concatenate([errors, own])) < 1e-6
        belt = np.log(soft)[:, None] * slopes[names.index("shear_stiffness")]
        assert share_outside(belt, errors) > 0.9


def test_a_law_that_makes_nothing_stiffer_has_no_such_error() -> None:
    state = State.of(values_of(TIRE), POINTS, GRID)
    assert stiffened(state, state.but(tension=state.tension + 100.0)) == {}
    # a sidewall without a tangential stiffness has none to change
    bare = state.but(k_v=0.0 * state.k_v)
    assert stiffened(bare, bare.but(tension=state.tension + 100.0)) == {}
    found = stiffened(bare, bare.but(k_u=0.5 * bare.k_u, k_v=0.5 * bare.k_v))
    assert found["sidewall"] == pytest.approx(np.full(3, np.log(0.5)))


def test_a_run_ahead_changes_no_error_of_the_runs_that_are_measured() -> None:
    random = np.random.default_rng(4)
    slopes = random.standard_normal((len(PLAIN), 3, GRID.size))
    change, rows = np.array([-0.1, 0.0, 0.2]), random.standard_normal((1, 3, GRID.size))
    three = beside(slopes, PLAIN, "tread", change, rows, 2)
    two = beside(slopes[:, :2], PLAIN, "tread", change[:2], rows[:, :2], 2)
    assert three[:, :2] == pytest.approx(two)
