"""Shear of the belt, Timoshenko's beam."""

import numpy as np

from tirelib.core.errors import ParameterError
from tirelib.effects.effect import effect
from tirelib.effects.state import State

LEAST_STRENGTH = 1e-9
"""Strength below which the effect is left out: beyond 1e12 N the stiffness would drown in
round-off."""


@effect(
    "belt_shear",
    stage="stiffness",
    unit="1/kN",
    low=0.0,
    high=0.04,
    varies_with=("load",),
    source="Timoshenko beam under tension: Haringx 1948, Reissner 1972; dissertation, chapter 7, "
    "asks for it; GA >= 25 kN (assumed)",
)
def belt_shear(state: State, strength: float) -> State:
    """Shear of the belt: cross-sections do not stay normal to it.

    The tension N = p b R + rho A R^2 Omega^2 acts along the sections' normal, so it takes its own
    size from their shear stiffness: the compliance is 1 / (1 / s - N), larger the harder the tire
    is blown up and the faster it rolls. Zero keeps the Bernoulli-Euler ring exactly.
    """
    if abs(strength) < LEAST_STRENGTH:
        return state
    left = 1e3 / strength - state.belt_tension
    if np.sign(strength) * np.min(left) <= 0.0:
        raise ParameterError(
            f"belt_shear: {strength:g} 1/kN leaves no shear stiffness under a belt tension of "
            f"{np.max(state.belt_tension) / 1e3:.1f} kN; the product has to stay below 1"
        )
    return state.but(GA=1.0 / (1.0 / state.GA + 1.0 / left))
