"""Where a brake controller's knowledge of the wheels comes from: the truth, or strain.

The truth at every step, of once per turn, of one turn ago; and what four strain tires say of four
virtual tires.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from cosim.vehicle14.model import Wheels
from cosim.wheels import OWN_FRICTION, FourWheels, WheelStates
from tirelib.core.arrays import BoolArray, FloatArray

TIME_STEP = 2e-3
"""Communication step, and that of the controller [s]."""
READY = math.radians(35.0)
"""Wheel angle after the middle of the contact at which an estimate is ready."""


@dataclass(frozen=True)
class Known:
    """What a controller knows of four wheels; NaN: nothing yet.

    `sure` is false where the slip ratio is an old one, because what came since could not be used.
    """

    kappa: FloatArray
    load: FloatArray
    alpha: FloatArray
    sure: BoolArray = field(default_factory=lambda: np.ones(4, dtype=np.bool_))


class Source(Protocol):
    """Where knowledge comes from."""

    def begin(self, wheels: Wheels, omega: FloatArray) -> None:
        """Start with the wheels' first state."""

    def step(self, time: float, wheels: Wheels, omega: FloatArray) -> Known:
        """Take the wheels' state that holds over the next step; return what is known after it."""


class Perfect:
    """The truth, at once."""

    def begin(self, wheels: Wheels, omega: FloatArray) -> None:
        """Nothing to do."""

    def step(self, time: float, wheels: Wheels, omega: FloatArray) -> Known:
        """Return the truth."""
        return Known(wheels.kappa, wheels.Fz, wheels.alpha)


class OncePerTurn:
    """The truth in the middle of each contact, told `READY` later and held.

    Parameters
    ----------
    start_angles : sequence of 4 floats, [rad]
        Angles at which the gages begin; 0: over the road.
    """

    def __init__(self, start_angles: Sequence[float]) -> None:
        self._angle = np.array(start_angles, dtype=np.float64)
        self._seen = self._told = np.full((3, 4), np.nan)

    def begin(self, wheels: Wheels, omega: FloatArray) -> None:
        """Nothing to do."""

    def step(self, time: float, wheels: Wheels, omega: FloatArray) -> Known:
        """Turn the wheels, look at the truth over the road, tell it later."""
        before = self._angle
        self._angle = before + omega * TIME_STEP
        now = np.array((wheels.kappa, wheels.Fz, wheels.alpha))
        self._seen = np.where(_passes(before, self._angle, 0.0), now, self._seen)
        self._told = np.where(_passes(before, self._angle, READY), self._seen, self._told)
        return Known(*self._told)


def _passes(before: FloatArray, after: FloatArray, place: float) -> BoolArray:
    """Tell whether a turning wheel passes an angle [rad]."""
    turn = 2.0 * np.pi
    return np.asarray(np.floor((after - place) / turn) > np.floor((before - place) / turn))


class OneTurnLate:
    """The truth of one turn ago, at every step."""

    def __init__(self) -> None:
        self._past: deque[tuple[FloatArray, Known]] = deque()
        self._angle = np.zeros(4)

    def begin(self, wheels: Wheels, omega: FloatArray) -> None:
        """Nothing to do."""

    def step(self, time: float, wheels: Wheels, omega: FloatArray) -> Known:
        """Return what was true when the wheels stood a turn earlier."""
        self._angle = self._angle + omega * TIME_STEP
        self._past.append((self._angle, Known(wheels.kappa, wheels.Fz, wheels.alpha)))
        while len(self._past) > 1 and np.all(self._past[1][0] <= self._angle - 2.0 * np.pi):
            self._past.popleft()
        return self._past[0][1]


class Strain:
    """Four virtual tires and four strain tires.

    An estimate that is not valid is not used: the last valid one is held.
    """

    def __init__(self, four: FourWheels) -> None:
        self._four = four
        self._known = Known(*np.full((3, 4), np.nan))
        self.out_of_range = self.refused = 0
        self.delays: list[float] = []
        self._turn = np.zeros(4, dtype=np.int64)

    def begin(self, wheels: Wheels, omega: FloatArray) -> None:
        """Start the tires."""
        self._four.start(_states(wheels, omega))

    def step(
        self, time: float, wheels: Wheels, omega: FloatArray, told_speed: float = math.nan
    ) -> Known:
        """Step the tires and return what they say.

        The strain tires are told the true speed, or `told_speed` [m/s] where it is given.
        """
        states = _states(wheels, omega)
        if math.isfinite(told_speed):
            states = replace(states, told_speed=np.full(4, told_speed))
        told = self._four.step(time, TIME_STEP, states)
        self.out_of_range += int((~told.tire_valid).sum())
        new = told.turn != self._turn
        self.delays += (time + TIME_STEP - told.contact_time[new & told.valid]).tolist()
        self._turn = told.turn
        self.refused += int((new & ~told.valid).sum())
        self._known = Known(
            np.where(told.kappa_valid, told.kappa, self._known.kappa),
            np.where(told.Fz_valid, told.Fz, self._known.load),
            np.where(told.alpha_valid, told.alpha, self._known.alpha),
            sure=told.kappa_valid,
        )
        return self._known


def _states(wheels: Wheels, omega: FloatArray) -> WheelStates:
    return WheelStates(
        load=wheels.Fz,
        alpha=wheels.alpha,
        kappa=wheels.kappa,
        camber=wheels.camber,
        speed=wheels.speed,
        omega=omega,
        friction=OWN_FRICTION * wheels.friction,
    )
