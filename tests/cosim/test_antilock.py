"""Anti-lock stops: what today's sensors tell, the rules of the brakes, and what water does."""

import dataclasses
import math

import numpy as np
import pytest
from cosim import antilock, antilock_report, hydroplaning, hydroplaning_report, water
from cosim.antilock import AntiLockStudy, StopRun, stop
from cosim.antilock_brakes import (
    APART,
    BUILD,
    PARTING,
    PEDAL,
    RELEASE,
    Today,
    TractionBrakes,
    actuated,
    axle_rules,
)
from cosim.antilock_roads import CHANGE, FALLING, ROADS, falling
from cosim.closed_loop_sources import TIME_STEP, Known, Perfect
from cosim.hydroplaning import Approach
from cosim.today import AntiLock, Phase, Sensors, SpeedEstimator, TodaysBrakes
from cosim.traction import TractionController
from cosim.vehicle14.files import make_vehicle
from cosim.vehicle14.model import ANGLES, Controls, Wheels
from cosim.vehicle14.parameters import GRAVITY
from cosim.wheels import Estimates

from tirelib.rig.observe import trace

RULES, CONTROL = AntiLock(), TractionController()
BY_NAME = {road.name: road for road in ROADS}


def sensors(rims: list[float], along: float = 0.0, yaw_rate: float = 0.0) -> Sensors:
    omega = np.array(rims) / SpeedEstimator().radius
    return Sensors(omega, yaw_rate, np.array([along, 0.0, GRAVITY]))


def test_the_accelerometer_carries_the_speed_and_no_slow_wheel_lowers_it() -> None:
    estimator = SpeedEstimator(pitch=0.05)
    told = estimator.step(20.0, sensors([15.0, 16.0, 17.0, 18.0], -8.4), 0.002)
    assert told == pytest.approx(20.0 - 8.0 * 0.002)


def test_a_wheel_faster_than_the_reference_lifts_it() -> None:
    speed = 20.0
    for _ in range(400):
        speed = SpeedEstimator().step(speed, sensors([19.0, 19.0, 19.0, 21.0]), 0.002)
    assert speed == pytest.approx(21.0, abs=1e-3)


def test_in_a_turn_wheels_are_carried_to_the_middle() -> None:
    """In a left turn the right wheels are faster by half the track times the yaw rate."""
    half = SpeedEstimator().half_track * 0.4
    rims = SpeedEstimator().wheels(sensors([20 - half, 20 + half, 20 - half, 20 + half], 0.0, 0.4))
    np.testing.assert_allclose(rims, 20.0)


def test_an_accelerometer_feels_gravity_as_the_body_pitches() -> None:
    vehicle = make_vehicle()
    state = vehicle.at_rest(20.0)
    motion = vehicle.motion(state, Controls.none())
    state[ANGLES] = 0.0, 0.02, 0.0  # nose down
    shown = Sensors.of(state, motion).acceleration - motion.acceleration
    np.testing.assert_allclose(shown, [-GRAVITY * math.sin(0.02), 0.0, GRAVITY * math.cos(0.02)])


@pytest.mark.parametrize(
    ("phase", "rim", "slip", "since", "found"),
    [
        (Phase.FREE, -20.0, 0.02, 0.1, Phase.WAIT),
        (Phase.WAIT, -20.0, 0.02, 0.0, Phase.WAIT),
        (Phase.WAIT, -20.0, 0.2, 0.0, Phase.RELEASE),
        (Phase.WAIT, -5.0, 0.02, 0.0, Phase.STEPS),
        (Phase.RELEASE, -20.0, 0.2, 0.01, Phase.RELEASE),
        (Phase.RELEASE, -5.0, 0.2, 0.01, Phase.RECOVER),
        (Phase.RECOVER, 50.0, 0.2, 0.01, Phase.REBUILD),
        (Phase.RECOVER, 1.0, 0.2, 0.05, Phase.RELEASE),
        (Phase.RECOVER, 1.0, 0.05, 0.01, Phase.STEPS),
        (Phase.REBUILD, 10.0, 0.05, 0.01, Phase.GRIP),
        (Phase.GRIP, 1.0, 0.05, 0.01, Phase.STEPS),
        (Phase.STEPS, 0.0, 0.05, 0.5, Phase.STEPS),
        (Phase.STEPS, -20.0, 0.05, 0.5, Phase.RELEASE),
    ],
)
def test_the_control_cycle_goes_as_the_handbook_says(
    phase: Phase, rim: float, slip: float, since: float, found: Phase
) -> None:
    assert RULES.next(phase, rim, slip, since) is found


def test_todays_brakes_build_release_and_keep_to_the_pedal() -> None:
    brakes, rolls = TodaysBrakes(), np.full(4, 20.0)
    for _ in range(1000):
        torque = brakes.step(rolls, 20.0, PEDAL, TIME_STEP)
    np.testing.assert_allclose(torque, PEDAL)
    locks = np.array([20.0, 20.0, 20.0, 20.0])
    for _ in range(60):  # the front left wheel slows by 100 m/s^2
        locks = locks - np.array([0.2, 0.0, 0.0, 0.0])
        torque = brakes.step(locks, 20.0, PEDAL, TIME_STEP)
    assert torque[0] < 0.5 * PEDAL[0]
    np.testing.assert_allclose(torque[1:], PEDAL[1:])


def test_who_knows_no_slip_angle_brakes_the_rear_axle_by_its_worse_wheel() -> None:
    asked = np.array([200.0, 1700.0, 700.0, 150.0])
    torque = axle_rules(asked, None, None)
    np.testing.assert_allclose(torque, [200.0, 200.0 + APART, 150.0, 150.0])
    later = axle_rules(asked, 0.5, None)
    assert later[1] == pytest.approx(200.0 + APART + 0.5 * PARTING)
    np.testing.assert_allclose(axle_rules(asked, None, 1.0), asked)
    np.testing.assert_allclose(axle_rules(asked, None, 0.0), torque)
    np.testing.assert_allclose(axle_rules(2.0 * PEDAL, None, None), PEDAL)


def test_actuators_have_a_lag_and_largest_rates() -> None:
    torque = actuated(np.array([0.0, 1000.0, 500.0, 0.0]), np.array([2000.0, 0.0, 501.2, 0.0]))
    expected = [BUILD * TIME_STEP, 1000.0 - RELEASE * TIME_STEP, 500.2, 0.0]
    np.testing.assert_allclose(torque, expected)


def wheels(**values: float) -> Wheels:
    fields = {field.name: np.zeros(4) for field in dataclasses.fields(Wheels)}
    return Wheels(**fields | {name: np.full(4, value) for name, value in values.items()})


def test_friction_falls_with_the_speed_of_sliding() -> None:
    factor = np.array([1.0, 0.5, 0.4, 0.8])
    locked = falling(factor, wheels(speed=10.0, kappa=-1.0))
    np.testing.assert_allclose(locked, factor * math.exp(-FALLING))
    np.testing.assert_allclose(falling(factor, wheels(speed=10.0)), factor)


def test_a_split_road_has_four_starts() -> None:
    for start, first, then in (("entering", 1.0, 0.4), ("leaving", 0.4, 1.0)):
        left, right = BY_NAME[f"split_left_{start}"], BY_NAME[f"split_right_{start}"]
        np.testing.assert_allclose(left.friction(0.0), [first, 1.0, first, 1.0])
        np.testing.assert_allclose(left.friction(CHANGE + 1.0), [then, 1.0, first, 1.0])
        np.testing.assert_allclose(left.friction(CHANGE + 3.0), [then, 1.0, then, 1.0])
        for way in (0.0, 13.0, 20.0):
            np.testing.assert_allclose(right.friction(way), left.friction(way)[[1, 0, 3, 2]])


def known(kappa: float, load: float = 4e3, alpha: float = 0.0) -> Known:
    return Known(np.full(4, kappa), np.full(4, load), np.full(4, alpha))


def step(told: Known, torque: float, slowing: float = 0.0) -> tuple[float, float]:
    shown = np.full(4, torque), np.full(4, slowing)
    believed, wanted = CONTROL.step(np.full(4, 0.8), told, shown, 20.0, 1.0)
    return float(believed[0]), float(wanted[0])


def test_a_sliding_wheel_shows_the_friction_of_the_road() -> None:
    """The brake slows the rim: what the road gives is the torque less what the rim takes."""
    friction, load, slowing = 0.4, 4e3, 30.0
    torque = CONTROL.radius * friction * load + CONTROL.spin_inertia * slowing / CONTROL.radius
    believed, wanted = step(known(-0.15, load), torque, slowing)
    assert believed == pytest.approx(friction)
    assert wanted < CONTROL.radius * friction * load  # less than the road gives: it comes back


def test_a_wheel_that_slips_little_is_believed_more_and_none_brakes_blindly() -> None:
    assert step(known(-0.01), 1000.0)[0] > 0.8
    assert step(known(math.nan), 1000.0) == (0.8, 0.0)
    assert step(known(-0.01, math.nan), 1000.0) == (0.8, 0.0)


def test_the_target_follows_friction_and_slip_angle() -> None:
    target = CONTROL.target(np.array([0.1, 0.4, 0.9, 0.9]), np.array([0.0, 0.0, 0.0, 0.06]))
    assert target[:3] == pytest.approx([-CONTROL.least, -0.048, -CONTROL.most_slip])
    share = math.sqrt(1.0 - (0.06 / (0.9 * CONTROL.widest)) ** 2)
    assert target[3] == pytest.approx(-CONTROL.most_slip * share)


@pytest.fixture(scope="module")
def mirrored() -> list[StopRun]:
    """The first second on a road whose left, or right, side is slippery."""
    return [
        stop(BY_NAME[f"split_{side}_leaving"], Today(), end_speed=20.0)
        for side in ("left", "right")
    ]


def test_the_mirrored_road_makes_the_mirrored_stop(mirrored: list[StopRun]) -> None:
    left, right = mirrored
    assert left.distance == pytest.approx(right.distance, rel=1e-9)
    np.testing.assert_allclose(left.yaw, -right.yaw, atol=1e-9)
    np.testing.assert_allclose(left.torque, right.torque[:, [1, 0, 3, 2]], atol=1e-6)
    assert left.yaw.min() < -math.radians(0.1)  # it turns to the side that grips
    assert left.steer.max() > 0.0


def test_the_tires_own_knowledge_lets_an_axle_differ_and_stops_shorter(
    mirrored: list[StopRun],
) -> None:
    run = stop(
        BY_NAME["split_left_leaving"], TractionBrakes(Perfect(), fused=False), end_speed=20.0
    )
    assert run.distance < 0.97 * mirrored[0].distance
    assert run.kappa.min() > -0.2
    assert np.ptp(run.torque[-1, :2]) > APART + 100.0
    figures = run.figures()
    assert figures["largest_slip"] == pytest.approx(-run.kappa.min())
    assert figures["steering_deg"] >= figures["largest_steer_deg"]


def test_the_stops_are_a_document_a_table_and_figures(mirrored: list[StopRun]) -> None:
    road = BY_NAME["split_left_entering"]
    runs = {(road.name, kind): mirrored[0] for kind in antilock.KINDS}
    study = AntiLockStudy((road,), runs)
    assert [row["knowledge"] for row in study.document()["rows"]] == list(antilock.KINDS)
    part = antilock_report.part(study)
    assert "0.0 % longer" in part.text
    assert len(part.tables[0].rows) == len(antilock.KINDS)
    assert len(part.plots[0].figure.data) == 6 * len(antilock.KINDS)
    assert len(part.plots[0].rows[0]) == len(part.plots[0].columns)
    assert antilock.missed(study) == []
    worse = dataclasses.replace(
        mirrored[0], distance=99.0, aside=10.0 + mirrored[0].aside, kappa=mirrored[0].kappa - 1.0
    )
    told = antilock.missed(AntiLockStudy((road,), runs | {(road.name, "strain"): worse}))
    assert [text[-5:] for text in told] == ["> 0.9"]
    roads = tuple(road for road in ROADS if road.name.startswith(("split", "turn")))
    every = {(r.name, kind): mirrored[0] for r in roads for kind in antilock.KINDS}
    shorter = dataclasses.replace(mirrored[0], distance=1.0, aside=0.5 * mirrored[0].aside)
    good = every | {(r.name, "strain"): shorter for r in roads}
    assert antilock.missed(AntiLockStudy(roads, good)) == []
    told = antilock.missed(AntiLockStudy(roads, every))
    assert [text.split(":")[0] for text in told] == ["antilock, split roads", "antilock, turn"]


def test_water_is_linear_between_what_was_solved_and_goes_round_the_wheel() -> None:
    change = np.zeros((2, 2, 8, 5))
    change[:, 1] = np.arange(8.0)[:, None]
    table = water.WaterTable(np.array([3e3, 4e3]), np.array([0.0, 1e5]), change)
    at = -np.pi + np.array([0.0, 1.5, 7.5]) * np.pi / 4.0
    expected = np.array([0.0, 1.5, 3.5])[:, None] * np.ones(5)
    np.testing.assert_allclose(table.at(3.3e3, 1e5, at), expected, atol=1e-12)
    np.testing.assert_allclose(table.at(3.3e3, 5e4, at + 2.0 * np.pi), 0.5 * expected, atol=1e-12)
    assert not table.at(3.3e3, 0.0, at).any()


def test_water_carries_its_pressure_times_the_wedge_and_the_belt_shows_it() -> None:
    dry = water.solved(3400.0, 0.0)
    wet = water.solved(3400.0, 1e5, start=dry)
    assert water.lift_of(wet) == pytest.approx(water.SPREAD * 1e5, rel=0.02)
    assert water.lift_of(dry) == 0.0
    change = trace(wet, 360).strain - trace(dry, 360).strain
    assert np.abs(change).max() > 5e-4
    np.testing.assert_allclose(change, change[:, ::-1], atol=2e-6)  # both sides see the same


def test_a_load_that_both_wheels_of_an_axle_doubt_lets_suspect_water() -> None:
    load, sure = np.array([4000.0, 4000.0, 3000.0, 3000.0]), np.full(4, 40.0)
    assert math.isnan(hydroplaning.suspected(Estimates()))
    dry = hydroplaning.suspected(Estimates(Fz=load, Fz_std=sure))
    wet = np.array([40.0, 40.0, 600.0, 600.0])
    assert dry < 0.01
    found = hydroplaning.suspected(Estimates(Fz=load, Fz_std=wet))
    assert found == pytest.approx(0.2 / hydroplaning.SHOWS)
    wet[3] = 40.0
    assert hydroplaning.suspected(Estimates(Fz=load, Fz_std=wet)) < 0.6 * found


def test_the_drive_into_water_is_a_document_a_table_and_a_figure() -> None:
    way = np.linspace(0.0, 90.0, 91)
    run = Approach(way / 25.0, way, 25.0 - way / 30.0, 0.1 * (way > 16.0), 0.1 * (way > 18.0), 15e3)
    blind = dataclasses.replace(run, known=0.0 * way)
    drives = {"perfect": run, "strain": run, "today": blind}
    assert run.figures()["noticed_after_m"] == pytest.approx(3.0)
    assert run.figures()["speed_kmh"] == pytest.approx(79.2)
    rows = hydroplaning.document(drives)["rows"]
    assert rows[2]["noticed_after_m"] is None
    assert hydroplaning.missed(drives) == []
    assert len(hydroplaning.missed(drives | {"strain": blind})) == 1
    part = hydroplaning_report.part(drives)
    assert "3.0 m after" in part.text
    assert len(part.tables[0].rows) == 3
    # less speed, less water: more than the square law saves
    slow, fast = (hydroplaning.stopping_way(v, 15e3) for v in (15.0, 30.0))
    assert fast > 4.0 * slow
