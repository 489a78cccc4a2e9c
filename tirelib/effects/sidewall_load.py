"""Radial sidewall stiffness over deflection."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State

FALL = 0.020
"""Displacement by which the tangent stiffness falls to exp(-s), [m]."""


@effect(
    "sidewall_load",
    stage="stiffness",
    unit="1",
    low=0.0,
    high=0.8,
    varies_with=("load",),
    source="dissertation, Eq. (54): k_u = A exp(B d0), B < 0, at every place of the sidewall",
)
def sidewall_load(state: State, strength: float) -> State:
    """Radial stiffness of the sidewall falls where the tire is pressed in.

    Its tangent is k_u exp(-s w / 20 mm) where the belt is pressed in by w; B = -s / 20 mm. Eq. (54)
    has one stiffness for the whole tire, that of its deflection; a sidewall softens where it is
    pressed, and its force is the integral k_u (1 - exp(-s w / 20 mm)) 20 mm / s. The linear ring
    takes the secant at the deflection.
    """
    return state.but(softening=state.softening + strength / FALL)
