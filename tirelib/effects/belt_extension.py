"""Extension of the belt."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State

LEAST_STRENGTH = 1e-6
"""Strength below which the effect is left out: beyond 1e12 N the stiffness would drown in
round-off."""


@effect(
    "belt_extension",
    stage="stiffness",
    unit="1/MN",
    low=0.0,
    high=1.0,
    varies_with=("load",),
    source="dissertation, Eq. (55); EA of steel belts is some 1 to 10 MN (assumed)",
)
def belt_extension(state: State, strength: float) -> State:
    """Stretching of the belt.

    1 / EA + s: zero keeps the inextensible ring exactly.
    """
    if abs(strength) < LEAST_STRENGTH:
        return state
    return state.but(EA=1.0 / (1.0 / state.EA + 1e-6 * strength))
