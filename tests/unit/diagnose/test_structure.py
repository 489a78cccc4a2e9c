"""The covariance of what a ring leaves, the scores in it, and the power told of them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.arrays import FloatArray
from tirelib.diagnose.ranking import Ranking
from tirelib.diagnose.shape import LEAST, filled, finer, moved
from tirelib.diagnose.structure import Structure

SAMPLES, MEMBERS, NOISE = 40, 6, 0.5
NONE = np.zeros((1, 0, SAMPLES))


@pytest.fixture
def parts() -> tuple[FloatArray, ...]:
    """Return variants, slopes, parts, candidates' rows, and parts of four runs each."""
    random = np.random.default_rng(1)
    rows = [random.standard_normal((n, SAMPLES)) for n in (MEMBERS, 3, 2, 4)]
    return (*rows, random.standard_normal((4, 2, SAMPLES // 4)))


def dense(structure: Structure, without: int | None = None) -> FloatArray:
    """Return C as a matrix."""
    spread = structure.spread
    rows = structure.projected(spread.mixed(np.eye(len(spread))))
    if without is not None:
        rows = np.delete(rows, without, axis=0)
    return NOISE**2 * np.eye(SAMPLES) + rows.T @ rows


def test_normal_equations_are_those_of_the_whole_covariance(parts: Any) -> None:
    members, free, form, rows, each = parts
    structure = Structure(members, members, NOISE, free, form, each)
    residual = np.random.default_rng(2).standard_normal(SAMPLES)
    normal = structure.normal(rows, residual)
    inverse = np.linalg.inv(dense(structure))
    own, rest = structure.projected(rows), structure.projected(residual)
    assert normal.gram == pytest.approx(own @ inverse @ own.T)
    assert normal.right == pytest.approx(own @ inverse @ rest)
    assert normal.square == pytest.approx(rest @ inverse @ rest)
    assert structure.beyond(residual[None])[0] == pytest.approx(NOISE**2 * inverse @ rest)


def test_what_the_fitted_numbers_can_do_counts_nothing(parts: Any) -> None:
    members, free, form, rows, each = parts
    structure = Structure(members, members, NOISE, free, form, each)
    assert structure.normal(rows, free[0] - 2.0 * free[2]).square == pytest.approx(0.0, abs=1e-9)


def test_a_measured_variant_is_judged_by_the_others(parts: Any) -> None:
    members, free, form, rows, each = parts
    measured = members + np.random.default_rng(6).standard_normal(members.shape)
    structure = Structure(members, measured, NOISE, free, form, each)
    third = structure.of_members(rows)[2]
    inverse = np.linalg.inv(dense(structure, 2))
    rest = structure.projected(measured[2])
    assert third.square == pytest.approx(rest @ inverse @ rest)
    assert third.right == pytest.approx(structure.projected(rows) @ inverse @ rest)


def test_more_of_what_structure_does_costs_less_than_the_same_of_what_it_never_does() -> None:
    often = np.zeros(SAMPLES)
    often[0] = 1.0
    never = np.roll(often, 1)
    empty = np.zeros((0, SAMPLES))
    variants = 10.0 * np.tile(often, (MEMBERS, 1))
    structure = Structure(variants, variants, NOISE, np.eye(1, SAMPLES, 30), empty, NONE)
    assert structure.normal(empty, never).square == pytest.approx(1.0 / NOISE**2)
    assert structure.normal(empty, often).square == pytest.approx(1.0 / (NOISE**2 + 100.0))


def ranking(
    members: FloatArray, *rows: FloatArray, twins: tuple[int, int] | None = None
) -> Ranking:
    """Return the ranking of made candidates of one run."""
    names = [f"e{k}" for k in range(len(rows))]
    living = [
        SimpleNamespace(effect=SimpleNamespace(name=name, scale=2.0), own=row[None])
        for name, row in zip(names, rows, strict=True)
    ]
    pairs = {twins[0]: twins[1], twins[1]: twins[0]} if twins else {}
    found = SimpleNamespace(
        living=living, twins=lambda k: [(names[pairs[k]], 0.1)] if k in pairs else []
    )
    model = SimpleNamespace(whiten=lambda x: x, waveform=np.zeros((1, SAMPLES)))
    free, none = np.eye(1, SAMPLES, SAMPLES - 1), np.zeros((0, SAMPLES))
    return Ranking(model, found, Structure(members, members, NOISE, free, none, NONE))


def test_the_score_is_the_misfit_that_returns_and_the_strength_is_found() -> None:
    random = np.random.default_rng(3)
    rows = 30.0 * random.standard_normal((3, SAMPLES))
    rows[:, -1] = 0.0
    scores = ranking(0.1 * random.standard_normal((MEMBERS, SAMPLES)), *rows).scores(
        0.4 * rows[1][None]
    )
    assert int(np.argmax(scores.score)) == 1
    assert scores.strength[1][0] == pytest.approx(0.8, rel=0.01)
    assert scores.score[1] == pytest.approx(scores.misfit, rel=0.15)
    assert scores.after < 0.05 * scores.misfit


def test_twins_do_not_take_each_others_score() -> None:
    random = np.random.default_rng(4)
    first = 30.0 * random.standard_normal(SAMPLES)
    second = first + 0.3 * random.standard_normal(SAMPLES)
    first[-1] = second[-1] = 0.0
    members = 0.1 * random.standard_normal((MEMBERS, SAMPLES))
    apart = ranking(members, first, second, twins=(0, 1)).scores(0.4 * first[None])
    together = ranking(members, first, second).scores(0.4 * first[None])
    assert apart.score.min() > 0.9 * apart.misfit
    assert together.score.max() < 0.5 * apart.score.min()


def test_the_power_is_that_of_planting_the_effect_in_every_variant() -> None:
    random = np.random.default_rng(5)
    rows = 3.0 * random.standard_normal((2, SAMPLES))
    rows[:, -1] = 0.0
    members = random.standard_normal((MEMBERS, SAMPLES))
    made = ranking(members, *rows)
    told = made.planted(1, 0.3)
    structure = made.structure
    for m in range(MEMBERS):
        inverse = np.linalg.inv(dense(structure, m))
        rest = structure.projected(members[m] + 0.3 * rows[1])
        own = structure.projected(rows)
        normal = np.linalg.inv(own @ inverse @ own.T + np.eye(2))
        weights = normal @ (own @ inverse @ rest)
        assert told[m] == pytest.approx(weights[1] ** 2 / normal[1, 1])


def test_a_law_may_give_something_where_the_own_gives_nothing() -> None:
    shape = np.array([3.0, 4.0])
    change = np.outer([0.0, 1.0, 2.0], shape)
    out = filled(change)
    assert out[1:] == pytest.approx(change[1:])
    typical = float(np.sqrt(np.mean(np.sum(change**2, axis=1))))
    assert out[0] == pytest.approx(LEAST * typical * shape / 5.0)
    assert filled(0.0 * change) == pytest.approx(0.0)


def test_another_power_of_the_wave_number_is_what_a_law_may_be_off_by() -> None:
    angle = np.linspace(-np.pi, np.pi, SAMPLES, endpoint=False)
    change = np.cos(2.0 * angle) + np.cos(8.0 * angle)
    # 2 and 8 are as far from their mean, 4: one falls, the other grows
    assert finer(change[None])[0] == pytest.approx(np.cos(8.0 * angle) - np.cos(2.0 * angle))


def test_an_effect_at_another_place_differs_by_its_slope() -> None:
    angle = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    change = np.stack([np.sin(3.0 * angle), 5.0 * np.sin(angle)])
    expected = np.stack([np.cos(3.0 * angle), 5.0 * np.cos(angle)])
    assert moved(change) == pytest.approx(expected)
    assert np.all(moved(np.zeros((2, SAMPLES))) == 0.0)
