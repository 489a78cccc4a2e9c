"""Shear of the belt, Timoshenko's beam."""

from tirelib.effects.effect import State, effect

LEAST = 1e-9
"""Strength below which it is none: beyond 1e12 N the stiffness would drown in round-off."""


@effect(
    "belt_shear", stage="stiffness", unit="1/kN", low=0.0, high=0.1, varies_with=("load",),
    source="Timoshenko beam; dissertation, chapter 7, asks for it; GA >= 10 kN (assumed)",
)  # fmt: skip
def belt_shear(state: State, strength: float) -> State:
    """Shear of the belt: cross-sections do not stay normal to it.

    1 / GA + s: zero keeps the Bernoulli-Euler ring exactly.
    """
    if abs(strength) < LEAST:
        return state
    return state.but(GA=1.0 / (1.0 / state.GA + 1e-3 * strength))
