"""Faults of the gages and their link, on request."""

import math
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError


@dataclass(frozen=True, slots=True)
class Faults:
    """Faults from a moment on; the defaults are none.

    Attributes
    ----------
    start : float, [s]
        Until then nothing is wrong.
    dead_gage : int
        This gage reads zero, 1 .. g; 0: none.
    saturation : float
        Magnitude of strain at which the amplifier ends; 0: none.
    drift : float, [1/s]
        All gages run away at this rate.
    dropped : float
        Probability that a frame does not come.

    Raises
    ------
    ParameterError
        If one is out of range.
    """

    start: float = 0.0
    dead_gage: int = 0
    saturation: float = 0.0
    drift: float = 0.0
    dropped: float = 0.0

    def __post_init__(self) -> None:
        allowed = {
            "fault_start": (self.start, 0.0, math.inf),
            "saturation": (self.saturation, 0.0, 1.0),
            "drift": (self.drift, -1.0, 1.0),
            "dropped_frames": (self.dropped, 0.0, 1.0),
        }
        for name, (value, low, high) in allowed.items():
            check(name, value, low, high)

    @property
    def none(self) -> bool:
        """Whether there is no fault at all."""
        return not (self.dead_gage or self.saturation or self.drift)

    def of(self, strain: FloatArray, times: FloatArray) -> FloatArray:
        """Return the strain as it is seen.

        Parameters
        ----------
        strain : array, shape (n, g)
        times : array, shape (n,), [s]
            Since the start.
        """
        on = times >= self.start
        if not on.any():
            return strain
        seen = strain + (self.drift * np.where(on, times - self.start, 0.0))[:, None]
        if self.saturation > 0.0:
            held = np.clip(seen, -self.saturation, self.saturation)
            seen = np.where(on[:, None], held, seen)
        if self.dead_gage:
            seen[on, self.dead_gage - 1] = 0.0
        return seen

    def words(self, time: float) -> list[str]:
        """Return the names of the faults that are active at a time."""
        if self.none and not self.dropped:
            return []
        given = {
            "dead_gage": self.dead_gage,
            "saturation": self.saturation,
            "drift": self.drift,
            "dropped_frames": self.dropped,
        }
        return [f"fault_{name}" for name, value in given.items() if value and time >= self.start]


def check(name: str, value: float, low: float, high: float) -> None:
    """Refuse a parameter that is out of range or no number.

    Raises
    ------
    ParameterError
        Naming the parameter.
    """
    if not low <= value <= high or value == math.inf:
        raise ParameterError(
            f"{name} = {value:g}; allowed are finite numbers from {low:g} to {high:g}; set a value "
            "in this range before the FMU is initialised"
        )
