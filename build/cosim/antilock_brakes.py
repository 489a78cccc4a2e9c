"""Brake controllers of `cosim.antilock`, the rules of the axles and the actuators.

Each controller has its own knowledge of the wheels; driver, rules and actuators are the same.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cosim.closed_loop_sources import TIME_STEP, Known, Perfect, Strain
from cosim.today import Sensors, TodaysBrakes
from cosim.traction import TractionController
from cosim.vehicle14.model import Wheels
from tirelib.core.arrays import FloatArray

PEDAL = np.array([1800.0, 1800.0, 780.0, 780.0])
"""What the driver asks of each brake: a stop of 1.07 g [N m]."""
LAG, BUILD, RELEASE = 0.01, 8e3, 2e4
"""Brake actuators, the same for all: first-order lag [s], largest rates [N m / s]."""
APART, PARTING = 300.0, 1200.0
"""Torques of the front brakes may differ by so much [N m], and by so much more a second [N m / s]
after one of them is let off: the yaw moment builds up no faster than a driver steers."""
REAR_MOST = math.radians(2.0)
"""Slip angle of the rear axle at which the brakes of an axle may differ no more."""
SPARE = 0.1
"""Traction by which a controller may ask for more than the rules of the axles leave."""


@dataclass(frozen=True)
class Given:
    """What a brake controller is given at a step.

    `felt` is `wheels` with the slip angle that the tires feel, after relaxation.
    """

    time: float
    since: float
    wheels: Wheels
    felt: Wheels
    sensors: Sensors
    speed: float
    rims: FloatArray


class Brakes(Protocol):
    """A brake controller with its knowledge.

    `reserve` is the share of the rear axle's slip angle that is left, None where nobody knows.
    """

    @property
    def reserve(self) -> float | None:
        """See above."""

    def begin(self, given: Given) -> None:
        """Start with the first state."""

    def step(self, given: Given) -> FloatArray:
        """Return the brake torques asked for [N m], shape (4,); none before `since` is 0."""

    def held(self, torque: FloatArray, actual: FloatArray) -> None:
        """Hear what the rules of the axles left of it, and what the actuators have [N m]."""


class Today:
    """The classical control cycle."""

    reserve = None

    def __init__(self) -> None:
        self._brakes = TodaysBrakes()

    def begin(self, given: Given) -> None:
        """Nothing to do."""

    def step(self, given: Given) -> FloatArray:
        """Return what the control cycle asks for."""
        if given.since < 0.0:
            return np.zeros(4)
        return self._brakes.step(given.rims, given.speed, PEDAL, TIME_STEP)

    def held(self, torque: FloatArray, actual: FloatArray) -> None:
        """Let the pressures be what the rules of the axles left."""
        self._brakes.torque = torque.copy()


class TractionBrakes:
    """`TractionController` with the truth, or with strain tires beside today's sensors.

    Parameters
    ----------
    source : Perfect or Strain
    fused : bool
        Whether the slip ratio is that of wheel speeds against the reference speed, which comes at
        every step; load and slip angle are the source's.
    """

    def __init__(self, source: Perfect | Strain, *, fused: bool) -> None:
        self.source, self.fused = source, fused
        self.control = TractionController()
        self.believed = np.full(4, self.control.first)
        self.wanted, self.torque = np.zeros(4), np.zeros(4)
        self.omega: FloatArray | None = None
        self.known = Known(*np.full((3, 4), np.nan))

    @property
    def reserve(self) -> float:
        """Share of the rear axle's slip angle that is left, 0 .. 1; 0 where none is known."""
        used = abs(float(np.mean(self.known.alpha[2:]))) / REAR_MOST
        return max(1.0 - used, 0.0) if math.isfinite(used) else 0.0

    def begin(self, given: Given) -> None:
        """Start the source."""
        self.source.begin(given.felt, given.sensors.omega)

    def step(self, given: Given) -> FloatArray:
        """Return what the controller asks for."""
        omega, speed = given.sensors.omega, given.speed
        if isinstance(self.source, Strain):
            known = self.source.step(given.time, given.felt, omega, speed)
        else:
            known = self.source.step(given.time, given.wheels, omega)
        if self.fused:
            known = dataclasses.replace(known, kappa=given.rims / speed - 1.0)
        before, self.omega, self.known = self.omega, omega, known
        if given.since < 0.0 or before is None:
            return np.zeros(4)
        slowing = (before - omega) / TIME_STEP * self.control.radius
        self.believed, self.wanted = self.control.step(
            self.believed, known, (self.torque, slowing), speed, given.since
        )
        return self.wanted.copy()

    def held(self, torque: FloatArray, actual: FloatArray) -> None:
        """Believe in no more traction than the rules leave, so that it does not wind up."""
        self.torque = actual
        cut = torque < self.wanted - 1.0
        load = np.where(self.known.load > 0.0, self.known.load, np.inf)
        left = np.maximum(torque / (self.control.radius * load), 0.05)
        self.believed = np.where(cut, np.minimum(self.believed, left + SPARE), self.believed)


def axle_rules(asked: FloatArray, parted: float | None, reserve: float | None) -> FloatArray:
    """Return torques [N m] within the pedal and the rules of the axles, shape (4,).

    Who knows no slip angle of the rear axle lets the rear brakes take the lower of their torques,
    and the front ones differ by `APART`, and by `PARTING` times the time since they first did. Who
    knows it lets the brakes of an axle differ as far as the rear axle has slip angle in reserve.

    Parameters
    ----------
    asked : array, shape (4,), [N m]
    parted : float or None, [s]
        Since when the front brakes have wanted to differ; None: they do not.
    reserve : float or None
        See `TractionBrakes.reserve`; None: nobody knows.
    """
    torque = np.minimum(asked, PEDAL)
    if reserve is None:
        front, rear = APART + PARTING * (parted or 0.0), 0.0
    else:
        front, rear = APART + reserve * PEDAL[0], reserve * PEDAL[2]
    torque[:2] = np.minimum(torque[:2], torque[:2].min() + front)
    torque[2:] = np.minimum(torque[2:], torque[2:].min() + rear)
    return torque


def actuated(torque: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the torques of the brakes [N m] a step after they were `torque`."""
    change = (wanted - torque) * TIME_STEP / (LAG + TIME_STEP)
    return torque + np.clip(change, -RELEASE * TIME_STEP, BUILD * TIME_STEP)
