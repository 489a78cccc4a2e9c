"""Rings, tread and contacts of Table 6-1 that the tests of the contact with shear share."""

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tirelib.physics.contact import shear
from tirelib.physics.contact.shear import Shear, ShearContact
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import Ring

Array = NDArray[np.float64]

OMEGA, R, H0 = 59.0, 0.30, 0.0125
T61 = Ring(
    radius=R,
    bending_stiffness=1.144,
    mass=3.16,
    inflation=1.32e5 * 0.165,
    radial_stiffness=6.24e5,
    tangential_stiffness=2.18e5,
)
BELTS = {
    "inextensible": T61,
    "extensible": replace(T61, extension_stiffness=5e6),
    "timoshenko": replace(T61, extension_stiffness=5e6, shear_stiffness=5e4),
}
TREAD = Tread(R + H0, 7.5e7, H0)
SHEAR = Shear(2.5e7, 0.65)
DEFLECTIONS = (0.025, 0.035, 0.045)


@cache
def ring(damping: float = 0.0, belt: str = "inextensible", omega: float = OMEGA) -> Compliance:
    return compliance(replace(BELTS[belt], damping=damping), omega, 60)


@cache
def contact(d0: float, damping: float = 0.0, mu: float = 0.65, **option: float) -> ShearContact:
    law = Shear(option.pop("stiffness", 2.5e7), mu)
    n_nodes = int(option.pop("n_nodes", 40))
    return shear.press(ring(damping), TREAD, law, d0, n_nodes=n_nodes, **option)
