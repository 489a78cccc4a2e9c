"""Friction, tread depth and tread temperature: declared unknowns."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.arrays import FloatArray
from tirelib.core.flags import TurnFlag
from tirelib.estimators.any_road import Seen, tell
from tirelib.estimators.fit_sliding import Runs, fit_sliding
from tirelib.estimators.gage_chains import LARGEST_ANGLE_STD
from tirelib.estimators.sliding import SlidingCurve, Told
from tirelib.estimators.train import Trained
from tirelib.estimators.unknowns import (
    DEPTH,
    EDGE,
    FRICTION,
    TIRES,
    TWO_SIGMA,
    UNDER_GROOVES,
    Road,
    spread,
)
from tirelib.measured.observations import Observations

CURVE = SlidingCurve(
    friction=0.95,
    friction_std=0.0,
    grip=0.97,
    sharpness=2.5,
    fading=1.8,
    stiffness=(2.5, -0.3),
    trail=(-3.6, 0.6),
    ratio=(0.3, 0.2),
    camber=(0.0, 0.0),
    misfit=0.01,
    slant=0.03,
)
WIDEST = np.deg2rad(8.0)


def one(x: float) -> FloatArray:
    return np.array([x])


def told_of(
    used: FloatArray,
    load: FloatArray,
    moment: tuple[FloatArray, float] | None = None,
    pull: tuple[FloatArray, float] | None = None,
    slip_ratio: FloatArray | None = None,
    unseen: float = 0.0,
) -> Told:
    """What readings of these standard deviations tell."""
    nothing = 0.0 * used
    moment, pull = (reading or (nothing, np.inf) for reading in (moment, pull))
    slip = np.full(used.shape, np.nan) if slip_ratio is None else slip_ratio
    seen = Seen(
        used,
        load,
        slip,
        nothing,
        moment[0],
        nothing + moment[1],
        pull[0],
        nothing + pull[1],
        unseen,
    )
    return tell(CURVE, seen, WIDEST)


@given(
    friction=st.floats(0.32, 1.05),
    angle=st.floats(np.deg2rad(0.5), np.deg2rad(6.0)),
    load=st.floats(1500.0, 8000.0),
)
def test_the_moment_tells_the_slip_angle_on_any_road(
    friction: float, angle: float, load: float
) -> None:
    used, _, moment, share = CURVE.forward(one(angle), one(load), friction)
    if share[0] > 0.8:
        return  # hardly any moment is left
    sharp, blunt = (told_of(used, one(load), (moment, std)) for std in (4e-4, 0.4))
    assert sharp.angle[0] == pytest.approx(angle, abs=3.0 * sharp.std[0] + np.deg2rad(0.02))
    assert sharp.std[0] < blunt.std[0] + 1e-4


@given(
    friction=st.floats(0.32, 1.05),
    angle=st.floats(np.deg2rad(0.5), np.deg2rad(6.0)),
    load=st.floats(1500.0, 8000.0),
    slip=st.one_of(st.floats(-0.1, -0.03), st.floats(0.03, 0.1)),
)
def test_the_direction_of_the_force_tells_the_slip_angle_of_a_braked_or_driven_wheel(
    friction: float, angle: float, load: float, slip: float
) -> None:
    """On any road, however much of the tread slides."""
    used, pull, *_ = CURVE.forward(one(angle), one(load), friction, one(slip))
    found = told_of(used, one(load), pull=(pull, 0.005), slip_ratio=one(slip))
    blind = told_of(used, one(load), slip_ratio=one(slip))
    assert found.angle[0] == pytest.approx(angle, abs=3.0 * found.std[0] + np.deg2rad(0.02))
    assert found.std[0] < 0.2 * angle + 0.35 * blind.std[0] + np.deg2rad(0.2)


@given(
    slip=st.one_of(st.just(0.0), st.floats(1e-6, 0.2)),
    used=st.floats(1e-6, 1.2),
    load=st.floats(500.0, 9000.0),
)
def test_a_sliding_share_meets_force_and_slip_whatever_turns_are_told_beside_it(
    slip: float, used: float, load: float
) -> None:
    along = np.array([slip, 0.1, 0.0])
    (t, *_), (alone,) = (
        CURVE.share(np.full(x.shape, used), CURVE.friction, np.full(x.shape, load), x)
        for x in (along, one(slip))
    )
    assert t == alone  # to the last bit
    most, n = CURVE.grip * CURVE.friction, CURVE.sharpness
    pull = float(CURVE.cornering(one(load))[0]) * slip / (n * most)
    if np.hypot(pull, used / most) < 1.0 - 1e-9:
        across = used / most / (1.0 - (1.0 - t) ** n)
        assert np.hypot(pull / t, across) == pytest.approx(1.0, rel=1e-9)
    elif np.hypot(pull, used / most) > 1.0 + 1e-9:
        assert t == 1.0


def test_without_a_reading_the_angle_is_that_of_the_calibrated_road_with_all_its_doubt() -> None:
    load, angle = np.full(3, 4000.0), np.deg2rad([1.0, 2.5, 4.0])
    for slip in (None, np.full(3, -0.03)):
        used, *_ = CURVE.forward(angle, load, CURVE.friction, slip)
        told = told_of(used, load, slip_ratio=slip)
        # the longitudinal slip is taken at the angle of a wheel that rolls freely
        np.testing.assert_allclose(told.angle, angle, rtol=1e-6 if slip is None else 0.02)
        np.testing.assert_allclose(told.change, 0.0, atol=1e-12)
        if slip is None:
            assert told.std[0] < 0.1 * told.angle[0]  # small at small slip
        assert (told.std[1:] > np.deg2rad(1.0)).all()


def test_where_little_slides_the_friction_is_no_doubt_even_at_light_load() -> None:
    """A wheel that carries little, at 2 deg: the moment in the strain says that it grips."""
    load, angle = np.array([1200.0, 4000.0]), np.deg2rad([2.0, 2.0])
    used, _, moment, _ = CURVE.forward(angle, load, CURVE.friction)
    assert (told_of(used, load).std > np.deg2rad(1.0)).all()
    assert (told_of(used, load, (moment, 0.04)).std < np.deg2rad(0.3)).all()


@pytest.mark.parametrize("noise", [0.02, 0.05, np.inf])
@pytest.mark.parametrize("braked", [False, True])
def test_intervals_hold_the_slip_angles_of_the_roads_that_may_be(
    noise: float, braked: bool
) -> None:
    rng = np.random.default_rng(3)
    load, n = rng.uniform(1500.0, 8000.0, 3000), 3000
    angle = rng.uniform(0.0, WIDEST, n)
    slip = rng.uniform(-0.08, -0.02, n) if braked else np.cos(angle) - 1.0
    used, pull, moment, share = CURVE.forward(angle, load, rng.uniform(*FRICTION, n), slip)
    read, known = pull if braked else moment, np.isfinite(noise)
    slant = CURVE.slant * pull * rng.standard_normal(n) if braked else 0.0 * load
    read = read + slant + (noise if known else 0.0) * rng.standard_normal(n)
    told = (
        told_of(used, load, pull=(read, noise), slip_ratio=slip)
        if braked
        else told_of(used, load, (read, noise))
    )
    valid = told.std < LARGEST_ANGLE_STD
    inside = np.abs(told.angle - angle) <= TWO_SIGMA * told.std
    assert valid.mean() > (0.6 if known else 0.25)
    assert 0.9 < inside[valid].mean() <= 0.99
    if not braked:  # the whole tread slides: any larger angle may be
        assert valid[share >= 1.0].mean() < 0.03


def test_a_known_friction_is_answered_by_similarity_and_ends_where_it_is_used_up() -> None:
    load = np.full(4, 4000.0)
    friction = np.array([0.95, 0.5, 0.5, 0.3])
    used, *_ = CURVE.forward(np.full(4, np.deg2rad(2.0)), load, friction)
    told = CURVE.at(used, load, friction)
    np.testing.assert_allclose(told.angle[:3], np.deg2rad(2.0))
    assert told.change[0] == 0.0
    assert told.std[0] == 0.0
    assert (told.std[1:3] > 0.0).all()
    assert np.isinf(CURVE.at(np.array([0.31]), load[:1], np.array([0.3])).std[0])


def test_a_given_friction_is_as_uncertain_as_the_calibrated_one_that_was_fitted() -> None:
    """It counts against the calibration's, so what is wrong there moves the slip angle."""
    load, angle = np.full(2, 4000.0), np.deg2rad([1.0, 4.0])
    used, *_ = CURVE.forward(angle, load, 0.95)
    fitted = replace(CURVE, friction=0.87, friction_std=0.08)
    told = fitted.at(used, load, np.full(2, 0.95))
    moved = np.abs(told.angle - CURVE.at(used, load, np.full(2, 0.95)).angle)
    assert (told.std > replace(fitted, friction_std=0.0).at(used, load, np.full(2, 0.95)).std).all()
    assert (moved < TWO_SIGMA * told.std).all()
    assert told.std[0] < 0.1 * told.std[1]  # hardly any where little slides
    own = fitted.at(used, load, np.full(2, fitted.friction))
    np.testing.assert_array_equal(own.std, 0.0)


def test_a_force_that_no_road_gives_is_not_answered() -> None:
    told = told_of(one(1.4), one(4000.0), (one(0.0), 0.05))
    assert not np.isfinite(told.std[0])


@pytest.mark.parametrize("known", [True, False])
def test_the_curve_is_found_from_a_dry_road(known: bool) -> None:
    loads, angles = [1500.0, 4000.0, 7000.0], np.linspace(-0.12, 0.12, 13)
    load, angle, slip = (
        x.ravel() for x in np.meshgrid(loads, angles, [np.nan, -0.06, -0.03, 0.03])
    )
    slip = np.where(np.isnan(slip), np.cos(angle) - 1.0, slip)
    used, pull, moment, _ = CURVE.forward(angle, load, CURVE.friction, slip)
    moment = moment * CURVE.longest(load)
    side = np.sign(angle)
    nothing = np.full(load.shape, np.nan)
    found = fit_sliding(
        Runs(
            angle,
            load,
            -side * used * load,
            -pull * load,
            side * moment * load,
            0.0 * load,
            slip,
            np.full(load.shape, CURVE.friction) if known else nothing,
        )
    )
    assert found is not None
    assert found.friction * found.grip == pytest.approx(0.95 * 0.97, rel=0.01)
    assert (found.friction_std == 0.0) == known
    assert found.slant < 0.01
    there = np.deg2rad([1.0, 3.0]), np.array([3000.0, 3000.0])
    road = 0.5 if known else 0.5 * found.friction / CURVE.friction
    for mine, own in zip(
        found.forward(*there, road, one(-0.02)), CURVE.forward(*there, 0.5, one(-0.02)), strict=True
    ):
        np.testing.assert_allclose(mine, own, rtol=0.03)


def conditions(**known: float) -> dict[str, FloatArray]:
    names = ("tread_depth", "tread_temperature", "friction")
    return {name: one(known.get(name, np.nan)) for name in names}


def test_an_unknown_tread_holds_95_percent_of_all_treads_of_all_tires() -> None:
    rng = np.random.default_rng(7)
    depth, tires = rng.uniform(*DEPTH, 100_000), 1.0 + TIRES * rng.standard_normal(100_000)
    road, unknown = Road(tread_temperature=(313.0, 313.0)), conditions(tread_temperature=313.0)
    harder = np.log((DEPTH[1] + UNDER_GROOVES) / (depth + UNDER_GROOVES)) * tires
    lost = (DEPTH[1] - depth) * tires
    for departure, (_, std) in ((harder, road.hardened(unknown)), (lost, road.worn(unknown))):
        assert np.mean(np.abs(departure) <= TWO_SIGMA * std) == pytest.approx(0.95, abs=0.004)
    assert spread(np.array([-1.0, 1.0])) == pytest.approx(1.0 / TWO_SIGMA)


def test_the_load_that_an_unknown_tread_hides_is_held_on_eleven_tires() -> None:
    """`EDGE` of the rig's three tires and of eight drawn ones, as their worn treads show it.

    The other errors of the load, 30 N, are 0.45 mm of contact length. With what `EDGE` and its
    spread were over three tires 91 % would be held, and 81 % on one of them.
    """
    own = 1e-3 * np.array([10.5, 11.1, 10.7, 12.6, 13.2, 10.5, 13.3, 11.7, 9.5, 9.4, 13.1])
    road, none = Road(tread_temperature=(300.0, 300.0)), conditions(tread_temperature=300.0)
    depth, other = np.linspace(*DEPTH, 4001), 0.45e-3
    harder, _ = road.hardened({**none, "tread_depth": depth})
    error = np.outer(own, harder) + other * np.random.default_rng(1).standard_normal(depth.size)
    std = np.hypot(EDGE * road.hardened(none)[1][0], other)
    held = np.mean(np.abs(error) <= TWO_SIGMA * std, axis=1)
    assert held.mean() == pytest.approx(0.945, abs=0.007)
    assert held.min() > 0.85


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
    [
        ("friction", 0.0),
        ("friction", 100.0),
        ("tread_depth", 0.0),
        ("tread_depth", -0.0035),
        ("tread_depth", 8.0),
        ("tread_temperature", 40.0),
    ],
)
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
