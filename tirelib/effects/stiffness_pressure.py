"""Bristle stiffness over inflation pressure."""

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "stiffness_pressure",
    stage="brush",
    unit="1",
    low=-1.5,
    high=1.5,
    varies_with=("pressure",),
    needs=("pressure",),
    source="Besselink et al., An improved Magic Formula/Swift tyre model, 2010: pressure terms of "
    "slip stiffness",
)
def stiffness_pressure(state: BrushState, strength: float) -> BrushState:
    """Stiffness of the contact changes with inflation pressure.

    c_py and c_px times (p / p0)^s: a shorter contact lowers it, a stiffer carcass raises it.
    """
    factor = (state.conditions.pressure / state.reference_pressure) ** strength
    return state.but(c_py=state.c_py * factor, c_px=state.c_px * factor)
