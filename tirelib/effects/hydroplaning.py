"""Water wedge under the leading part of the contact."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.patch import along, inward, pressed_again
from tirelib.effects.state import State

WATER = 1000.0
"""Density, [kg/m^3]."""


@effect(
    "hydroplaning",
    stage="contact",
    unit="1",
    low=0.0,
    high=0.4,
    varies_with=("speed", "pressure"),
    source="Horne and Dreher, NASA TN D-2056 (1963): lift as rho v^2 / 2 against inflation",
)
def hydroplaning(state: State, strength: float) -> State:
    """Water lifts the leading part of the contact, with speed squared.

    It carries the share 1 - exp(-s rho v^2 / 2 p) of the load, v = R Omega, as a parabola about
    the leading edge, half a contact long; the tread carries the rest.
    """
    c = state.contact
    dynamic = 0.5 * WATER * (state.radius * state.conditions.omega) ** 2
    lift = c.load * -np.expm1(-strength * dynamic / state.conditions.pressure)
    phi = c.edges[:, :1] + 0.5 * (c.phi - c.edges.mean(axis=1)[:, None])
    force = c.weights * (1.0 - along(c) ** 2)
    force *= (lift / (state.radius * np.sum(force * np.cos(phi), axis=1)))[:, None]
    return pressed_again(state, inward(state, phi, force), lift)
