"""Equations of motion: a rigid body, four wheels on vertical guides, four spins, relaxing tires.

Kane's equations for the velocity v and turn rate w of the body (both in its axes), the rates of the
struts and the spins. The wheels' masses are points that move along the body's vertical axis; a
wheel's own turn is a spin about its axle, without gyroscopic moments. Forces of the road act at
the contact point below the wheel's centre, so that work and energy balance exactly.

Axes ISO 8855: x forward, y left, z up; turns are yaw, pitch, roll in this order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .parameters import GRAVITY, VehicleParameters
from .tire import BrushTires

if TYPE_CHECKING:
    from tirelib.core.arrays import FloatArray

POSITION, ANGLES, TRAVEL = slice(0, 3), slice(3, 6), slice(6, 10)
VELOCITY, RATES, TRAVEL_RATE, SPIN = slice(10, 13), slice(13, 16), slice(16, 20), slice(20, 24)
SIDE_SLIP, LONG_SLIP = slice(24, 28), slice(28, 32)
SIZE = 32
"""Numbers of a state: place [m], roll, pitch, yaw [rad], strut travel [m], their rates, spins
[rad/s], and the slips that the tires feel (tangent of the angle, ratio)."""
SLOW = 0.5
"""Speed of a wheel below which its slip is not told [m/s]."""
_EPS = 1e-9


@dataclass(frozen=True)
class Controls:
    """What acts on the vehicle; arrays of shape (4,).

    Attributes
    ----------
    steer : array, [rad]
        Angle of each wheel, to the left positive.
    drive : array, [N m]
        Torque on the wheel.
    brake : array, [N m]
        Torque of the brake, >= 0, against the turn.
    friction : array
        Scale of the road's friction, > 0.
    road : array, [m]
        Height of the road.
    """

    steer: FloatArray
    drive: FloatArray
    brake: FloatArray
    friction: FloatArray
    road: FloatArray

    @classmethod
    def none(cls) -> Controls:
        """Return straight, rolling, on a dry flat road."""
        zero = np.zeros(4)
        return cls(zero, zero, zero, np.ones(4), zero)


@dataclass(frozen=True)
class Wheels:
    """What the wheels do; arrays of shape (4,).

    Attributes
    ----------
    Fz, Fx, Fy, Mz : array, [N], [N m]
        On the tires, in the wheels' axes.
    alpha : array, [rad]
        Slip angle; positive gives negative Fy.
    kappa : array
        (Omega R_e - v) / v with v the travel speed; NaN below `SLOW`.
    ratio : array
        The same with the speed in the wheel's plane.
    camber : array, [rad]
        Top to the right: positive.
    speed : array, [m/s]
        Travel speed of the contact points.
    radius : array, [m]
        R_e.
    friction : array
        Scale of the road's friction.
    """

    Fz: FloatArray
    Fx: FloatArray
    Fy: FloatArray
    Mz: FloatArray
    alpha: FloatArray
    kappa: FloatArray
    ratio: FloatArray
    camber: FloatArray
    speed: FloatArray
    radius: FloatArray
    friction: FloatArray


@dataclass(frozen=True)
class Motion:
    """Derivative of a state, what the wheels do, and the powers [W] that change the energy."""

    rate: FloatArray
    wheels: Wheels
    power: float
    acceleration: FloatArray  # of the body's centre of gravity, in its axes


@dataclass(frozen=True)
class Vehicle:
    """A vehicle with its tires."""

    parameters: VehicleParameters
    tires: BrushTires

    @cached_property
    def _unsprung(self) -> FloatArray:
        return self.parameters.per_wheel(self.parameters.unsprung_mass)

    @cached_property
    def _springs(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        p = self.parameters
        return p.per_wheel(p.spring), p.per_wheel(p.damper), p.per_wheel(p.stabilizer)

    def at_rest(self, speed: float, yaw: float = 0.0) -> FloatArray:
        """Return the state that rolls straight at a speed [m/s], springs in balance."""
        p = self.parameters
        state = np.zeros(SIZE)
        state[2], state[5], state[10] = p.height, yaw, speed
        state[SPIN] = speed / self.rolling_radius(p.static_load)
        return state

    def rolling_radius(self, load: FloatArray) -> FloatArray:
        """Return R_e [m]."""
        base, slope = self.parameters.rolling_radius
        return base + slope * load

    def energy(self, state: FloatArray, road: FloatArray) -> float:
        """Return the energy of motion, height, springs and tires [J]."""
        p, mass = self.parameters, self._unsprung
        spring, _, stabilizer = self._springs
        turn = rotation(state[ANGLES])
        place, speed = _wheel_motion(state, p)
        v, w, s = state[VELOCITY], state[RATES], state[TRAVEL]
        heights = state[2] + turn[2] @ place
        pressed = np.maximum(road + p.tire_radius - heights, 0.0)
        kinetic = 0.5 * (
            p.sprung_mass * v @ v
            + np.asarray(p.inertia) @ w**2
            + mass @ (speed**2).sum(axis=0)
            + p.spin_inertia * state[SPIN] @ state[SPIN]
        )
        high = GRAVITY * (p.sprung_mass * state[2] + mass @ heights)
        held = p.preload @ s + 0.5 * (spring @ s**2) + 0.25 * stabilizer @ (s - p.opposite(s)) ** 2
        return float(kinetic + high + held + 0.5 * p.tire_spring * pressed @ pressed)

    def motion(self, state: FloatArray, given: Controls) -> Motion:
        """Return the derivative of a state and what goes with it."""
        p = self.parameters
        turn = rotation(state[ANGLES])
        place, speed = _wheel_motion(state, p)
        v, w = state[VELOCITY], state[RATES]
        around, above = skew(w), skew(turn[2])
        axle, wheels, contact, slip_rates = self._road(
            state, given, (turn[2], above, around @ turn[2]), place, speed
        )
        force, lever = contact
        torque = given.drive - given.brake * np.tanh(state[SPIN] / p.brake_band)
        about = (lever * axle).sum(axis=0)  # moment of the road about the axles
        strut = self._struts(state)
        drag = -p.drag * np.sqrt(v @ v + _EPS) * v
        body = self._accelerate(
            turn[2],
            place,
            (v, w, around, state[TRAVEL_RATE]),
            (force, strut, drag),
            lever - (about + torque) * axle,
        )
        rate = np.empty(SIZE)
        rate[POSITION] = turn @ v
        rate[ANGLES] = angle_rates(state[ANGLES], w)
        rate[TRAVEL], rate[TRAVEL_RATE] = state[TRAVEL_RATE], body[6:]
        rate[VELOCITY], rate[RATES] = body[:3], body[3:6]
        rate[SPIN] = (torque + about) / p.spin_inertia
        rate[SIDE_SLIP], rate[LONG_SLIP] = slip_rates
        power = self._power(
            state,
            (axle, torque),
            (force, lever, about),
            (turn, place, speed),
            (wheels, given.road, drag),
        )
        return Motion(rate, wheels, power, body[:3] + around @ v)

    def _road(
        self,
        state: FloatArray,
        given: Controls,
        vertical: Any,
        place: FloatArray,
        speed: FloatArray,
    ) -> Any:
        """Return axles, wheel quantities, force and moment of the road in the body's axes."""
        p = self.parameters
        up, above, tilting = vertical  # the world's vertical, as a cross product, turned by w
        axle = np.array((-np.sin(given.steer), np.cos(given.steer), np.zeros(4)))
        lean = up @ axle
        level = np.sqrt(1.0 - lean**2)
        ahead = above @ axle / -level
        aside = above @ ahead
        height = state[2] + up @ place - given.road
        pressed = p.tire_radius - height
        load = p.tire_spring * pressed - p.tire_damper * (up @ speed)
        load = np.where(pressed > 0.0, np.maximum(load, 0.0), 0.0)
        touching = speed - height * tilting[:, None]
        v_x, v_y = (touching * ahead).sum(axis=0), (touching * aside).sum(axis=0)
        radius = self.rolling_radius(load)
        roll = state[SPIN] * radius - v_x
        way = np.abs(v_x)
        side, long = state[SIDE_SLIP], state[LONG_SLIP]
        camber = np.arcsin(lean)
        Fx, Fy, Mz = self.tires.forces(
            load, np.arctan(side), np.maximum(long, -1.0), camber, given.friction
        )
        rates = ((v_y - way * side) / p.relaxation[0], (roll - way * long) / p.relaxation[1])
        travel = np.hypot(v_x, v_y)
        slow = v_x < SLOW
        ratio = np.where(slow, np.nan, roll / np.where(slow, 1.0, v_x))
        kappa = np.where(slow, np.nan, state[SPIN] * radius / np.where(slow, 1.0, travel) - 1.0)
        wheels = Wheels(
            load,
            Fx,
            Fy,
            Mz,
            np.arctan2(v_y, way),
            kappa,
            ratio,
            camber,
            travel,
            radius,
            given.friction,
        )
        flat = Fx * ahead + Fy * aside
        lever = Mz * up[:, None] - height * (above @ flat)
        return axle, wheels, (flat + load * up[:, None], lever), rates

    def _struts(self, state: FloatArray) -> FloatArray:
        """Return the force of the struts on the body, upward, [N]."""
        spring, damper, stabilizer = self._springs
        s = state[TRAVEL]
        return np.asarray(
            self.parameters.preload
            + spring * s
            + damper * state[TRAVEL_RATE]
            + stabilizer * (s - self.parameters.opposite(s))
        )

    def _accelerate(
        self, up: FloatArray, place: FloatArray, rates: Any, forces: Any, moments: FloatArray
    ) -> FloatArray:
        """Solve for the accelerations of body (3 and 3) and struts (4)."""
        p, mass = self.parameters, self._unsprung
        v, w, around, travel_rate = rates
        force, strut, drag = forces
        inertia = np.asarray(p.inertia)
        down = -GRAVITY * up
        x, y, z = place
        carried = around @ v
        own = carried[:, None] + around @ (around @ place)
        own[0] += 2.0 * w[1] * travel_rate
        own[1] -= 2.0 * w[0] * travel_rate
        free = force + mass * (down[:, None] - own)  # on a wheel's mass, guides left out
        push = np.array((free[0], free[1], strut))
        right = np.empty(6)
        right[:3] = p.sprung_mass * (down - carried) + drag + push.sum(axis=1)
        right[3:] = (cross(place, push) + moments).sum(axis=1) - around @ (inertia * w)
        mx, my, mz = mass @ x, mass @ y, mass @ z
        whole = p.sprung_mass + mass.sum()
        left = np.zeros((6, 6))
        left[0, 0] = left[1, 1] = whole
        left[2, 2] = p.sprung_mass
        left[0, 4] = left[4, 0] = mz
        left[0, 5] = left[5, 0] = -my
        left[1, 3] = left[3, 1] = -mz
        left[1, 5] = left[5, 1] = mx
        left[3, 3] = inertia[0] + mass @ z**2
        left[4, 4] = inertia[1] + mass @ z**2
        left[5, 5] = inertia[2] + mass @ (x**2 + y**2)
        left[3, 5] = left[5, 3] = -(mass @ (x * z))
        left[4, 5] = left[5, 4] = -(mass @ (y * z))
        found = np.linalg.solve(left, right)
        vertical = (free[2] - strut) / mass - found[2] - (found[3] * y - found[4] * x)
        return np.concatenate((found, vertical))

    def _power(self, state: FloatArray, shafts: Any, road: Any, places: Any, rest: Any) -> float:
        """Return the power of shafts, tires, dampers and drag [W]: what changes the energy."""
        p = self.parameters
        axle, torque = shafts
        force, lever, about = road
        turn, place, speed = places
        wheels, height, drag = rest
        v, w, spin = state[VELOCITY], state[RATES], state[SPIN]
        _, damper, _ = self._springs
        up = turn[2]
        shaft = torque @ (spin - w @ axle)
        flat = force - wheels.Fz * up[:, None]
        slide = (flat * speed).sum() + ((lever - about * axle) * w[:, None]).sum() + about @ spin
        sink = up @ speed
        pressed = np.maximum(height + p.tire_radius - state[2] - up @ place, 0.0)
        dent = (wheels.Fz - p.tire_spring * pressed) @ sink
        return float(shaft + slide + dent - damper @ state[TRAVEL_RATE] ** 2 + drag @ v)


def skew(a: FloatArray) -> FloatArray:
    """Return the matrix that makes a x b of b."""
    x, y, z = a.tolist()
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return a x b over the first axis, both of shape (3, n)."""
    found = np.empty_like(a)
    found[0] = a[1] * b[2] - a[2] * b[1]
    found[1] = a[2] * b[0] - a[0] * b[2]
    found[2] = a[0] * b[1] - a[1] * b[0]
    return found


def rotation(angles: FloatArray) -> FloatArray:
    """Return the matrix from the body's axes to the world's, of roll, pitch and yaw [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles).tolist(), np.sin(angles).tolist()
    return np.array(
        (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )
    )


def angle_rates(angles: FloatArray, w: FloatArray) -> FloatArray:
    """Return the rates of roll, pitch and yaw of a turn rate in the body's axes."""
    (cr, cp, _), (sr, sp, _) = np.cos(angles).tolist(), np.sin(angles).tolist()
    yaw = (w[1] * sr + w[2] * cr) / cp
    return np.array((w[0] + yaw * sp, w[1] * cr - w[2] * sr, yaw))


def _wheel_motion(state: FloatArray, p: VehicleParameters) -> tuple[FloatArray, FloatArray]:
    """Return places and velocities of the wheel centres in the body's axes, shape (3, 4)."""
    place = np.array((p.x, p.y, p.z + state[TRAVEL]))
    speed = state[VELOCITY][:, None] + skew(state[RATES]) @ place
    speed[2] += state[TRAVEL_RATE]
    return place, speed
