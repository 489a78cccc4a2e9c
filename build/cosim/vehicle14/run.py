"""Integration with a fixed step, and a vehicle that remembers its state."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .model import Controls, Motion, Vehicle

if TYPE_CHECKING:
    from tirelib.core.arrays import FloatArray

LONGEST = 1e-3
"""Longest step of the integration [s]."""


def advance(vehicle: Vehicle, state: FloatArray, given: Controls, step: float) -> FloatArray:
    """Return the state after one step [s] of the classical fourth-order method."""
    first = vehicle.motion(state, given).rate
    second = vehicle.motion(state + 0.5 * step * first, given).rate
    third = vehicle.motion(state + 0.5 * step * second, given).rate
    last = vehicle.motion(state + step * third, given).rate
    return state + step / 6.0 * (first + 2.0 * (second + third) + last)


class Drive:
    """A vehicle on its way.

    Parameters
    ----------
    vehicle : Vehicle
    state : array, shape (32,)
    longest : float, [s]
        Longest step of the integration; a longer communication step is divided evenly.
    """

    def __init__(self, vehicle: Vehicle, state: FloatArray, longest: float = LONGEST) -> None:
        self.vehicle, self.state, self.longest = vehicle, state, longest
        self.motion: Motion = vehicle.motion(state, Controls.none())

    def look(self, given: Controls) -> Motion:
        """Return what the vehicle does now under these controls, and remember it."""
        self.motion = self.vehicle.motion(self.state, given)
        return self.motion

    def step(self, step: float, given: Controls) -> Motion:
        """Go on with controls that hold; return what the vehicle does at the end."""
        n = max(math.ceil(step / self.longest - 1e-9), 1)
        for _ in range(n):
            self.state = advance(self.vehicle, self.state, given, step / n)
        return self.look(given)
