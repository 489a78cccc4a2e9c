"""Lateral bending of the belt, seen across the gages."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State
from tirelib.physics.contact.fourier import load_harmonics
from tirelib.physics.ring.lateral import LateralBelt, bend_belt

BENDING = 1500.0
"""EI_z of the belt in its own plane, [N m^2]."""
FOUNDATION = 2.0e5
"""Lateral stiffness of the sidewalls per length, [N/m^2]."""


@effect(
    "belt_bending",
    stage="strain",
    unit="1",
    low=0.0,
    high=0.6,
    varies_with=("slip_angle", "lateral"),
    needs=("side_force",),
    source="Fiala (1954); dissertation, section 4.1.4, Fig. 4-10",
)
def belt_bending(state: State, strength: float) -> State:
    """Side force bends the belt sideways: left gages are stretched for Fy > 0.

    Strain -s y theta' of the beam on springs (EI_z = 1500 N m^2, k = 2e5 N/m^2), Fy distributed
    as the pressure is. s = 1 is Fiala's straight beam; fibres that slip round the hoop take most.
    """
    c = state.contact
    share = c.weights * c.pressure
    share *= (state.conditions.side_force / (state.radius * share.sum(axis=1)))[:, None]
    tension = state.tension_pressure * state.width * state.radius
    belt = LateralBelt(state.radius, BENDING, tension, FOUNDATION)
    bend = bend_belt(belt, load_harmonics(c.phi, share, state.strain.shape[1] - 1)).bend
    return state.but(strain=state.strain - strength * np.reshape(state.lateral, (-1, 1)) * bend)
