"""Lateral force at zero slip that turns its sign with the direction of rolling."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "ply_steer",
    stage="brush",
    unit="deg",
    low=-1.0,
    high=1.0,
    varies_with=("speed",),
    needs=("speed",),
    lacking="no run rolls the other way, and in one way it is a shift of the slip angle",
    source="Pacejka, Tire and Vehicle Dynamics, ch. 4: ply-steer as an offset of the slip angle",
)
def ply_steer(state: BrushState, strength: float) -> BrushState:
    """Plies of the belt steer the tire, the other way when it rolls backward.

    The slip angle plus s times the sign of the speed.
    """
    shift = np.deg2rad(strength) * np.sign(state.conditions.speed)
    return state.but(slip_angle=state.slip_angle + shift)
