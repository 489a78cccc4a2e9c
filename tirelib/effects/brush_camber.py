"""Lateral force from camber."""

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "brush_camber",
    stage="brush",
    unit="1",
    low=-0.2,
    high=1.2,
    varies_with=("camber",),
    source="Pacejka, Tire and Vehicle Dynamics, ch. 3: camber as a turned line of the contact",
)
def brush_camber(state: BrushState, strength: float) -> BrushState:
    """Camber acts as a slip angle.

    A radian of camber is worth s radians of slip angle: about 0.1 for car tires, 1 on two wheels.
    """
    return state.but(camber_thrust=state.camber_thrust + strength)
