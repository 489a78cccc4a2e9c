"""Roads to stop on whose friction nobody knows; friction falls with the speed of sliding."""

import math
from dataclasses import dataclass

import numpy as np

from cosim.vehicle14.model import Wheels
from tirelib.core.arrays import FloatArray

FALLING = 0.1
"""Share of the friction that 10 m/s of sliding take: mu exp(-s v_s / (10 m/s)), the law of
`tirelib.effects.friction_speed` (Savkoor 1966)."""
LOW, CHANGE = 0.4, 12.0
"""Factor of the slippery side of a split road, and where it begins or ends [m]."""


@dataclass(frozen=True)
class Road:
    """A road to stop on.

    Attributes
    ----------
    name, title : str
    patches : sequence of (start, left, right)
        From a way [m] since the brakes were put on: factor of the friction on either side.
    steer : float, [rad]
        Steer angle of the front wheels before the brakes are put on.
    rolling : float, [s]
        Time before the brakes: two turns of every wheel, and a turn settles.
    """

    name: str
    title: str
    patches: tuple[tuple[float, float, float], ...]
    steer: float = 0.0
    rolling: float = 0.3

    def friction(self, way: float) -> FloatArray:
        """Return the factor under each wheel, shape (4,); the rear axle comes 2.7 m later."""

        def sides(at: float) -> tuple[float, float]:
            past = [patch for patch in self.patches if patch[0] <= at] or [self.patches[0]]
            return past[-1][1:]

        return np.array([*sides(way), *sides(way - 2.7)])


def _split(side: str, start: str) -> Road:
    low, even = (LOW, 1.0) if side == "left" else (1.0, LOW), (1.0, 1.0)
    first, then = (low, even) if start == "leaving" else (even, low)
    words = {
        "entering": "comes under the {} wheels after {} m",
        "leaving": "under the {} wheels ends after {} m",
    }[start]
    title = f"friction {LOW:g} " + words.format(side, f"{CHANGE:g}")
    return Road(f"split_{side}_{start}", title, ((-math.inf, *first), (CHANGE, *then)))


ROADS = (
    Road("low", "friction 0.4, not known", ((-math.inf, 0.4, 0.4),)),
    Road(
        "changing",
        "friction 0.9, from 10 m on 0.4, from 25 m on 0.7",
        ((-math.inf, 0.9, 0.9), (10.0, 0.4, 0.4), (25.0, 0.7, 0.7)),
    ),
    Road(
        "turn",
        "turn of 2 m/s\N{SUPERSCRIPT TWO}, friction 0.5, not known",
        ((-math.inf, 0.5, 0.5),),
        0.0135,
        1.2,
    ),
    *(_split(side, start) for side in ("left", "right") for start in ("entering", "leaving")),
)
"""Two even roads, a turn; four starts of a split one: either side is the slippery one, and the stop
begins on even ground and enters the split, or begins on the split and leaves it."""
STARTS_OF_SPLIT = 4


def falling(factor: FloatArray, wheels: Wheels) -> FloatArray:
    """Return the factor of the friction at the wheels' speed of sliding, shape (4,)."""
    kappa = np.where(np.isfinite(wheels.kappa), wheels.kappa, 0.0)
    sliding = wheels.speed * np.hypot(kappa, np.tan(wheels.alpha))
    return np.asarray(factor * np.exp(-FALLING * sliding / 10.0))
