"""Laws of the third-party vehicle: it is the package's own, and its wheels speak ISO 8855."""

import math

import numpy as np
import pytest

pytest.importorskip("vehiclemodels", reason="commonroad-vehicle-models is not installed")

from cosim.manoeuvres import MANOEUVRES
from cosim.recording import VEHICLE, drive
from cosim.vehicle import Controls, G, Motion, Vehicle
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb

from tirelib.core.errors import ParameterError
from tirelib.fmu.virtual.coordinates import INPUTS
from tirelib.fmu.virtual.spec import friction_surface
from tirelib.fmu.virtual.surface import read_surface

STEP = 2e-3


def drive_by(vehicle: Vehicle, controls: Controls, duration: float) -> Motion:
    for _ in range(round(duration / STEP)):
        vehicle.step(STEP, controls)
    return vehicle.look(controls)


def turned(side: float) -> Motion:
    """Return the motion in a steady turn; side = 1: to the left."""
    vehicle = Vehicle(VEHICLE, 20.0)
    drive_by(vehicle, Controls(steer_rate=side * 0.1), 0.25)
    return drive_by(vehicle, Controls(), 2.0)


@pytest.fixture(scope="module")
def left() -> Motion:
    return turned(1.0)


def test_the_opened_model_has_the_derivatives_of_the_package() -> None:
    vehicle = Vehicle(VEHICLE, 20.0)
    drive_by(vehicle, Controls(steer_rate=0.1, torque=(-200.0,) * 4), 0.3)
    slope, _ = vehicle._slope(vehicle.state, Controls(steer_rate=0.05))
    vehicle.parameters.tire = vehicle.parameters.tires[0]
    own = vehicle_dynamics_mb(vehicle.state.tolist(), [-0.05, 0.0], vehicle.parameters)
    np.testing.assert_allclose(slope, own, rtol=1e-12, atol=1e-12)


def test_at_rest_the_wheels_carry_the_weight_and_nothing_moves() -> None:
    vehicle = Vehicle(VEHICLE, 20.0)
    motion = drive_by(vehicle, Controls(), 0.5)
    np.testing.assert_allclose(motion.wheels.load, vehicle.static_load(), rtol=1e-3)
    assert vehicle.static_load().sum() == pytest.approx(G * vehicle.mass, rel=1e-6)
    np.testing.assert_allclose(motion.wheels.alpha, 0.0, atol=1e-4)
    np.testing.assert_allclose(motion.fy, 0.0, atol=2.0)
    assert abs(motion.place[1]) < 1e-3


def test_in_a_left_turn_the_signs_are_those_of_iso_8855(left: Motion) -> None:
    front_left, front_right, rear_left, rear_right = left.wheels.load
    assert left.yaw_rate > 0.1
    assert left.place[1] > 1.0
    assert front_right > 1.2 * front_left  # outer wheels load up
    assert rear_right > 1.2 * rear_left
    assert np.all(left.wheels.alpha < 0.0)  # a negative slip angle gives a positive Fy
    assert np.all(left.fy > 0.0)
    assert left.roll > 0.0  # the body leans outwards, to the right, and the wheels with it
    assert np.all(left.wheels.camber > 0.0)


def test_in_a_steady_turn_forces_balance(left: Motion) -> None:
    vehicle = Vehicle(VEHICLE, 20.0)
    assert left.wheels.load.sum() == pytest.approx(G * vehicle.mass, rel=1e-3)
    side = left.fy[:2].sum() * math.cos(left.steer) + left.fy[2:].sum()
    assert side == pytest.approx(vehicle.mass * left.speed * left.yaw_rate, rel=0.02)


def test_the_mirrored_turn_is_the_mirror_image(left: Motion) -> None:
    """To 0.3 %: the package's tire is shifted a little in combined slip (r_hx1, r_hy1, r_vy1)."""
    right = turned(-1.0)
    swap = [1, 0, 3, 2]
    for name, side in (("load", 1), ("alpha", -1), ("kappa", 1), ("camber", -1), ("speed", 1)):
        here, there = getattr(left.wheels, name), getattr(right.wheels, name)
        np.testing.assert_allclose(there[swap], side * here, rtol=3e-3, atol=1e-4, err_msg=name)
    np.testing.assert_allclose(right.fy[swap], -left.fy, rtol=3e-3, atol=5.0)


def test_a_braked_wheel_has_negative_slip_and_a_backward_force() -> None:
    vehicle = Vehicle(VEHICLE, 25.0)
    motion = drive_by(vehicle, Controls(torque=(-500.0, -500.0, -250.0, -250.0)), 0.8)
    assert np.all(motion.wheels.kappa < -1e-3)
    assert np.all(motion.fx < 0.0)
    assert motion.wheels.load[0] > motion.wheels.load[2] + 500.0
    p, force = vehicle.parameters, -motion.fx.sum()
    spinning_down = 4.0 * p.I_y_w * force / vehicle.mass / p.R_w  # torque that slows the wheels
    assert force == pytest.approx((1500.0 - spinning_down) / p.R_w, rel=5e-3)


def test_the_slip_ratio_refers_to_the_travel_speed_of_the_contact_point() -> None:
    vehicle = Vehicle(VEHICLE, 20.0)
    vehicle.state[10] = 4.0  # slides to the right, in the model's axes
    wheels = vehicle.look().wheels
    np.testing.assert_allclose(wheels.alpha, -math.atan2(4.0, 20.0), rtol=1e-3)
    np.testing.assert_allclose(wheels.speed, math.hypot(20.0, 4.0), rtol=1e-3)
    spin = vehicle.state[23:27] * vehicle.parameters.R_w
    np.testing.assert_allclose(wheels.kappa, spin / wheels.speed - 1.0, atol=1e-9)


def test_the_step_is_of_fourth_order() -> None:
    def end(step: float) -> np.ndarray:
        vehicle = Vehicle(VEHICLE, 20.0)
        for _ in range(round(0.032 / step)):
            vehicle.step(step, Controls(steer_rate=0.2, torque=(-300.0,) * 4))
        return vehicle.state

    coarse, middle, fine = end(2e-3), end(1e-3), end(5e-4)
    rate = np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)
    assert 12.0 < rate < 24.0


def test_a_slippery_road_under_the_left_wheels_takes_their_force() -> None:
    vehicle = Vehicle(VEHICLE, 25.0)
    braking = Controls(torque=(-900.0, -900.0, -500.0, -500.0), friction=(0.3, 1.0, 0.3, 1.0))
    motion = drive_by(vehicle, braking, 0.4)
    assert abs(motion.fx[0]) < 0.36 * motion.wheels.load[0]
    assert abs(motion.fx[1]) > 2.0 * abs(motion.fx[0])
    assert motion.yaw_rate < -0.02  # pulled to the side that grips


def test_a_raised_road_presses_its_wheel_and_no_other_at_once() -> None:
    vehicle = Vehicle(VEHICLE, 20.0)
    raised = vehicle.look(Controls(road=(0.0, 0.01, 0.0, 0.0))).wheels.load
    change = raised - vehicle.look().wheels.load
    np.testing.assert_allclose(change, [0.0, 0.01 * vehicle.parameters.K_zt, 0.0, 0.0], atol=1e-6)


def test_brakes_hold_a_wheel_but_do_not_turn_it_back() -> None:
    vehicle = Vehicle(VEHICLE, 20.0)
    motion = drive_by(vehicle, Controls(torque=(-4000.0, 0.0, 0.0, 0.0)), 0.3)
    assert motion.wheels.kappa[0] == pytest.approx(-1.0)
    assert np.all(vehicle.state[23:27] >= 0.0)


def test_every_manoeuvre_stays_within_the_virtual_tire() -> None:
    surface = read_surface(friction_surface())
    for manoeuvre in MANOEUVRES.values():
        if manoeuvre.name not in ("braking_in_a_turn", "kerb"):  # the hardest two for load
            continue
        for number, motion in enumerate(drive(manoeuvre)):
            if number % 5 == 0:
                rows = motion.wheels.rows()
                outside = {name for row in rows for name in surface.outside(row)}
                assert not outside, (manoeuvre.name, number, outside)
    assert INPUTS[0] == "Fz"


def test_every_vehicle_starts_at_its_own_speed_whatever_another_did() -> None:
    before = Vehicle(VEHICLE, 20.0).state.copy()
    driven = Vehicle(VEHICLE, 20.0)
    driven.state += 1.0
    np.testing.assert_array_equal(Vehicle(VEHICLE, 20.0).state, before)
    faster = Vehicle(VEHICLE, 25.0)
    assert faster.look().speed == 25.0
    assert faster.time == 0.0


def test_an_unknown_parameter_set_is_refused() -> None:
    with pytest.raises(ParameterError, match="vehicle 4; allowed are 1 to 3"):
        Vehicle(4, 20.0)
