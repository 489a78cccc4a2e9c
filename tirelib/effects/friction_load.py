"""Friction over load."""

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "friction_load",
    stage="brush",
    unit="1",
    low=-0.1,
    high=0.6,
    varies_with=("load",),
    source="rubber friction: the true contact area grows less than the load (Schallamach)",
)
def friction_load(state: BrushState, strength: float) -> BrushState:
    """Friction falls with load.

    mu times (Fz / Fz0)^(-s); 1/3 for smooth elastic spheres on a plane.
    """
    return state.but(mu=state.mu * (state.conditions.load / state.reference_load) ** -strength)
