"""Compression of belt and innerliner by the tread's outward shear."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.patch import along, balanced, beam_strain, held_shear, sheared
from tirelib.effects.state import State
from tirelib.physics.strain.innerliner import strain_harmonics

BUILT_UP = 1.0 / 3.0
"""Share of half a contact over which friction builds up, from the middle."""


@effect(
    "tread_friction",
    stage="strain",
    unit="1",
    low=-0.05,
    high=0.5,
    components=2,
    varies_with=("load",),
    source="dissertation, chapter 7, Fig. 7-3; on the ring as well (assumed form)",
)
def tread_friction(state: State, strength: Sequence[float]) -> State:
    """Outward shear of the tread, held by the road, compresses the belt in the contact.

    s_1 q clip(3 xi, -1, 1), xi from -1 at the leading to 1 at the trailing edge, pulls the ring and
    turns its sections about the lever R0 - R. s_2 sgn(x) min(k_Gt g |x|, q), g = (R0 - R) / R,
    bends the flat piece by itself; s_2 = 1 is a beam whose sections turn freely.
    """
    c = state.contact
    pull = balanced(c, strength[0] * c.pressure * np.clip(along(c) / BUILT_UP, -1.0, 1.0))
    bent = beam_strain(state, balanced(c, strength[1] * held_shear(state)))
    after = sheared(state, pull)
    more = strain_harmonics(after.belt - state.belt, state.radius, state.offset)
    return after.but(strain=state.strain + more + bent)
