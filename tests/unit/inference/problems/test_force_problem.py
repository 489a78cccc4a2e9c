"""The problem of forces: slopes, dead effects, whitening, and planted effects in plain tires."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.unit.inference.force_points import force_problem
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, effect
from tirelib.inference.problems.whiten_forces import PointWhitener
from tirelib.inference.statistics.plain import Family
from tirelib.inference.statistics.posterior import posterior
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.select import select

NAMES = ("ring_pressure", "carcass", "friction_load", "brush_camber", "stiffness_drift")
STRENGTHS = ([0.3], [0.004], [0.1], [0.1], [0.1, 0.05])


@pytest.mark.parametrize("quantity", ["Fy", "Mz"])
def test_slopes_are_those_of_differences_with_a_carcass_that_turns(quantity: str) -> None:
    made = force_problem(cambers=(0.0, 0.05), quantity=quantity)
    effects = tuple(CATALOGUE[name] for name in NAMES)
    base = 0.05 * np.arange(1.0, len(made.names) + 1.0)
    point = Point(base, effects, tuple(np.array(s) for s in STRENGTHS))
    solved = made.solve(point)
    found, step, row = made.slopes(point, solved), 1e-5, 0
    for k in range(base.size):
        there = replace(point, base=base + step * (np.arange(base.size) == k))
        wanted = (made.solve(there).force - solved.force) / step
        np.testing.assert_allclose(found[row], wanted, atol=1e-3 * np.abs(wanted).max())
        row += 1
    for k, each in enumerate(effects):
        for j in range(each.components):
            strengths = [s.copy() for s in point.strengths]
            strengths[k][j] += step * each.scale
            there = replace(point, strengths=tuple(strengths))
            wanted = (made.solve(there).force - solved.force) / step
            np.testing.assert_allclose(found[row], wanted, atol=1e-3 * np.abs(wanted).max())
            row += 1


def test_dead_effects_are_told_with_the_condition_that_is_missing() -> None:
    made = force_problem()
    assert made.dead["friction_speed"] == "no run varies speed"
    assert made.dead["friction_temperature"].startswith("tread temperature is not measured")
    assert made.dead["brush_camber"] == "no run varies camber"
    assert made.dead["relaxation"].startswith("changes Fy at no point")
    living = {each.name for each in made.living}
    assert {"friction_load", "friction_pressure", "stiffness_pressure"} <= living
    assert not living & set(made.dead)


@pytest.mark.parametrize("speeds", [(20.0,), (10.0, 20.0)])
def test_a_plan_that_cannot_show_an_effect_says_what_it_lacks(speeds: tuple[float, ...]) -> None:
    dead = force_problem(speeds=speeds).dead
    assert dead["ply_steer"].startswith("no run rolls the other way")
    assert dead["combined_slip"] == "no run has a slip angle and a slip ratio at once"


def test_whitened_rows_have_the_covariance_of_noise_and_of_set_points_off_in_a_block() -> None:
    made = force_problem()
    whiten = made.whitener(0.004)
    n = made.measured.size
    eye = whiten.coloured(np.eye(n))
    covariance = eye.T @ eye
    np.testing.assert_allclose(whiten(eye), np.eye(n), atol=1e-9)
    block = made.bench.points.data.block
    assert np.all(covariance[block[:, None] != block] == 0.0)
    assert np.all(np.diag(covariance) > made.noise**2)
    assert whiten.log_volume == pytest.approx(-0.5 * np.linalg.slogdet(covariance)[1])


@pytest.mark.parametrize("size", [0.0, 1.0])
def test_whitening_undoes_noise_set_points_and_a_misfit_that_near_points_share(size: float) -> None:
    """Points at one place have the same misfit; those of another block have nothing of it."""
    random = np.random.default_rng(0)
    noise, rows = random.uniform(2.0, 30.0, 12), random.standard_normal((3, 12))
    tangent, amount = 20.0 * size * random.standard_normal((12, 2)), size * np.full(12, 15.0)
    block = np.repeat([1, 0, 1], 4)
    whiten = PointWhitener.of(block, tangent, np.zeros(12), amount, noise=noise)
    shared = tangent @ tangent.T + np.outer(amount, amount)
    covariance = np.diag(noise**2) + shared * (block[:, None] == block)
    drawn = whiten.coloured(np.eye(12))
    np.testing.assert_allclose(drawn.T @ drawn, covariance, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(whiten(whiten.coloured(rows)), rows, atol=1e-9)
    assert whiten.log_volume == pytest.approx(-0.5 * np.linalg.slogdet(covariance)[1])


def test_shapes_are_what_the_base_cannot_mimic() -> None:
    made = force_problem()
    solved = made.solve(made.start)
    shapes = made.remainder(made.start, solved)["constant, slip"] / made.size
    slopes = made.slopes(made.start, solved) / made.size
    assert np.abs(shapes @ slopes.T).max() < 1e-6 * np.linalg.norm(slopes)


def test_a_planted_strength_comes_back_with_its_interval() -> None:
    made = force_problem(friction_power=-0.15)
    fit = posterior(made, [CATALOGUE["friction_load"]], {}, made.whitener(0.0005))
    assert fit.strengths[0][0] == pytest.approx(0.15, abs=4.0 * fit.std(0)[0])
    assert fit.std(0)[0] < 0.02


def quiet(name: str, seed: int, rows: dict[str, int]) -> Family:
    """Return a family whose tires show hardly anything."""
    random = np.random.default_rng(seed)
    size = np.array([1e-3 if "," in block else 5e-3 for block in rows])
    draws = random.standard_normal((40, sum(rows.values()))) * np.repeat(size, list(rows.values()))
    ends = np.cumsum([0, *rows.values()])
    squares = np.stack([np.mean(draws[:, a:b] ** 2, axis=1) for a, b in pairwise(ends)], 1)
    return Family(name, 0.0005, rows, draws, squares)


def test_friction_over_load_is_named_and_a_tire_without_it_lacks_nothing() -> None:
    for power, sets in ((-0.15, (("friction_load",),)), (0.0, ())):
        some = [CATALOGUE[name] for name in ("friction_load", "stiffness_load", "conicity")]
        made = force_problem(friction_power=power, catalogue=some)
        rows = {each.name: each.components for each in made.living}
        shapes = made.remainder(made.start, made.solve(made.start))
        rows |= {name: len(block) for name, block in shapes.items()}
        with one_thread():
            found = select(made, [quiet("one", 1, rows), quiet("other", 2, rows)])
        assert found.sets == sets, (found.kind, found.base.against)


def test_a_law_of_the_users_own_is_a_candidate() -> None:
    @effect("grip", stage="brush", unit="1", low=-1.0, high=1.0, varies_with=("load",), source="t")
    def grip(state: object, strength: float) -> object:
        "Friction over load once more."
        return CATALOGUE["friction_load"].law(state, -2.0 * strength)

    made = force_problem(catalogue=[CATALOGUE["friction_load"], grip])
    solved = made.solve(made.start)
    point = replace(made.start, effects=made.living, strengths=(np.zeros(1), np.zeros(1)))
    ours, users = made.slopes(point, solved)[-2:]
    scale = -2.0 * grip.scale / CATALOGUE["friction_load"].scale
    np.testing.assert_allclose(users, scale * ours, rtol=1e-4, atol=1e-6)


def test_a_laws_error_is_as_large_as_what_all_effects_do_and_goes_with_pairs_of_conditions() -> (
    None
):
    made = force_problem()
    at, size = made.bench.conditions, made.size
    effects = [CATALOGUE["friction_load"], CATALOGUE["friction_pressure"]]
    large, small = (0.1 * size * np.sign(made.slip))[None], (1e-6 * size)[None]
    base = made.start.base
    solved = made.solve(made.start)
    slopes = np.concatenate([np.zeros((len(base), *large.shape[1:])), large, small])

    def errors(times: float, count: int = 2) -> Sequence[FloatArray]:
        scales = [times * effects[0].scale, effects[1].scale]
        point = Point(base, tuple(effects), tuple(np.array([s]) for s in scales))
        return made.roughly(point, solved, slopes, count)

    alone, both = errors(1.0, 1), errors(1.0)
    np.testing.assert_allclose(both[0], alone[0], rtol=1e-6)
    # the small one's law is off by as much as the large one's
    strength = [np.sqrt(np.mean(np.sum(rows**2, axis=0))) for rows in both]
    assert strength[1] == pytest.approx(strength[0], rel=0.5)
    double = errors(2.0)
    np.testing.assert_allclose(double[0], 2.0 * both[0], rtol=1e-6)
    # friction over pressure that goes with the load, on one side of the slip
    pair = size * (at.pressure / np.median(at.pressure) - 1.0) * np.log(at.load / 4e3)
    pair = pair * (made.slip > 0.5)
    for rows, least, most in ((both[1], 0.0, 0.2), (alone[0][: 7 * 2], 0.8, 1.0)):
        left = pair - np.linalg.lstsq(rows.T, pair, rcond=None)[0] @ rows
        assert least <= np.linalg.norm(left) / np.linalg.norm(pair) <= most
