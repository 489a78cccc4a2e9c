"""Friction over inflation pressure."""

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "friction_pressure",
    stage="brush",
    unit="1",
    low=-0.8,
    high=0.8,
    varies_with=("pressure",),
    needs=("pressure",),
    source="Besselink et al., An improved Magic Formula/Swift tyre model, 2010: pressure terms of "
    "peak friction",
)
def friction_pressure(state: BrushState, strength: float) -> BrushState:
    """Friction changes with inflation pressure.

    mu times (p / p0)^(-s): higher contact pressure lowers it, more even pressure raises it.
    """
    factor = (state.conditions.pressure / state.reference_pressure) ** -strength
    return state.but(mu=state.mu * factor)
