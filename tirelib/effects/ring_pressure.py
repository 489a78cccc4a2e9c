"""Contact pressure of the ring in place of the brush's parabola."""

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "ring_pressure",
    stage="brush",
    unit="1",
    low=-0.5,
    high=2.0,
    varies_with=("slip_angle", "slip_ratio"),
    source="dissertation, section 6.6: the flexible ring's pressure in the brush model",
)
def ring_pressure(state: BrushState, strength: float) -> BrushState:
    """Contact pressure is flatter than a parabola.

    p times (1 + c x^2) / (1 + c / 5), x = -1 .. 1 over the contact, c = s c_ring: 1 is the pressure
    of the tire's ring where the model has one (fitted by this law), else c is s itself.
    """
    return state.but(flatness=state.flatness + strength * state.ring_flatness)
