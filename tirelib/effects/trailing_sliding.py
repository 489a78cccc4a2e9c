"""Sliding of the tread in the rear of the contact."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.patch import along, balanced, sheared
from tirelib.effects.state import State

START, WIDTH = 0.5, 0.2
"""Where sliding begins, in half contacts behind the middle, and over which length."""


@effect(
    "trailing_sliding",
    stage="contact",
    unit="1",
    low=0.0,
    high=0.5,
    varies_with=("load",),
    source="dissertation, sections 6.3.3 and 6.5.2.2: sliding in the rear, even in free rolling",
)
def trailing_sliding(state: State, strength: float) -> State:
    """Sliding in the rear of the contact, where the tread loses its outward shear.

    tau = -s q (1 + tanh((xi - 0.5) / 0.2)) / 2, made up for in proportion to the pressure, on the
    belt as in tread_friction.
    """
    c = state.contact
    lost = -0.5 * strength * c.pressure * (1.0 + np.tanh((along(c) - START) / WIDTH))
    return sheared(state, balanced(c, lost))
