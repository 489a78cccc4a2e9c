"""What a family of tires is to a campaign: tires, solved runs, and laws by which effects act.

Three simulators serve as families (`structure.rig`, `structure.elements`, `structure.ring`). Each
solves a tire at conditions and says what perfect gages would show; set points, noise and the
reading of the gages (`structure.day`) are the same for all.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tirelib.campaign import TireGeometry

Array = NDArray[np.float64]

POINTS = 1440
"""Points of a frame round the wheel: eight times what the waveform's filter passes."""
LATERAL = np.array([-0.06, -0.03, 0.0, 0.03, 0.06])
"""Gages across the width, y to the left [m]."""
PHI: Array = np.asarray(-np.pi + 2.0 * np.pi / POINTS * np.arange(POINTS), dtype=np.float64)
"""Wheel angle of the gages, 0 under the axle, growing with time [rad]."""


@dataclass(frozen=True)
class Setting:
    """What a rig held in a run: load [N], gauge pressure [Pa], speed [m/s].

    `place` is the run's in the campaign, from 0 to 1.
    """

    load: float
    pressure: float
    speed: float
    place: float = 0.0


@dataclass(frozen=True)
class Frame:
    """What a solved run shows to perfect gages.

    Attributes
    ----------
    setting : Setting
    omega, height, stiffness : float
        Turn rate [rad/s], axle height [m], vertical stiffness at constant speed [N/m].
    edges : shape (5, 2)
        Leading and trailing edge of the contact over each gage [rad]; NaN without contact.
    strain, by_load : shape (POINTS, 5)
        Along the circumference [1], over `PHI`, and its derivative with the load [1/N].
    """

    setting: Setting
    omega: float
    height: float
    stiffness: float
    edges: Array
    strain: Array
    by_load: Array


Shown = Callable[[Frame, Any, float, float], Frame]
"""(frame, tire, angle of a mark on the tire [rad], strength) -> what faulty gages show."""


@dataclass(frozen=True)
class Hidden:
    """An effect that a family can hide.

    Attributes
    ----------
    visible, largest : float
        A strength that shows clearly, and the largest that makes sense, in the law's unit.
    known : bool
        Whether the library's catalogue has an effect of this name.
    signed : bool
        Whether either sign makes sense.
    shown : callable or None
        Law of what gages show; None for an effect that acts on the tire, which the family solves.
    """

    name: str
    visible: float
    largest: float
    known: bool
    signed: bool = False
    shown: Shown | None = None


class Family(Protocol):
    """A simulator."""

    name: str
    number: int
    hidden: Mapping[str, Hidden]

    def draw(self, seed: int, kind: str) -> Any:
        """Return the plain tire of a seed, into which `kind` can be planted."""

    def geometry(self, tire: Any) -> TireGeometry:
        """Return what a tape measure gives."""

    def numbers(self, tire: Any) -> dict[str, float]:
        """Return what a ring model would call the tire's constants; pressures about 2 bar, SI."""

    def frames(
        self, tire: Any, settings: Sequence[Setting], planted: Mapping[str, float], angle: float
    ) -> list[Frame]:
        """Solve runs with effects that act on the tire."""
