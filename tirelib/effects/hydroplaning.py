"""Water wedge ahead of the contact."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.patch import along, inward, pressed_again
from tirelib.effects.state import State

WATER = 1000.0
"""Density, [kg/m^3]."""
DEPTH = 0.001
"""Depth of the water, [m]: the middle of what UN Regulation 117 allows where it measures wet grip.
On simulated tires the law is off by up to twice as much with half of this depth, and by no more
with double: docs/theory/verdict_numbers.md."""


@effect(
    "hydroplaning",
    stage="contact",
    unit="1",
    low=0.0,
    high=1.0,
    varies_with=("speed",),
    source="Horne and Dreher, NASA TN D-2056 (1963): lift as rho v^2 / 2",
)
def hydroplaning(state: State, strength: float) -> State:
    """Water in the gap ahead of the contact presses on the tread, with speed squared.

    The belt leaves the road along a tangent, so that the gap at a distance x ahead of the leading
    edge is about x^2 / 2 R0. Where it is less than the depth h of the water, up to
    l = sqrt(2 R0 h), the share 1 - (x / l)^2 of the water has to give way. It presses with
    s rho v^2 / 2 times this share, v = R Omega, over the belt's width b. The water carries the
    share 1 - exp(-F / Fz) of the load, with F = 2/3 l b s rho v^2 / 2; the tread carries the rest.
    """
    c = state.contact
    dynamic = 0.5 * WATER * (state.radius * state.conditions.omega) ** 2
    length = np.sqrt(2.0 * state.free_radius * DEPTH)
    pressed = 2.0 / 3.0 * length * state.width * strength * dynamic
    lift = c.load * -np.expm1(-pressed / c.load)
    ahead = 0.5 * (1.0 - along(c))  # 0 at the contact, 1 where the water begins
    phi = c.edges[:, :1] - ahead * (length / state.radius)[:, None]
    force = c.weights * (1.0 - ahead**2)
    force *= (lift / (state.radius * np.sum(force * np.cos(phi), axis=1)))[:, None]
    return pressed_again(state, inward(state, phi, force), lift)
