"""Tires of forces of three families: their curves, and what the stored table says of them."""

import numpy as np
import pytest
from force_tires.bench import problem_of
from force_tires.families import FAMILIES, Changes, Setting
from force_tires.learn import FIRST, FIRST_OWN, OUT, families_sha256
from force_tires.plans import case

from tirelib.core.threads import one_thread
from tirelib.inference.statistics.hypothesis import judged
from tirelib.inference.statistics.plain import Family, load
from tirelib.inference.statistics.posterior import posterior


def at_angles(angles: np.ndarray, load: float, ratio: float = 0.0) -> tuple[Setting, Changes]:
    n = angles.size
    none, one = np.zeros(n), np.ones(n)
    setting = Setting(
        load * one, 2e5 * one, angles, ratio * one, none, 10.0 * one, 330.0 * one, none, none
    )
    return setting, Changes(one, one, none, none, none, none)


@pytest.mark.parametrize("name", FAMILIES)
def test_a_tire_pulls_against_the_slip_up_to_its_friction_and_aligns_itself(name: str) -> None:
    tire = FAMILIES[name](np.random.default_rng(3))
    angles = np.deg2rad([-30.0, -2.0, 0.0, 2.0, 30.0])
    Fx, Fy, Mz = tire.forces(*at_angles(angles, tire.nominal))
    assert (np.sign(Fy[[0, 1, 3, 4]]) == [1.0, 1.0, -1.0, -1.0]).all()
    assert (np.sign(Mz[[1, 3]]) == [-1.0, 1.0]).all()
    assert np.abs(Fy).max() < 1.4 * tire.nominal
    np.testing.assert_allclose(Fx, 0.0, atol=1e-9 * tire.nominal)
    braked = tire.forces(*at_angles(angles[2:3], tire.nominal, ratio=-0.02))[0]
    assert -1.4 * tire.nominal < braked[0] < -0.1 * tire.nominal


def test_a_string_without_stiffness_of_the_belt_is_the_bristles_alone() -> None:
    tire = FAMILIES["string"](np.random.default_rng(3))
    tire.soft, tire.shift, tire.cone = 0.0, 0.0, 0.0
    angle = np.array([1e-3])
    side = tire.forces(*at_angles(angle, tire.nominal))[1]
    # nearly all bristles stick: the slope that was drawn
    assert side[0] == pytest.approx(-tire.slope * tire.nominal * angle[0], rel=0.02)


@pytest.mark.parametrize("quantity", ["Fy", "Fx", "Mz"])
def test_the_tables_are_those_of_the_families_as_they_are(quantity: str) -> None:
    families, provenance = load(OUT / f"plain_{quantity}.npz")
    assert {family.name for family in families} == set(FAMILIES)
    assert all(len(family) >= 20 for family in families)
    assert provenance["families_sha256"] == families_sha256()


@pytest.fixture(scope="module")
def table() -> tuple[Family, ...]:
    return load(OUT / "plain_Fy.npz")[0]


@pytest.mark.parametrize(
    ("kind", "low", "high"), [("none", 0.05, 1.0), ("stiffness_load", 0, 0.05)]
)
def test_a_plain_tire_is_rejected_only_if_it_hides_something(
    kind: str, low: float, high: float, table: tuple[Family, ...]
) -> None:
    problem = problem_of(case("strips", 302, kind), "Fy")
    spread = {effect.name: FIRST["effect"] for effect in problem.living}
    groups = problem.remainder(problem.start, problem.solve(problem.start))
    spread |= dict.fromkeys(groups, FIRST["shape"])
    with one_thread():
        found = judged(
            problem,
            posterior(problem, (), spread, problem.whitener(FIRST_OWN)),
            table,
            0.05,
            own_effects=0,
        )
    assert low < found.p <= high
