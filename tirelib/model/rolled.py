"""The rolling ring of a tire at operating points, and how it moves with anything it is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import offset_at
from tirelib.effects.state import Operating
from tirelib.physics.rolling.assemble import Unknowns, by_element, changed, differ, fields
from tirelib.physics.rolling.constants import Constants
from tirelib.physics.rolling.gage import Gage, same_place, strain, strain_along
from tirelib.physics.rolling.solve import Rolling, slopes

CONSTANT_STEP = 1e-6
"""Relative change of what the ring is made of, of which the residual's slope is taken."""
FRICTION = 1.0
"""Friction coefficient between tread and road. A wheel that rolls freely slides only where its
contact ends."""

Values = Mapping[str, float | FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """Parameters of a waveform: the ring's constants, and the gage's place.

    Attributes
    ----------
    constants : Constants
    gage : Gage
    """

    constants: Constants
    gage: Gage


def made_of(values: Values, points: Operating) -> Made:
    """Return the constants of a tire's values (names of `Tire`; arrays allowed) at points.

    A tire's damping is that of every mode, Eq. (107); the linear ring adds what it changes. The
    crown is what the belt keeps of it: most of its curvature a belt loses by bending across.
    """
    v, width = values, np.asarray(values["belt_width"])
    above = points.pressure - v["pressure"]
    constants = Constants.of(
        radius=v["ring_radius"],
        free_radius=v["free_radius"],
        EA=v["extension_stiffness"],
        GA=v["shear_stiffness"],
        EI=v["bending_stiffness"],
        mass=v["mass"],
        rotary_inertia=v["rotary_inertia"],
        inflation=points.pressure * width,
        tension=_tension(v, points),
        k_u=v["radial_stiffness"] + v["radial_pressure_slope"] * above,
        k_v=v["tangential_stiffness"] + v["tangential_pressure_slope"] * above,
        softening=0.0,
        dashpots=0.0,
        k_t=v["tread_stiffness"],
        hardening=v["tread_hardening"],
        thickness=v["tread_thickness"],
        crown=v["contact_crown"],
        half_width=0.5 * width,
        k_s=v["tread_shear_stiffness"],
        poisson=v["tread_poisson"],
        friction=FRICTION,
        creep=v["creep"],
        omega=points.omega,
        load=points.load,
        torque=0.0,
    )
    spread = np.asarray(v["tread_spread"]) * np.asarray(v["tread_thickness"])
    offset = offset_at(
        v["innerliner_offset"], v["offset_pressure_slope"], points.pressure, v["pressure"]
    )
    each = (offset, v["liner_share"], spread)
    places = [np.full(len(points), x, dtype=float) for x in each]
    return Made(constants, Gage(*places))


def _tension(v: Values, points: Operating) -> FloatArray:
    """Return the tension beyond p b R + rho A R^2 Omega^2, (n_points,), [N].

    The sidewalls take some of p b. Their mass moves with the belt by about a third and pulls on it
    by about a half, so that tension and inertia of a spinning belt do not quite balance.
    """
    radius = np.asarray(v["ring_radius"])
    pulled = v["section_pull"] * points.pressure * v["belt_width"] * radius
    spun = (v["centrifugal_tension"] - 1.0) * v["mass"] * (radius * points.omega) ** 2
    return np.asarray(spun - pulled)


@dataclass(frozen=True, slots=True, eq=False)
class RolledSlopes:
    """Slopes of a solution by some directions.

    Attributes
    ----------
    strain : shape (n_directions, n_points, n_phi)
        Before any filter.
    deflection : shape (n_directions, n_points), [m]
    unknowns : sequence of Unknowns
    """

    strain: FloatArray
    deflection: FloatArray
    unknowns: Sequence[Unknowns]

    def start(self, found: Rolling, dz: FloatArray) -> Unknowns:
        """Return a first guess after moves dz along the first directions, (n,) or (n, n_points)."""
        x = found.x
        for step, by in zip(dz, self.unknowns, strict=False):
            x = x.plus(by, np.broadcast_to(step, x.depth.shape))
        return x


def rolled_slopes(
    found: Rolling, here: Made, there: Sequence[Made], step: float | Sequence[float], n_phi: int
) -> RolledSlopes:
    """Return slopes towards what a waveform is made of `step` away, for each of `there`.

    By the implicit function theorem: the solution moves by -J^-1 dF, whatever changes F.
    """
    k, x, grid = here.constants, found.x, found.mesh
    off = [changed(x, found.z, found.contact, k, each.constants, grid) for each in there]
    steps = np.broadcast_to(np.asarray(step, dtype=float), (len(there),))
    moved = slopes(found, [each.per(float(h)) for each, h in zip(off, steps, strict=True)])
    dz = np.stack([fields(by_element(by.node), grid.belt) for by in moved])
    rows = strain_along(found.z, dz, k, here.gage, found.size, n_phi)
    base = strain(found.z, k, here.gage, found.size, n_phi)
    for row, each, h in zip(rows, there, steps, strict=True):
        if differ(k, each.constants, ("radius",)) or not same_place(here.gage, each.gage):
            row += (strain(found.z, each.constants, each.gage, found.size, n_phi) - base) / h
    return RolledSlopes(rows, np.stack([by.depth for by in moved]), moved)
