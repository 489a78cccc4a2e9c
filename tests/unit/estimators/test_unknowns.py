"""Friction, tread depth and tread temperature: declared unknowns."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.arrays import FloatArray
from tirelib.estimators.calibration import LARGEST_ANGLE_STD
from tirelib.estimators.fit_sliding import fit_sliding
from tirelib.estimators.sliding import SlidingCurve
from tirelib.estimators.train import Trained
from tirelib.estimators.unknowns import DEPTH, FRICTION, TWO_SIGMA, Road, spread
from tirelib.flags import TurnFlag
from tirelib.observations import Observations

CURVE = SlidingCurve(
    friction=0.95, sharpness=2.5, fading=1.8, stiffness=(2.5, -0.3), trail=(-3.6, 0.6),
    camber=(0.0, 0.0), misfit=2e-4, largest=0.013,
)  # fmt: skip
WIDEST = np.deg2rad(8.0)


def one(x: float) -> FloatArray:
    return np.array([x])


@given(
    friction=st.floats(0.32, 1.05),
    angle=st.floats(np.deg2rad(0.5), np.deg2rad(6.0)),
    load=st.floats(1500.0, 8000.0),
)
def test_the_moment_tells_the_slip_angle_on_any_road(
    friction: float, angle: float, load: float
) -> None:
    used, moment, share = CURVE.forward(one(angle), one(load), friction)
    if share[0] > 0.8:
        return  # hardly any moment is left
    told = CURVE.told(used, moment, one(1e-5), one(load), WIDEST)
    assert told.angle[0] == pytest.approx(angle, abs=3.0 * told.std[0] + np.deg2rad(0.02))
    sharp = CURVE.told(used, moment, one(1e-5), one(load), WIDEST)
    blunt = CURVE.told(used, moment, one(1e-2), one(load), WIDEST)
    assert sharp.std[0] < blunt.std[0] + 1e-4


def test_without_a_moment_the_angle_is_that_of_the_calibrated_road_with_all_its_doubt() -> None:
    load = np.full(3, 4000.0)
    used, _, _ = CURVE.forward(np.deg2rad([1.0, 2.5, 4.0]), load, CURVE.friction)
    told = CURVE.told(used, np.zeros(3), np.full(3, np.inf), load, WIDEST)
    np.testing.assert_allclose(np.rad2deg(told.angle), [1.0, 2.5, 4.0], atol=1e-6)
    np.testing.assert_allclose(told.change, 0.0, atol=1e-12)
    assert told.std[0] < 0.1 * told.angle[0]  # small at small slip
    assert (told.std[1:] > np.deg2rad(1.0)).all()


@pytest.mark.parametrize("noise", [5e-4, 1e-3, np.inf])
def test_intervals_hold_the_slip_angles_of_the_roads_that_may_be(noise: float) -> None:
    rng = np.random.default_rng(3)
    load, n = rng.uniform(1500.0, 8000.0, 3000), 3000
    angle = rng.uniform(0.0, WIDEST, n)
    used, moment, share = CURVE.forward(angle, load, rng.uniform(*FRICTION, n))
    read = moment + (noise if np.isfinite(noise) else 0.0) * rng.standard_normal(n)
    told = CURVE.told(used, read, np.full(n, noise), load, WIDEST)
    valid = told.std < LARGEST_ANGLE_STD
    inside = np.abs(told.angle - angle) <= TWO_SIGMA * told.std
    assert valid.mean() > (0.65 if np.isfinite(noise) else 0.25)
    assert 0.9 < inside[valid].mean() <= 0.99
    assert valid[share >= 1.0].mean() < 0.03  # the whole tread slides: any larger angle may be


def test_a_known_friction_is_answered_by_similarity_and_ends_where_it_is_used_up() -> None:
    load = np.full(4, 4000.0)
    friction = np.array([0.95, 0.5, 0.5, 0.3])
    used, _, _ = CURVE.forward(np.full(4, np.deg2rad(2.0)), load, friction)
    told = CURVE.at(used, load, friction)
    np.testing.assert_allclose(told.angle[:3], np.deg2rad(2.0))
    assert told.change[0] == 0.0
    assert told.std[0] == 0.0
    assert (told.std[1:3] > 0.0).all()
    assert np.isinf(CURVE.at(np.array([0.31]), load[:1], np.array([0.3])).std[0])


def test_a_force_that_no_road_gives_is_not_answered() -> None:
    told = CURVE.told(one(1.4), one(0.0), one(1e-3), one(4000.0), WIDEST)
    assert not np.isfinite(told.std[0])


@pytest.mark.parametrize("known", [True, False])
def test_the_curve_is_found_from_a_dry_road(known: bool) -> None:
    load, angle = (
        x.ravel() for x in np.meshgrid([1500.0, 4000.0, 7000.0], np.linspace(-0.12, 0.12, 13))
    )
    used, moment, _ = CURVE.forward(angle, load, CURVE.friction)
    side = np.sign(angle)
    nothing = np.full(load.shape, np.nan)
    found = fit_sliding(
        angle, load, -side * used * load, side * moment * load, 0.0 * load, 0.0 * load,
        np.full(load.shape, CURVE.friction) if known else nothing,
    )  # fmt: skip
    assert found is not None
    assert found.friction == pytest.approx(CURVE.friction, rel=0.01 if known else 0.1)
    there = np.deg2rad([1.0, 3.0]), np.array([3000.0, 3000.0])
    for mine, own in zip(found.forward(*there, 0.5), CURVE.forward(*there, 0.5), strict=True):
        np.testing.assert_allclose(mine, own, rtol=0.02 if known else 0.08)


def conditions(**known: float) -> dict[str, FloatArray]:
    names = ("tread_depth", "tread_temperature", "friction")
    return {name: one(known.get(name, np.nan)) for name in names}


def test_an_unknown_tread_holds_95_percent_of_those_that_may_be() -> None:
    _, std = Road(tread_temperature=(300.0, 300.0)).worn(conditions())
    lost = DEPTH[1] - np.random.default_rng(1).uniform(*DEPTH, 20_000)
    assert np.mean(lost <= TWO_SIGMA * std[0]) == pytest.approx(0.95, abs=0.01)
    assert spread(np.array([-1.0, 1.0])) == pytest.approx(1.0 / TWO_SIGMA)


def test_a_calibration_that_varied_the_tread_knows_more_of_it() -> None:
    new, varied = Road(), Road(tread_depth=(0.005, 0.008))
    for law in (Road.worn, Road.hardened):
        assert law(varied, conditions())[1][0] < 0.6 * law(new, conditions())[1][0]
    assert varied.worn(conditions(tread_depth=0.006))[0][0] == 0.0
    assert varied.worn(conditions(tread_depth=0.004))[0][0] == pytest.approx(0.001)


def test_a_worn_and_a_cold_tread_are_stiffer() -> None:
    road = Road(tread_temperature=(313.0, 313.0))
    worn, left = road.hardened(conditions(tread_depth=0.004, tread_temperature=313.0))
    assert 0.3 < worn[0] < 0.5
    assert left[0] == 0.0
    cold, _ = road.hardened(conditions(tread_depth=0.008, tread_temperature=293.0))
    assert cold[0] == pytest.approx(0.08)


def test_friction_that_was_calibrated_is_no_longer_unseen() -> None:
    assert Road().unseen_friction(0.95) == 1.0
    assert Road(friction=(0.3, 1.0)).unseen_friction(1.0) == 0.0
    assert 0.2 < Road(friction=(0.5, 0.95)).unseen_friction(0.95) < 0.7


@pytest.mark.parametrize(
    ("name", "value"),
    [("friction", 0.0), ("friction", 100.0), ("tread_depth", 0.0), ("tread_depth", -0.0035),
     ("tread_depth", 8.0), ("tread_temperature", 40.0)],
)  # fmt: skip
def test_a_friction_or_tread_that_cannot_be_is_named_and_nothing_is_valid(
    trained: Trained, observed: Observations, name: str, value: float
) -> None:
    day = observed.features
    found, unknown = (
        trained.calibration.estimate(replace(day, **{name: np.full(len(day), x)}))  # type: ignore[arg-type]
        for x in (value, np.nan)
    )
    rows = np.flatnonzero(unknown.turn_valid)
    assert rows.size > 0
    assert not any(valid.any() for valid in found.valid.values())
    assert all(f"{name}_implausible" in found.notes[row] for row in rows)
    assert (found.flags[rows] & int(TurnFlag.OUT_OF_RANGE) != 0).all()
    for quantity in ("Fz", "Fy"):  # the numbers are those of an unknown value
        np.testing.assert_allclose(found.value[quantity], unknown.value[quantity])
