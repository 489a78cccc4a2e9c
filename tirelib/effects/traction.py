"""Drive and brake force in the contact."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.patch import pressed_again
from tirelib.effects.state import State
from tirelib.physics.contact.fourier import load_harmonics


@effect(
    "traction",
    stage="contact",
    unit="1",
    low=0.0,
    high=3.0,
    varies_with=("slip_ratio",),
    needs=("drive_force",),
    source="dissertation, section 4.1.5, Fig. 4-17: braking raises the second compressive peak",
)
def traction(state: State, strength: float) -> State:
    """Drive or brake force makes the two compressive peaks unequal.

    Line loads q_v = -s f_x and q_beta = (R0 - R) q_v with Fx distributed as the pressure is.
    """
    c = state.contact
    share = c.weights * c.pressure
    share *= (strength * state.conditions.drive_force / (state.radius * share.sum(axis=1)))[:, None]
    loads = np.zeros_like(state.belt)
    loads[..., 1] = -load_harmonics(c.phi, share, state.belt.shape[1] - 1)
    loads[..., 2] = (state.free_radius - state.radius)[:, None] * loads[..., 1]
    return pressed_again(state, loads)
