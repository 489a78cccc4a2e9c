"""Which combinations count as calibrated, and what older files say of it."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.polynomial import Cloud, Polynomial, Variable
from tirelib.estimators.ranges import AROUND, MIRRORED, REACH, with_ranges
from tirelib.estimators.regressors import SHAPE
from tirelib.estimators.train import Trained

NAMES = ("traction", "cp1_slope")
ARMS = np.array(
    [(x, 0.0) for x in np.linspace(-1.0, 1.0, 9)] + [(0.0, y) for y in np.linspace(0.1, 1.0, 8)]
)
"""Cornering to one side and braking, apart."""


def cloud(points: np.ndarray, **options: float | bool) -> Cloud:
    return Cloud(NAMES, np.ones(2), points, 0.1, **options)


def inside(of: Cloud, *places: tuple[float, float]) -> list[bool]:
    x = np.array(places)
    return of.inside({"traction": x[:, 0], "cp1_slope": x[:, 1]}).tolist()


RING = np.array([(np.cos(a), np.sin(a)) for a in np.arange(8) * np.pi / 4]) * 0.3


def test_what_lies_between_calibrated_combinations_counts() -> None:
    assert inside(cloud(RING), (0.0, 0.0)) == [False]
    assert inside(cloud(RING, around=0.4), (0.0, 0.0), (0.0, 0.45), (2.0, 2.0)) == [
        True,
        False,
        False,
    ]
    # half a ring surrounds nothing outside its hull
    half = RING[[0, 1, 2, 3, 4]]
    assert inside(cloud(half, around=0.4), (0.0, 0.12), (0.0, -0.12)) == [True, False]
    assert inside(cloud(RING, around=0.4), (np.nan, 0.0)) == [False]
    # the gap from the last direction round to the first counts as any other: 185 deg, 175 deg
    for end, closed in ((95.0, False), (105.0, True)):
        turn = np.deg2rad([-80.0, 0.0, end])
        three = 0.3 * np.stack((np.cos(turn), np.sin(turn)), axis=1)
        assert inside(cloud(three, around=0.4), (0.0, 0.0)) == [closed]


@given(
    centre=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    seed=st.integers(0, 1000),
    n=st.integers(1, 8),
)
def test_between_means_in_the_convex_hull(centre: tuple[float, float], seed: int, n: int) -> None:
    """All points within `around`: inside exactly if no half-plane is free of them."""
    away = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 2))
    found = inside(cloud(away + centre, around=5.0), centre)[0]
    directions = np.linspace(-np.pi, np.pi, 3601)
    most = (away @ np.array([np.cos(directions), np.sin(directions)])).max(axis=0).min()
    if abs(most) > 2e-3 and np.hypot(*away.T).min() > 0.1:
        assert found == (most > 0.0)


def test_arms_do_not_calibrate_what_lies_between_them() -> None:
    of = cloud(ARMS, around=0.4, mirrored=True)
    assert inside(of, (0.4, 0.7), (-0.5, 0.5), (0.5, -0.5)) == [False] * 3
    assert inside(of, (0.55, 0.05), (0.0, 0.55), (0.0, -0.55)) == [True] * 3
    assert inside(cloud(ARMS, around=0.4), (0.0, -0.55)) == [False]


def test_odd_ranges_reach_as_far_to_either_side(trained: Trained) -> None:
    for ranges in trained.calibration.chains[-1].guards.values():
        for limit in ranges:
            if limit.name in MIRRORED:
                assert limit.low == -limit.high, limit.name


def test_a_file_of_before_loads_and_keeps_its_meaning(trained: Trained, tmp_path: Path) -> None:
    """Files without the later keys of a cloud: only what is near counts, as it did."""
    chain = replace(trained.calibration.chains[-1], cloud=cloud(ARMS, around=0.4, mirrored=True))
    calibration = replace(trained.calibration, chains={-1: chain})
    path = tmp_path / "cal.toml"
    write_calibration(calibration, path)
    again = read_calibration(path).chains[-1].cloud
    assert again is not None
    assert (again.around, again.mirrored) == (0.4, True)
    document = tomllib.loads(path.read_text())
    for key in ("around", "mirrored"):
        del document["chain"][0]["cloud"][key]
    path.write_text(tomli_w.dumps(document))
    before = read_calibration(path).chains[-1].cloud
    assert before is not None
    assert inside(before, (0.0, -0.55), (0.0, 0.55)) == [False, True]


def test_the_shape_of_the_contact_decides_where_a_model_uses_it(trained: Trained) -> None:
    chain = trained.calibration.chains[-1]
    for quantity, models in {"Fz": [chain.load], "Fy": [chain.force]}.items():
        guarded = {limit.name for limit in chain.guards[quantity]}
        for model in models:
            assert model is not None
            used = {v.name for v in model.variables} - {"pressure", "speed_squared", "camber"}
            assert used <= guarded


def of_one(model: Polynomial | None, name: str) -> Polynomial:
    """Return a model that uses one regressor only."""
    assert model is not None
    return replace(
        model,
        variables=(Variable(name, 0.0, 1.0),),
        terms=((1,),),
        coefficients=np.ones(1),
        covariance=np.eye(1),
    )


def test_what_an_estimate_is_made_from_decides_on_it(trained: Trained) -> None:
    """The slip angle is made from load and lateral force, each with its regressors of the shape."""
    chain, links = trained.calibration.chains[-1], trained.links
    bare = replace(chain, load=of_one(chain.load, "fullness"), force=of_one(chain.force, "skew"))
    ranges = with_ranges(bare, links.values, links.truth).guards
    shape = {q: {limit.name for limit in ranges[q]} & set(SHAPE) for q in ranges}
    assert shape == {
        "Fz": {"fullness"},
        "Fy": {"skew"},
        "alpha": {"fullness", "skew"},
        "kappa": set(),
    }


@pytest.mark.parametrize(("n", "reach"), [(35, REACH[0]), (22, 1.5 * 2.0 / 21), (9, REACH[1])])
def test_near_is_half_as_far_again_as_calibrated_combinations_lie_apart(
    trained: Trained, n: int, reach: float
) -> None:
    """Within bounds, in half ranges; what was calibrated on one side was on the other."""
    chain, links = trained.calibration.chains[-1], trained.links
    even = {"traction": np.linspace(-0.3, 0.3, n), "cp1_slope": np.zeros(n)}
    values = {name: x[:n] for name, x in links.values.items()} | even
    found = with_ranges(chain, values, links.truth).cloud
    assert found is not None
    assert found.reach == pytest.approx(reach)
    assert (found.around, found.mirrored) == (AROUND, True)
    np.testing.assert_allclose(found.scale, [0.3, 0.02])  # a floor where nothing varied
    still = values | {"traction": 0.1 * even["traction"]}
    assert with_ranges(chain, still, links.truth).cloud is None


def test_a_camber_that_was_not_calibrated_widens_fy_and_is_soon_out_of_range(
    trained: Trained,
) -> None:
    """A tilt of 0.5 deg reads as 200 N of lateral force and more."""
    from tests.synthetic import header, synthetic_run
    from tirelib.measured.observations import measure_run

    features = measure_run(synthetic_run(0, noise=0.0), header())[0]

    def at(degrees: float) -> Estimates:
        tilted = np.full(len(features), np.deg2rad(degrees))
        return trained.calibration.estimate(replace(features, camber=tilted))

    upright, slack, beyond = at(0.0), at(0.04), at(0.5)
    assert upright.valid["Fy"][1:].all()
    assert slack.valid["Fy"][1:].all()
    assert not beyond.valid["Fy"].any()
    grown = np.sqrt(beyond.std["Fy"][1:] ** 2 - upright.std["Fy"][1:] ** 2)
    assert (grown > 0.03 * trained.calibration.chains[-1].mean_load).all()
    assert (grown > 150.0).all()


@pytest.mark.parametrize("count", [2, 3])
def test_a_bow_needs_three_gages(count: int) -> None:
    from tests.synthetic import header, synthetic_run
    from tirelib.estimators.regressors import compute_regressors
    from tirelib.measured.observations import measure_run

    features = measure_run(synthetic_run(0, turns=3.0), header())[0]
    found = compute_regressors(features, range(1, 1 + count))
    known = np.isfinite(found["cp1_bow"][1:])
    assert known.all() if count == 3 else not known.any()
