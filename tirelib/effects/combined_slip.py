"""Friction that differs along and across the wheel."""

import numpy as np

from tirelib.effects.brush_state import BrushState
from tirelib.effects.effect import effect


@effect(
    "combined_slip",
    stage="brush",
    unit="1",
    low=-0.5,
    high=0.5,
    varies_with=("slip_angle", "slip_ratio"),
    lacking="no run has a slip angle and a slip ratio at once",
    source="friction ellipse: adhesion along and across the wheel differ (Pacejka, ch. 3)",
)
def combined_slip(state: BrushState, strength: float) -> BrushState:
    """Friction along the wheel differs from that across.

    mu times 1 + s kappa^2 / (kappa^2 + tan^2 alpha): unchanged in pure cornering.
    """
    along, across = state.slip_ratio**2, np.tan(state.slip_angle) ** 2
    share = along / np.where(along + across > 0.0, along + across, 1.0)
    return state.but(mu=state.mu * (1.0 + strength * share))
