"""Wear of the tread during the campaign."""

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "tread_wear",
    stage="tread",
    unit="1",
    low=0.0,
    high=0.4,
    varies_with=("order",),
    source="k_t = E b / h; loss of thickness during a campaign (assumed size)",
)
def tread_wear(state: State, strength: float) -> State:
    """Wear: thinner, stiffer tread and a smaller radius with every run.

    h = h0 (1 - s o), k_t = k_t0 h0 / h, R0 less by h0 - h, with the place o in the campaign.
    """
    left = 1.0 - strength * state.conditions.order
    return state.but(
        thickness=state.thickness * left,
        k_t=state.k_t / left,
        free_radius=state.free_radius - state.thickness * (1.0 - left),
    )
