"""Sliding of the tread in the rear of the contact."""

import numpy as np

from tirelib.effects.effect import State, effect
from tirelib.effects.patch import along, balanced, beam_strain

START, WIDTH = 0.5, 0.2
"""Where sliding begins, in half contacts behind the middle, and over which length."""


@effect(
    "trailing_sliding", stage="strain", unit="1", low=0.0, high=0.1, varies_with=("load",),
    source="dissertation, sections 6.3.3 and 6.5.2.2: sliding in the rear, even in free rolling",
)  # fmt: skip
def trailing_sliding(state: State, strength: float) -> State:
    """Sliding in the rear of the contact, where the tread loses its outward shear.

    tau = -q (1 + tanh((xi - 0.5) / 0.2)) / 2, made up for in proportion to the pressure; it bends
    the flat piece as in tread_friction, with tension near the trailing edge.
    """
    c = state.contact
    lost = -0.5 * c.pressure * (1.0 + np.tanh((along(c) - START) / WIDTH))
    return state.but(strain=state.strain + strength * beam_strain(state, balanced(c, lost)))
