"""Damping of the sidewall."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "sidewall_damping",
    stage="stiffness",
    unit="1",
    low=0.0,
    high=0.3,
    varies_with=("speed",),
    source="dissertation, Fig. 6-33: 0 to 0.1 there; dashpots instead of the modal Eq. (107)",
)
def sidewall_damping(state: State, strength: float) -> State:
    """Damping of the sidewall, which shifts the contact forward with speed.

    Dashpots beside the springs, c = 2 s sqrt(k rho A) for k_u and k_v. The same ratio in every
    mode, Eq. (107), would damp the belt's bending as well.
    """
    return state.but(dashpots=state.dashpots + strength)
