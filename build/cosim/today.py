"""What today's sensors tell of a vehicle, and an anti-lock brake that needs nothing else.

Sensors: four wheel speeds, a gyroscope, an accelerometer. They are ideal, without noise, offset or
delay; the accelerometer feels gravity as the body pitches.

**Reference speed.** The accelerometer carries the speed on, with the constant part of the pitch
taken out; a braked wheel never rolls faster than the road, so the fastest of the four wheels,
carried to the middle of the vehicle by the yaw rate, lifts it.

**Anti-lock brake.** The control cycle of the Bosch Automotive Handbook (chapter on antilock braking
systems): each wheel passes through phases of building, holding and releasing its pressure, by
thresholds of its circumferential acceleration and of its slip against the reference speed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType

import numpy as np

from cosim.vehicle14.model import ANGLES, RATES, SPIN, Motion, rotation
from cosim.vehicle14.parameters import GRAVITY, VehicleParameters
from tirelib.core.arrays import FloatArray


@dataclass(frozen=True)
class Sensors:
    """What is measured now, ISO 8855.

    Attributes
    ----------
    omega : array, shape (4,), [rad/s]
        Turn rates of the wheels.
    yaw_rate : float, [rad/s]
    acceleration : array, shape (3,), [m/s^2]
        What an accelerometer in the body shows: gravity is in it.
    """

    omega: FloatArray
    yaw_rate: float
    acceleration: FloatArray

    @classmethod
    def of(cls, state: FloatArray, motion: Motion) -> "Sensors":
        """Return what the sensors of a vehicle in this state show."""
        up = rotation(state[ANGLES])[2]
        return cls(state[SPIN], float(state[RATES][2]), motion.acceleration + GRAVITY * up)


@dataclass(frozen=True)
class SpeedEstimator:
    """The speed of the vehicle's middle from today's sensors.

    Attributes
    ----------
    radius : float, [m]
        Effective rolling radius of every wheel, from rolling freely.
    half_track : float, [m]
    pitch : float
        Share of the deceleration by which the body's pitch makes the accelerometer show too much;
        a constant of the suspension, measured once by braking evenly.
    lift : float, [s]
        Time constant by which a faster wheel lifts the speed: a wheel that comes back swings over.
    """

    radius: float = (
        VehicleParameters.rolling_radius[0] + 3780.0 * (VehicleParameters.rolling_radius[1])
    )
    half_track: float = 0.5 * VehicleParameters.track[0]
    pitch: float = 0.0
    lift: float = 0.1

    def wheels(self, sensors: Sensors) -> FloatArray:
        """Return the speeds of the rims [m/s], carried to the vehicle's middle, shape (4,)."""
        side = np.array([1.0, -1.0, 1.0, -1.0])  # left wheels are slower in a left turn
        return sensors.omega * self.radius + side * self.half_track * sensors.yaw_rate

    def step(self, speed: float, sensors: Sensors, step: float) -> float:
        """Return the speed [m/s] a step [s] after it was `speed`."""
        along = float(sensors.acceleration[0]) / (1.0 + self.pitch)
        slower = max(float(self.wheels(sensors).max()) - speed, 0.0)
        return speed + (along + slower / self.lift) * step


class Phase(Enum):
    """Where a wheel is in its control cycle."""

    FREE = auto()
    """The driver's pressure builds, nothing has happened yet."""
    WAIT = auto()
    """Held: the rim slows too fast; the slip decides whether that is the brake's doing."""
    RELEASE = auto()
    RECOVER = auto()
    """Held low: the wheel comes back."""
    REBUILD = auto()
    """Built fast: it comes back very fast, so the road grips again."""
    GRIP = auto()
    """Held: it still gains speed."""
    STEPS = auto()
    """Built slowly, up to the next sign of locking."""


@dataclass(frozen=True)
class AntiLock:
    """Thresholds and rates of the control cycle.

    Attributes
    ----------
    slows : float, [m/s^2]
        -a: deceleration of the rim that announces locking.
    gains, leaps : float, [m/s^2]
        +a and +A: accelerations of the rim by which it has come back, and comes back very fast.
    slip : float
        lambda_1, of slip against the reference speed.
    build, release, steps : float, [N m / s]
        Rates of the torque; `steps` that of the slow pulses.
    patience : float, [s]
        A wheel that has not come back after so long at low pressure is released further: the
        handbook's cycle for slippery roads.
    smooth : float, [s]
        Time constant of the rim's acceleration.
    """

    slows: float = 14.0
    gains: float = 3.0
    leaps: float = 40.0
    slip: float = 0.10
    build: float = 6e3
    release: float = 2e4
    steps: float = 1.0e3
    patience: float = 0.04
    smooth: float = 0.006

    def next(self, phase: Phase, rim: float, slip: float, since: float) -> Phase:
        """Return the phase of a wheel after one step.

        Parameters
        ----------
        phase : Phase
        rim : float, [m/s^2]
            Acceleration of the rim.
        slip : float
            Positive when braking.
        since : float, [s]
            How long the phase has lasted.
        """
        locking, deep = rim < -self.slows, slip > self.slip
        match phase:
            case Phase.FREE if locking or deep:
                return Phase.WAIT
            case Phase.WAIT if deep:
                return Phase.RELEASE
            case Phase.WAIT if not locking:
                return Phase.STEPS
            case Phase.RELEASE if not locking and since > 0.0:
                return Phase.RECOVER
            case Phase.RECOVER if rim > self.leaps:
                return Phase.REBUILD
            case Phase.RECOVER if deep and rim < self.gains and since > self.patience:
                return Phase.RELEASE
            case Phase.RECOVER if not deep and rim < self.gains:
                return Phase.STEPS
            case Phase.REBUILD if rim < self.leaps:
                return Phase.GRIP
            case Phase.GRIP if rim < self.gains:
                return Phase.STEPS
            case Phase.STEPS if locking or deep:
                return Phase.RELEASE
        return phase

    @property
    def rates(self) -> Mapping[Phase, float]:
        """Change of the torque in each phase [N m / s]."""
        built = {Phase.FREE: self.build, Phase.REBUILD: self.build, Phase.STEPS: self.steps}
        return MappingProxyType(dict.fromkeys(Phase, 0.0) | built | {Phase.RELEASE: -self.release})


class TodaysBrakes:
    """An anti-lock brake with today's sensors; the torque of each wheel is its pressure.

    Parameters
    ----------
    rules : AntiLock, optional
    """

    def __init__(self, rules: AntiLock | None = None) -> None:
        self.rules = rules or AntiLock()
        self.phases = [Phase.FREE] * 4
        self._since = np.zeros(4)
        self._rim: FloatArray | None = None
        self.acceleration = np.zeros(4)
        self.torque = np.zeros(4)

    def step(self, rims: FloatArray, speed: float, most: FloatArray, step: float) -> FloatArray:
        """Return brake torques [N m], shape (4,).

        Parameters
        ----------
        rims : array, shape (4,), [m/s]
            Speeds of the rims at the vehicle's middle.
        speed : float, [m/s]
            Reference speed.
        most : array, shape (4,), [N m]
            What the driver asks for.
        step : float, [s]
        """
        rules, rates = self.rules, self.rules.rates
        if self._rim is not None:
            share = step / (rules.smooth + step)
            change = (rims - self._rim) / step
            self.acceleration = self.acceleration + share * (change - self.acceleration)
        self._rim = rims
        for wheel, phase in enumerate(self.phases):
            slip = 1.0 - float(rims[wheel]) / max(speed, 1e-6)
            found = rules.next(
                phase, float(self.acceleration[wheel]), slip, float(self._since[wheel])
            )
            self._since[wheel] = 0.0 if found is not phase else self._since[wheel] + step
            self.phases[wheel] = found
            self.torque[wheel] += rates[found] * step
        self.torque = np.minimum(np.maximum(self.torque, 0.0), most)
        return self.torque.copy()
