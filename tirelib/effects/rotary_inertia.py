"""Rotary inertia of the belt's cross-section."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "rotary_inertia",
    stage="inertia",
    unit="kg m",
    low=0.0,
    high=6e-4,
    varies_with=("speed",),
    source="Rayleigh beam; rho I = rho A h^2 / 12 is 4e-5 kg m for 12.5 mm of belt and tread; the "
    " range leaves room for blocks and cords that turn with it",
)
def rotary_inertia(state: State, strength: float) -> State:
    """Cross-sections of the belt resist being turned, which softens its bending with speed.

    rho I + s: in steady rolling EI becomes EI - s (R Omega)^2.
    """
    return state.but(rotary_inertia=state.rotary_inertia + strength)
