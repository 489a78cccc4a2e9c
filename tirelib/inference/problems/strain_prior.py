"""What is known of the base's numbers before a campaign: prior widths, means and a second start."""

from collections.abc import Mapping, Sequence

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.literature import literature
from tirelib.model.base import Coordinate

WIDTH = {
    "bending_stiffness": 0.7,
    "radial_stiffness": 0.7,
    "radial_pressure_slope": 1.5,
    "tangential_stiffness": 1.0,
    "tangential_pressure_slope": 1.5,
    "tread_stiffness": 0.9,
    "innerliner_offset": 0.15,
    "extension_stiffness": 0.7,
    "shear_stiffness": 0.7,
    "rotary_inertia": 1.0,
    "tread_shear_stiffness": 1.0,
    "tread_hardening": 0.7,
    "section_pull": 1.5,
    "liner_share": 1.0,
    "offset_pressure_slope": 1.5,
    "tread_poisson": 1.0,
    "contact_crown": 1.3,
    "creep": 1.3,
    "tread_spread": 1.3,
    "centrifugal_tension": 0.01,
}
"""Prior standard deviations of the base's coordinates: wide, the campaign informs them."""
ROUND = "contact_crown"
"""The number by which a base has two valleys."""
MEAN = {"centrifugal_tension": 1.0}
"""Means of priors that are narrow. All others stand about the model's own numbers."""


def as_in_literature(
    values: Mapping[str, float | FloatArray], free: Sequence[Coordinate]
) -> FloatArray:
    """Return the coordinates (n_free,) of a tire as the literature has it.

    Numbers that fit the runs well without an effect may lie in another valley than those that
    fit them with it. Treads that are round across and stiff, and flat and soft, are such
    valleys: this tire lies in the one in which the model is not.
    """
    known = literature(float(np.max(values["pressure"])))
    there = {c.name: known[c.name].value for c in free if c.name in known}
    moves = np.zeros(len(free))
    for k, c in enumerate(free):
        own = float(np.max(values[c.name]))
        if c.name in there and (c.unit or own):  # no factor moves a zero
            moves[k] = c.distance(own, there[c.name])
        if c.name == ROUND and moves[k] > -0.5 * WIDTH[ROUND]:
            moves[k] += WIDTH[ROUND]
    return moves
