"""Lateral force at zero slip that does not depend on the direction of rolling."""

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "conicity",
    stage="brush",
    unit="N/kN",
    low=-50.0,
    high=50.0,
    varies_with=("load",),
    source="Pacejka, Tire and Vehicle Dynamics, ch. 4: conicity as a lateral force that keeps its "
    "side",
)
def conicity(state: BrushState, strength: float) -> BrushState:
    """Belt as a cone that pushes to one side, more with load.

    Fy plus s Fz, whatever the slip and the direction of rolling.
    """
    return state.but(Fy_offset=state.Fy_offset + 1e-3 * strength * state.conditions.load)
