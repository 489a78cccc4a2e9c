"""What the driver and the road do: each manoeuvre is a small function of time and motion.

Steering follows a wanted angle of the front wheels, braking a wanted deceleration. Torque is split
between the axles; a light hand on the accelerator holds the speed where a manoeuvre says so. All
steer to the left first.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from cosim.vehicle import Controls, Motion, Vehicle

Driver = Callable[[float, Motion], Controls]
KMH = 1.0 / 3.6
STEER_LAG = 0.05
"""Time in which the driver's hands follow the wanted angle [s]."""
HOLD = 2.0
"""Deceleration per speed that is missing, while the speed is held [1/s]."""


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """A drive of a vehicle.

    Attributes
    ----------
    name, about : str
    speed : float, [m/s]
        At the start.
    duration : float, [s]
    driver : callable
        From a vehicle to a function of time and motion that returns `Controls`.
    """

    name: str
    about: str
    speed: float
    duration: float
    driver: Callable[[Vehicle], Driver]


def ramp(t: float, start: float, end: float) -> float:
    """Return 0 before, 1 after, and half a cosine between two moments."""
    share = min(max((t - start) / (end - start), 0.0), 1.0)
    return 0.5 - 0.5 * math.cos(math.pi * share)


def _torque(vehicle: Vehicle, deceleration: float, holds: float = 0.0) -> tuple[float, ...]:
    """Return wheel torques [N m] that brake by a deceleration, or drive the rear by `holds`."""
    p = vehicle.parameters
    whole = -p.m * p.R_w * deceleration
    front, rear = 0.5 * p.T_sb * whole, 0.5 * (1.0 - p.T_sb) * whole
    drive = 0.5 * p.m * p.R_w * holds
    return front, front, rear + drive, rear + drive


def _steer(wanted: float, motion: Motion) -> float:
    return (wanted - motion.steer) / STEER_LAG


def _step_steer(vehicle: Vehicle) -> Driver:
    def drive(t: float, motion: Motion) -> Controls:
        angle = math.radians(1.75) * ramp(t, 1.0, 1.2)
        holds = HOLD * (80.0 * KMH - motion.speed)
        return Controls(_steer(angle, motion), _torque(vehicle, 0.0, holds))

    return drive


def _double_lane_change(vehicle: Vehicle) -> Driver:
    """Follow a path by looking ahead; gates as in ISO 3888-1, 3.5 m aside, longer ramps."""

    def path(x: float) -> float:
        return 3.5 * (ramp(x, 35.0, 70.0) - ramp(x, 95.0, 127.0))

    def drive(t: float, motion: Motion) -> Controls:
        ahead = 0.75 * motion.speed
        x, y = motion.place
        heading = motion.heading
        aim = path(x + ahead) - y
        angle = 0.35 * (math.atan2(aim, ahead) - heading - motion.side_slip)
        holds = HOLD * (80.0 * KMH - motion.speed)
        return Controls(_steer(angle, motion), _torque(vehicle, 0.0, holds))

    return drive


def _slalom(vehicle: Vehicle) -> Driver:
    def drive(t: float, motion: Motion) -> Controls:
        angle = math.radians(2.0) * ramp(t, 0.5, 1.5) * math.sin(2.0 * math.pi * 0.5 * (t - 0.5))
        holds = HOLD * (70.0 * KMH - motion.speed)
        return Controls(_steer(angle if t > 0.5 else 0.0, motion), _torque(vehicle, 0.0, holds))

    return drive


def _braking_in_a_turn(vehicle: Vehicle) -> Driver:
    def drive(t: float, motion: Motion) -> Controls:
        angle = math.radians(1.0) * ramp(t, 0.5, 1.0)
        holds = HOLD * (80.0 * KMH - motion.speed) * (1.0 - ramp(t, 2.0, 2.1))
        return Controls(_steer(angle, motion), _torque(vehicle, 2.5 * ramp(t, 2.0, 2.3), holds))

    return drive


def _abs_pulses(vehicle: Vehicle) -> Driver:
    """Brake pressure rises and falls three times a second, as under an anti-lock system."""

    def drive(t: float, motion: Motion) -> Controls:
        beat = 0.5 - 0.5 * math.cos(2.0 * math.pi * 3.0 * (t - 1.0))
        pulse = np.clip(1.6 * beat - 0.3, 0.0, 1.0)
        return Controls(_steer(0.0, motion), _torque(vehicle, 7.0 * float(pulse) * (t > 1.0)))

    return drive


def _split(vehicle: Vehicle) -> Driver:
    """Brake with the left wheels on a road of 45 % friction; the driver holds the course."""

    def drive(t: float, motion: Motion) -> Controls:
        slippery = 0.45 if t > 1.0 else 1.0
        angle = -0.4 * motion.heading - 0.15 * motion.yaw_rate
        return Controls(
            _steer(angle, motion),
            _torque(vehicle, 4.5 * ramp(t, 1.5, 1.8)),
            friction=(slippery, 1.0, slippery, 1.0),
        )

    return drive


def _slippery_turn(vehicle: Vehicle) -> Driver:
    """Reach larger slip angles than a dry road allows before the vehicle leans too far."""

    def drive(t: float, motion: Motion) -> Controls:
        angle = math.radians(4.5) * ramp(t, 0.5, 1.5)
        holds = HOLD * (60.0 * KMH - motion.speed)
        return Controls(_steer(angle, motion), _torque(vehicle, 0.0, holds), friction=(0.4,) * 4)

    return drive


def _kerb(vehicle: Vehicle) -> Driver:
    """Pass a ledge of 15 mm, 0.4 m long with rounded ends, with the right wheels only."""
    base = vehicle.parameters.a + vehicle.parameters.b

    def ledge(x: float) -> float:
        return 0.015 * (ramp(x, 0.0, 0.12) - ramp(x, 0.28, 0.4))

    def drive(t: float, motion: Motion) -> Controls:
        front = motion.place[0] - 30.0
        heights = (0.0, ledge(front), 0.0, ledge(front - base))
        holds = HOLD * (60.0 * KMH - motion.speed)
        return Controls(_steer(0.0, motion), _torque(vehicle, 0.0, holds), road=heights)

    return drive


MANOEUVRES: Mapping[str, Manoeuvre] = MappingProxyType(
    {
        m.name: m
        for m in (
            Manoeuvre(
                "step_steer",
                "80 km/h, front wheels to 1.75 deg in 0.2 s",
                80.0 * KMH,
                3.5,
                _step_steer,
            ),
            Manoeuvre(
                "double_lane_change",
                "80 km/h, 3.5 m to the left and back",
                80.0 * KMH,
                6.0,
                _double_lane_change,
            ),
            Manoeuvre(
                "slalom", "70 km/h, 0.5 Hz, front wheels to +-2 deg", 70.0 * KMH, 5.0, _slalom
            ),
            Manoeuvre(
                "braking_in_a_turn",
                "80 km/h, left turn, then 2.5 m/s^2",
                80.0 * KMH,
                5.0,
                _braking_in_a_turn,
            ),
            Manoeuvre(
                "abs_pulses",
                "100 km/h, brake pulses of 7 m/s^2 at 3 Hz",
                100.0 * KMH,
                3.5,
                _abs_pulses,
            ),
            Manoeuvre(
                "mu_split",
                "90 km/h, 4.5 m/s^2, left wheels on 45 % friction",
                90.0 * KMH,
                5.0,
                _split,
            ),
            Manoeuvre(
                "slippery_turn",
                "60 km/h, 40 % friction, front wheels to 4.5 deg",
                60.0 * KMH,
                5.0,
                _slippery_turn,
            ),
            Manoeuvre(
                "kerb", "60 km/h, right wheels over a ledge of 15 mm", 60.0 * KMH, 3.0, _kerb
            ),
        )
    }
)
"""All manoeuvres by name, in the order of the page."""
