"""Tread stiffness over load."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State

REFERENCE = 4000.0
"""Load at which the base model's k_t holds, [N]."""


@effect(
    "tread_load",
    stage="tread",
    unit="1",
    low=-0.5,
    high=0.5,
    varies_with=("load",),
    source="rubber blocks harden when pressed, grooves close (assumed form and size)",
)
def tread_load(state: State, strength: float) -> State:
    """Tread that is stiffer, or softer, under higher load.

    k_t (Fz / 4000 N)^s.
    """
    return state.but(k_t=state.k_t * (state.conditions.load / REFERENCE) ** strength)
