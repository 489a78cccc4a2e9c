"""Damping of the rolling tire."""

from tirelib.effects.effect import State, effect


@effect(
    "sidewall_damping", stage="stiffness", unit="1", low=0.0, high=0.3, varies_with=("speed",),
    source="dissertation, Eq. (107) and Fig. 6-33: 0 to 0.1 there",
)  # fmt: skip
def sidewall_damping(state: State, strength: float) -> State:
    """Damping of the sidewall, which shifts the contact forward with speed.

    lambda + s in c_n = 2 lambda sqrt(m_n k_n).
    """
    return state.but(damping=state.damping + strength)
