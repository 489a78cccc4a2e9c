"""The 14-degrees-of-freedom vehicle: laws of mechanics."""

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cosim.vehicle14.files import TIRE_FILE, make_vehicle, usual_tires
from cosim.vehicle14.model import (
    ANGLES,
    LONG_SLIP,
    RATES,
    SIDE_SLIP,
    SIZE,
    SPIN,
    TRAVEL,
    Controls,
    Motion,
    Vehicle,
    rotation,
)
from cosim.vehicle14.parameters import GRAVITY, VehicleParameters
from cosim.vehicle14.run import Drive, advance
from cosim.vehicle14.tire import BrushTires, tires_of
from scipy.integrate import simpson
from scipy.optimize import root

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.brush import predict

LEFT_RIGHT = np.array([1, 0, 3, 2])
TURNING = replace(
    Controls.none(),
    steer=np.array([0.02, 0.02, 0.0, 0.0]),
    brake=np.array([700.0, 600.0, 200.0, 150.0]),
)


@pytest.fixture(scope="module")
def vehicle() -> Vehicle:
    return make_vehicle()


def driven(
    vehicle: Vehicle, time: float, given: Controls, step: float = 1e-3, speed: float = 25.0
) -> tuple[Drive, list[Any]]:
    drive = Drive(vehicle, vehicle.at_rest(speed), step)
    motions = [drive.look(given)]
    for _ in range(round(time / step)):
        motions.append(drive.step(step, given))
    return drive, motions


def steady_turn(vehicle: Vehicle, steer: float, speed: float) -> tuple[FloatArray, Motion]:
    """Solve for the state in which only place and heading change, the front wheels pushing."""
    free = [i for i in range(SIZE) if i not in (0, 1, 5, 10)]  # place, heading, speed are given
    equations = [i for i in range(SIZE) if i not in (0, 1, 5)]
    turn = np.array([steer, steer, 0.0, 0.0])

    def unpack(x: FloatArray) -> tuple[FloatArray, Controls]:
        state = vehicle.at_rest(speed)
        state[free] += x[:-1]
        push = 1e3 * x[-1] * np.array([1.0, 1.0, 0.0, 0.0])
        return state, replace(Controls.none(), steer=turn, drive=push)

    found = root(lambda x: vehicle.motion(*unpack(x)).rate[equations], np.zeros(len(free) + 1))
    state, given = unpack(found.x)
    motion = vehicle.motion(state, given)
    assert np.abs(motion.rate[equations]).max() < 1e-5
    return state, motion


def test_at_rest_every_mass_is_in_balance(vehicle: Vehicle) -> None:
    """The springs carry the weight: no vertical acceleration, no moment in roll."""
    calm = replace(vehicle.parameters, drag=0.0)  # drag and rolling resistance would pitch it
    still = Vehicle(calm, _NoForce({}, None))
    motion = still.motion(still.at_rest(20.0), Controls.none())
    p = vehicle.parameters
    assert motion.wheels.Fz.sum() == pytest.approx(p.mass * GRAVITY, rel=1e-12)
    assert motion.wheels.Fz @ p.y == pytest.approx(0.0, abs=1e-9)
    # moment about the centre of gravity of the whole: unsprung masses lie at the wheels
    unsprung = p.per_wheel(p.unsprung_mass)
    assert motion.wheels.Fz @ p.x == pytest.approx(GRAVITY * unsprung @ p.x, abs=1e-8)
    assert motion.rate[12] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(motion.rate[16:20]).max() < 1e-10


def test_load_transfer_is_mass_acceleration_height_over_track(vehicle: Vehicle) -> None:
    """In a steady turn the moments about the middle of the track are in balance."""
    p = vehicle.parameters
    state, motion = steady_turn(vehicle, 0.02, 25.0)
    wheels = motion.wheels
    turn = rotation(state[ANGLES])
    places = turn @ np.stack((p.x, p.y, p.z + state[TRAVEL]))
    aside, heights = float(turn[1] @ motion.acceleration), state[2] + places[2]
    unsprung = p.per_wheel(p.unsprung_mass)
    tipping = aside * (p.sprung_mass * state[2] + unsprung @ heights)
    holding = -float(places[1] @ (wheels.Fz - GRAVITY * unsprung))
    assert aside > 3.0
    # what is left: centripetal accelerations of the wheels differ from the body's
    assert holding == pytest.approx(tipping, rel=2e-3)
    # and so load moves by m a h / t, but for the lean
    transfer = 0.5 * (wheels.Fz[[1, 3]].sum() - wheels.Fz[[0, 2]].sum())
    lean = p.mass * GRAVITY * 0.28 * abs(float(state[3]))
    assert transfer * 1.545 == pytest.approx(p.mass * aside * p.whole_height + lean, rel=0.02)


def test_braking_moves_load_to_the_front(vehicle: Vehicle) -> None:
    """m a h / wheelbase, in steady braking; the pitch that is left is worth 2 %."""
    p = vehicle.parameters
    given = replace(Controls.none(), brake=np.array([900.0, 900.0, 300.0, 300.0]))
    drive, _ = driven(vehicle, 1.6, given, 4e-3, 30.0)
    gain = drive.motion.wheels.Fz[:2].sum() - p.static_load[:2].sum()
    expected = -drive.motion.wheels.Fx.sum() * p.whole_height / (p.front + p.rear)
    drag = p.drag * float(drive.state[10]) ** 2 * p.height / (p.front + p.rear)
    assert gain == pytest.approx(expected + drag, rel=0.02)


def test_energy_is_kept_without_dissipation() -> None:
    """No dampers, no drag, no friction to speak of: springs, height and motion trade only."""
    soft = replace(VehicleParameters(), damper=(0.0, 0.0), tire_damper=0.0, drag=0.0, height=0.57)
    vehicle = replace(make_vehicle(soft), tires=_NoForce({}, None))
    state = vehicle.at_rest(25.0)
    state[2] += 3e-3
    state[3:5] = 4e-3, 2e-3
    state[RATES] = 0.03, -0.02, 0.3
    before, road = vehicle.energy(state, np.zeros(4)), np.zeros(4)
    swing = []
    for _ in range(600):
        state = advance(vehicle, state, Controls.none(), 5e-4)
        swing.append(vehicle.parameters.spring[0] * float(state[TRAVEL] @ state[TRAVEL]))
    assert np.ptp(swing) > 5.0  # [J]: it does swing
    # the fourth-order method takes 1 mJ of a wheel hop of 12 Hz in these steps
    assert vehicle.energy(state, road) == pytest.approx(before, abs=1e-2)


class _NoForce(BrushTires):
    """Tires on ice."""

    def forces(self, load: FloatArray, *_: FloatArray) -> tuple[FloatArray, ...]:
        return np.zeros(4), np.zeros(4), np.zeros(4)


def test_energy_changes_by_the_work_of_brakes_tires_dampers_and_drag(vehicle: Vehicle) -> None:
    drive, motions = driven(vehicle, 0.3, TURNING, 1e-3)
    work = simpson([motion.power for motion in motions], dx=1e-3)
    start = vehicle.energy(vehicle.at_rest(25.0), TURNING.road)
    change = vehicle.energy(drive.state, TURNING.road) - start
    assert change < -2e4
    # Simpson's rule on a first step that jumps: 1 J of tens of kJ
    assert change == pytest.approx(work, abs=1.0)


def test_mirror_image(vehicle: Vehicle) -> None:
    """Left for right: the mirrored controls give the mirrored motion, bit by bit near enough."""
    road = replace(TURNING, friction=np.array([0.5, 1.0, 0.6, 1.0]))
    other = replace(
        road, steer=-road.steer, brake=road.brake[LEFT_RIGHT], friction=road.friction[LEFT_RIGHT]
    )
    one, _ = driven(vehicle, 0.3, road, 2e-3)
    two, _ = driven(vehicle, 0.3, other, 2e-3)
    sign = np.array(
        [1, -1, 1, -1, 1, -1, *[1] * 4, 1, -1, 1, -1, 1, -1, *[1] * 8, *[-1] * 4, *[1] * 4]
    )
    mirrored = two.state * sign
    for part in (TRAVEL, slice(16, 20), SPIN, SIDE_SLIP, LONG_SLIP):
        mirrored[part] = mirrored[part][LEFT_RIGHT]
    assert abs(one.state[5]) > 0.015
    np.testing.assert_allclose(one.state, mirrored, rtol=0, atol=1e-10)


def test_the_integrator_is_of_fourth_order(vehicle: Vehicle) -> None:
    """Halving the step divides the error by sixteen while nothing jumps."""

    def end(step: float) -> FloatArray:
        state = vehicle.at_rest(25.0)
        state[SIDE_SLIP] = 0.0
        gentle = replace(TURNING, brake=np.full(4, 100.0), steer=np.array([4e-3, 4e-3, 0, 0]))
        for _ in range(round(0.032 / step)):
            state = advance(vehicle, state, gentle, step)
        return state

    ends = [end(step) for step in (2e-3, 1e-3, 5e-4, 1.25e-4)]
    errors = np.abs(np.array(ends[:3]) - ends[-1])[:, 10:].max(axis=1)
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(4.0, abs=0.2)


def test_understeer_gradient_is_that_of_the_bicycle(vehicle: Vehicle) -> None:
    """At small slip: yaw rate per steering angle of the linear single-track model.

    Its stiffnesses are slopes of the same tires at their static loads; the camber that comes from
    rolling is switched off.
    """
    p = vehicle.parameters
    upright = {"camber": 0.0, "camber_load": 0.0, "rolling": 0.0}
    tires = BrushTires(dict(usual_tires().constants) | upright, predict)
    car = Vehicle(replace(p, drag=0.0), tires)
    h, zero = 1e-6, np.zeros(4)
    plus = tires.forces(p.static_load, zero + h, zero, zero, zero + 1.0)
    minus = tires.forces(p.static_load, zero - h, zero, zero, zero + 1.0)
    stiff, trail = (-(a - b) / (2.0 * h) for a, b in zip(plus[1:], minus[1:], strict=True))
    a, b = p.front, -p.rear
    y = np.array([stiff[:2].sum(), stiff[2:].sum()])
    n = np.array([a, b]) * y + np.array([trail[:2].sum(), trail[2:].sum()])
    for speed in (15.0, 25.0):
        # 0 = sum F - m v r, 0 = sum M with alpha_i = beta + x_i r / v - delta_i
        x = np.array([a, b])
        shift = float(p.per_wheel(p.unsprung_mass) @ p.x)  # of the whole's centre of gravity
        matrix = np.array(
            [
                [-y.sum(), -(y @ x) / speed - p.mass * speed],
                [-n.sum(), -(n @ x) / speed - shift * speed],
            ]
        )
        _, yaw_rate = np.linalg.solve(matrix, [-y[0], -n[0]])
        steer = 1e-4
        state, _ = steady_turn(car, steer, speed)
        assert state[15] / steer == pytest.approx(yaw_rate, rel=1e-3)


def test_a_bump_lifts_one_wheel_and_low_friction_lets_one_slide(vehicle: Vehicle) -> None:
    kerb = replace(Controls.none(), road=np.array([0.02, 0.0, 0.0, 0.0]))
    load = vehicle.motion(vehicle.at_rest(20.0), kerb).wheels.Fz - vehicle.parameters.static_load
    assert load == pytest.approx([0.02 * vehicle.parameters.tire_spring, 0, 0, 0], abs=1e-6)
    split = replace(
        Controls.none(),
        brake=np.array([700.0, 700.0, 400.0, 400.0]),
        friction=np.array([0.3, 1.0, 0.3, 1.0]),
    )
    drive, _ = driven(vehicle, 0.15, split, 2e-3)
    kappa = drive.motion.wheels.kappa
    assert np.all(kappa[[0, 2]] < -0.2)
    assert np.all(kappa[[1, 3]] > -0.06)
    assert drive.state[15] < -0.05  # it turns to the side that grips


def test_a_wheel_off_the_road_has_no_force(vehicle: Vehicle) -> None:
    hole = replace(TURNING, road=np.array([-0.2, 0.0, 0.0, 0.0]))
    wheels = vehicle.motion(vehicle.at_rest(20.0), hole).wheels
    assert (wheels.Fz[0], wheels.Fx[0], wheels.Fy[0], wheels.Mz[0]) == (0.0, 0.0, 0.0, 0.0)


def test_bad_parameters_and_files_are_named() -> None:
    with pytest.raises(ParameterError, match=r"height = -1.*must be > 0"):
        make_vehicle(replace(VehicleParameters(), height=-1.0))
    document = tomllib.loads(TIRE_FILE.read_text(encoding="utf-8"))
    with pytest.raises(ValueError, match="constants: a missing"):
        tires_of(document | {"constants": document["constants"] | {"a": "wide"}}, predict)
    with pytest.raises(ValueError, match="format"):
        tires_of(document | {"format": "other"}, predict)
