"""Carcass that turns under the aligning moment."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "carcass",
    stage="brush",
    unit="deg/Nm",
    low=0.0,
    high=0.02,
    varies_with=("slip_angle",),
    source="dissertation, Eq. (2): 1 / C_yaw of the belt's line in the contact",
)
def carcass(state: BrushState, strength: float) -> BrushState:
    """Contact that turns under its aligning moment, which lowers the slip angle.

    The slip angle falls by s Mz, in balance with the Mz that results.
    """
    return state.but(yaw_compliance=state.yaw_compliance + np.deg2rad(strength))
