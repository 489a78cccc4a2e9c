"""Compression of the innerliner by the tread's outward shear."""

import numpy as np

from tirelib.effects.effect import State, effect
from tirelib.effects.patch import balanced, beam_strain

FRICTION = 1.0
SHEAR = 1.0 / 3.0
"""Shear stiffness of a tread element over its normal one: rubber keeps its volume."""


@effect(
    "tread_friction", stage="strain", unit="1", low=0.0, high=0.15, varies_with=("load",),
    source="dissertation, chapter 7, Fig. 7-3; law of tirelib.strain.tread_traction",
)  # fmt: skip
def tread_friction(state: State, strength: float) -> State:
    """Outward shear of the tread, held by the road, compresses the innerliner in the contact.

    tau = sgn(x) min(k_Gt g |x|, mu q), g = (R0 - R) / R, k_Gt = k_t / 3, mu = 1, bends the flat
    piece about the lever R0 - R. s = 1 is a beam whose sections turn freely; the road holds most.
    """
    c = state.contact
    x = state.radius[:, None] * (c.phi - c.edges.mean(axis=1)[:, None])
    grip = SHEAR * state.k_t * (state.free_radius / state.radius - 1.0)
    shear = np.sign(x) * np.minimum(grip[:, None] * np.abs(x), FRICTION * c.pressure)
    return state.but(strain=state.strain + strength * beam_strain(state, balanced(c, shear)))
