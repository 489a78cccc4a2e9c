"""Parts of a diagnosis of forces: folds, dead effects, twins, the bounded ranking, what is left."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.unit.force_points import ANGLES, LOADS, MODEL, PRESSURES, VALUES
from tirelib.brush.predict import PointConditions, PointParameters, predict_forces
from tirelib.diagnose.forces.candidates import force_candidates
from tirelib.diagnose.forces.ensemble import force_ensemble
from tirelib.diagnose.forces.fit import ForceFit, Problem, fit_force
from tirelib.diagnose.forces.held_out import ForceFold, force_folds, pooled
from tirelib.diagnose.forces.left import left_of
from tirelib.diagnose.forces.ranking import ForceRanking
from tirelib.effects import CATALOGUE, effect
from tirelib.identify.force_data import ForceData
from tirelib.identify.force_points import force_points


def problem(
    loads: tuple[float, ...] = LOADS,
    pressures: tuple[float, ...] = PRESSURES,
    friction_power: float = 0.0,
    noise: float = 5.0,
) -> Problem:
    grid = np.meshgrid(ANGLES, loads, pressures, [0, 1], indexing="ij")
    alpha, load, pressure, _ = (x.ravel() for x in grid)
    n = alpha.size
    nothing, flat = np.full(n, np.nan), np.zeros(n)
    brush = PointParameters(8e6, 0.95 * (load / 4e3) ** friction_power, 0.06 * (load / 4e3) ** 0.5)
    side = predict_forces(brush, PointConditions(load, alpha)).Fy
    side = side + noise * np.random.default_rng(1).standard_normal(n)
    data = ForceData(
        load,
        pressure,
        alpha,
        flat,
        flat,
        nothing,
        nothing,
        side,
        nothing,
        np.arange(n),
        np.full(n, 20.0),
    )
    return Problem.of(MODEL.bench(force_points(data)), "Fy", noise)


@pytest.fixture(scope="module")
def plain() -> tuple[Problem, ForceFit]:
    made = problem()
    return made, fit_force(made, VALUES)


def test_dead_effects_are_told_with_the_condition_that_is_missing(
    plain: tuple[Problem, ForceFit],
) -> None:
    found = force_candidates(*plain, list(CATALOGUE.values()))
    assert found.dead["friction_speed"] == "no run varies speed"
    assert found.dead["friction_temperature"].startswith("tread temperature is not measured")
    assert found.dead["brush_camber"] == "no run varies camber"
    assert found.dead["relaxation"].startswith("changes Fy at no point")
    assert "one way only" in problem_with_speeds()
    assert {"friction_load", "friction_pressure", "stiffness_pressure"} <= set(found.names)
    assert not set(found.names) & set(found.dead)


def problem_with_speeds() -> str:
    """Why a tire that rolls one way at two speeds cannot show ply steer."""
    made = problem()
    at = made.bench.conditions
    speed = np.where(np.arange(len(at)) % 4 < 2, 10.0, 20.0)
    made = replace(made, bench=replace(made.bench, conditions=replace(at, speed=speed)))
    return force_candidates(made, fit_force(made, VALUES), [CATALOGUE["ply_steer"]]).dead[
        "ply_steer"
    ]


def test_an_effect_of_the_same_law_is_a_twin(plain: tuple[Problem, ForceFit]) -> None:
    @effect("sticky", stage="brush", unit="1", low=-1, high=1, varies_with=("load",), source="test")
    def sticky(state: object, strength: float) -> object:
        "Friction over load once more."
        return CATALOGUE["friction_load"].law(state, -2.0 * strength)

    found = force_candidates(*plain, [CATALOGUE["friction_load"], sticky])
    ((name, angle),) = found.twins(0)
    assert name == "sticky"
    assert angle < 1e-3


def test_what_could_not_be_true_does_not_hide_what_is() -> None:
    # measured: friction that falls with load
    other = problem(friction_power=-0.15)
    fitted = fit_force(other, VALUES)

    @effect(
        "wrong", stage="brush", unit="1", low=0.0, high=1.0, varies_with=("load",), source="test"
    )
    def wrong(state: object, strength: float) -> object:
        "The same law with the other sign, which its range rules out."
        return CATALOGUE["friction_load"].law(state, -strength)

    found = force_candidates(other, fitted, [CATALOGUE["friction_load"], wrong])
    scores = ForceRanking(other, fitted, found).scores(other.measured - fitted.predicted)
    assert scores.strength[1][0] == pytest.approx(0.0, abs=1e-6)
    assert scores.share[0] > 10.0
    assert scores.share[1] == pytest.approx(0.0, abs=1e-6)
    assert scores.inside.all()
    alone = force_candidates(other, fitted, [wrong])
    quiet = ForceRanking(other, fitted, alone).scores(other.measured - fitted.predicted)
    assert quiet.share[0] == pytest.approx(0.0, abs=1e-6)


def test_the_score_is_what_comes_back_when_an_effect_is_taken_out() -> None:
    made = problem(friction_power=-0.15)
    base = fit_force(made, VALUES)
    found = force_candidates(made, base, list(CATALOGUE.values()))
    ranking = ForceRanking(made, base, found)
    rest = made.measured - base.predicted
    scores = ranking.scores(rest)
    first = found.names.index("friction_load")
    fewer = force_candidates(
        made, base, [c.effect for i, c in enumerate(found.living) if i != first]
    )
    without = ForceRanking(made, base, fewer).scores(rest)
    back = (without.after**2 - scores.after**2) / scores.after
    assert scores.score[first] == pytest.approx(back, rel=1e-6)


def test_variants_differ_from_each_other_and_from_seed_to_seed_but_not_within_one(
    plain: tuple[Problem, ForceFit],
) -> None:
    found = force_candidates(*plain, list(CATALOGUE.values()))
    ranking = ForceRanking(*plain, found)
    one, same, other = (
        force_ensemble(*plain, ranking, noise=5.0, members=4, seed=seed) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.scores, same.scores)
    assert not np.array_equal(one.scores, other.scores)
    assert np.ptp(one.before) > 0.0
    assert (one.threshold >= one.scores).all()


def test_steady_runs_hold_out_their_highest_set_points() -> None:
    folds = force_folds(problem())
    assert [fold.name for fold in folds] == ["load"]  # two pressures: none can be spared
    assert (folds[0].value, folds[0].main) == (6e3, True)


def test_cells_are_held_out_where_no_set_point_can_be_spared() -> None:
    made = problem(loads=(2e3, 4e3))
    folds = force_folds(made)
    assert [fold.name for fold in folds] == ["cell"] * 4
    # each point once, repeats of a cell together
    out = np.stack([fold.out for fold in folds])
    assert (out.sum(axis=0) == 1).all()
    cell = made.bench.points.cell
    for k in np.unique(cell):
        assert len({tuple(column) for column in out[:, cell == k].T}) == 1


def test_the_held_out_error_is_over_the_points_of_the_folds_that_count() -> None:
    few, many = np.arange(10) < 2, np.arange(10) >= 2
    folds = (
        ForceFold("time", 0.0, few, main=True),
        ForceFold("time", 1.0, many, main=True),
        ForceFold("load", 0.0, few, main=False),
    )
    assert pooled((3.0, 1.0, 99.0), folds) == pytest.approx(np.sqrt((2 * 9.0 + 8 * 1.0) / 10.0))
    assert np.isnan(pooled((3.0, float("nan"), 1.0), folds))
    assert np.isnan(pooled((), ()))


def test_what_is_left_is_told_by_slip_and_load_with_a_guess() -> None:
    made = problem(friction_power=-0.15)
    base = fit_force(made, VALUES | {"friction": 0.95})
    left = left_of(made, base)
    assert left.guess is not None
    assert "ln load" in left.guess
    taken = re.search(r"takes away (\d+) %", left.guess)
    assert taken is not None
    assert int(taken[1]) >= 20
    assert "all of the contact slides" in left.where or "gives way" in left.where
    assert sum(left.bands.values()) == pytest.approx(1.0)
    power, half = left.powers["load"]
    assert np.isfinite(power)
    assert half > 0.0
