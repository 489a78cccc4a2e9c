r"""Compression of the innerliner by the tread's outward shear (dissertation, chapter 7, Fig. 7-3).

Measured tension inside the contact falls as the load grows; a ring of Bernoulli-Euler type shows a
rise and then a level, whatever the contact. The proposal there: bend the ring first, then let the
outward shear that the road holds at the tread's surface deform the flat piece as a straight beam,
and add the two strains.

**The beam stage.** The traction tau (along +phi on the tire, per length of belt) acts a lever h
outside the neutral line. With N the axial force and M the moment that it builds up,

.. math:: \frac{dN}{ds} = -\tau, \qquad EI\,\beta'' - k_\beta\,\beta = -h\,\tau,

so that for a beam free in rotation (k_beta = 0) M = EI beta' = h N, and at the innerliner, y < 0,

.. math:: \Delta\varepsilon = \frac{N}{EA} + y\,\beta'
          = N \left(\frac1{EA} + \frac{y\,h}{EI}\right) < 0
          \quad\text{for outward shear } (N > 0),\ EA > EI / (h |y|).

Seen from the innerliner the lever is h + abs(y), the same force couple taken about another line.
Over harmonics, N_n = -R tau_n / (i n) and, with kappa = n / R,

.. math:: \Delta\varepsilon_n = s\,N_n\left(\frac1{EA}
          + \frac{y\,h\,\kappa^2}{EI\kappa^2 + k_\beta}\right).

**What is assumed.** (1) The two stages superpose. (2) The belt about the patch gives way: the
axial force comes from the patch alone, sidewall and the rest of the ring do not hold it. (3) The
flat road does not hold the cross-sections' rotation. That is not so: with Bernoulli-Euler sections
it holds it entirely. `restraint` k_beta is a shear stiffness GA that resists the rotation while
the neutral line stays flat (0 is free, the whole h N / EI; large ones leave y h tau' / GA, then
nothing), and the `strength` s is the share that a measurement shows. s = 0 is the ring alone,
exactly. A free beam overstates by an order of magnitude, so s of some hundredths is plausible with
k_beta = 0. (4) Traction and pressure do not answer to the added deformation.

**The traction** is given, or the simple law `outward_shear`.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.core.parameters import Tire
from tirelib.physics.contact.fourier import load_harmonics
from tirelib.physics.contact.layout import StripContact
from tirelib.physics.ring.ring import ComplexArray


@dataclass(frozen=True, slots=True)
class TreadBeam:
    """The straight beam that the tread's shear compresses.

    Attributes
    ----------
    bending_stiffness : [N m^2]
        EI > 0, of the whole belt.
    lever : [m]
        h > 0, tread surface from the neutral line.
    offset : [m]
        y < 0, gages from the neutral line.
    extension_stiffness : [N]
        EA > 0; infinite leaves bending alone.
    restraint : [N]
        k_beta >= 0, what holds the cross-sections' rotation.
    strength : [-]
        s >= 0; 0 is off.
    """

    bending_stiffness: float
    lever: float
    offset: float
    extension_stiffness: float = np.inf
    restraint: float = 0.0
    strength: float = 1.0

    def __post_init__(self) -> None:
        allowed = {
            "bending_stiffness": (self.bending_stiffness > 0, "> 0"),
            "lever": (self.lever > 0, "> 0"),
            "offset": (self.offset < 0, "< 0: the innerliner is inside the neutral line"),
            "extension_stiffness": (self.extension_stiffness > 0, "> 0"),
            "restraint": (self.restraint >= 0, ">= 0"),
            "strength": (self.strength >= 0, ">= 0"),
        }
        for name, (good, wanted) in allowed.items():
            value = getattr(self, name)
            if not good or (np.isinf(value) and name != "extension_stiffness"):
                raise ParameterError(
                    f"tread beam: {name} = {value:g} (SI); a finite number {wanted} is needed"
                )

    @classmethod
    def of(cls, tire: Tire, strength: float, restraint: float = 0.0) -> "TreadBeam":
        """Return the beam of a tire's belt."""
        return cls(
            tire.bending_stiffness,
            tire.free_radius - tire.ring_radius,
            tire.innerliner_offset,
            tire.extension_stiffness,
            restraint,
            strength,
        )


def outward_shear(contact: StripContact, tire: Tire, gathering: float | None = None) -> FloatArray:
    r"""Return the tread's outward shear on each strip from a simple law, [N/m].

    The tread's surface is an arc of the free radius; flattened with the belt it is too long by
    g = (R0 - R) / R, so its tips lie outside of their roots by g abs(x) and the road, holding them,
    pulls the belt's surface outward, up to friction:

    .. math:: \tau = \operatorname{sgn}(x)\,\min(k_{Gt}\,g\,|x|,\ \mu q), \qquad
              x = R\,(\varphi - \varphi_{middle}).

    What its two halves leave as a resultant is taken off in proportion to the pressure: free
    rolling needs no force.

    Parameters
    ----------
    contact : StripContact
    tire : Tire
        Gives k_Gt (`tread_shear_stiffness`), mu (`friction`) and the radii.
    gathering : float, optional
        g in place of (R0 - R) / R.

    Returns
    -------
    shape (n_points, n_strips, n_nodes), along +phi on the tire, at the nodes of the contact.

    Raises
    ------
    ParameterError
        If g is negative.
    """
    g = tire.free_radius / tire.ring_radius - 1.0 if gathering is None else gathering
    if not g >= 0.0:
        raise ParameterError(f"outward shear: gathering = {g:g}; a number >= 0 is needed")
    middle = np.nan_to_num(contact.edges.mean(axis=-1))[..., None]
    x = contact.radius[:, None, None] * (contact.phi - middle)
    stiff = tire.tread_shear_stiffness * contact.layout.width_share[:, None] * g
    q = contact.line_pressure
    tau = np.sign(x) * np.minimum(stiff * np.abs(x), tire.friction * q)
    rest = (tau * contact.weights).sum(axis=-1)
    whole = (q * contact.weights).sum(axis=-1)
    ratio = rest / np.where(whole > 0.0, whole, 1.0)
    out: FloatArray = tau - ratio[..., None] * q
    return out


def tread_strain(contact: StripContact, traction: FloatArray, beam: TreadBeam) -> ComplexArray:
    """Return harmonics of the strain that the tread's shear adds at every gage.

    Parameters
    ----------
    contact : StripContact
    traction : shape (n_points, n_strips, n_nodes), [N/m]
        Along +phi on the tire, at the contact's nodes; without resultant on any strip.
    beam : TreadBeam
        Beam of the whole belt; a strip has its share of it.

    Returns
    -------
    shape (n_points, n_strips, n_modes + 1), for `tirelib.physics.strain.gages`.

    Raises
    ------
    ShapeError
        If the traction has another shape.
    ParameterError
        If it has a resultant: then no straight beam of the patch alone can balance it.
    """
    if traction.shape != contact.phi.shape:
        raise ShapeError(
            f"tread strain: traction has shape {traction.shape}; that of the contact's nodes, "
            f"{contact.phi.shape}, is needed"
        )
    force = contact.weights * traction
    rest, size = np.abs(force.sum(axis=-1)), np.abs(force).sum(axis=-1)
    if (rest > 1e-6 * size.max()).any():
        point, strip = np.argwhere(rest > 1e-6 * size.max())[0]
        raise ParameterError(
            f"tread strain: the traction of point {point}, strip {strip} has a resultant of "
            f"{rest[point, strip] / size[point, strip]:.1%} of its size; none is allowed: give "
            "drive and brake forces to `press_strips`",
            point=int(point),
        )
    n_modes = contact.displacement.shape[-2] - 1
    flat = (-1, force.shape[-1])
    phi = contact.phi.reshape(flat)
    tau = load_harmonics(phi, force.reshape(flat), n_modes).reshape(*force.shape[:2], -1)
    n = np.arange(n_modes + 1.0)
    radius = contact.radius[:, None, None]
    axial = 1j * radius * tau / np.where(n == 0, 1.0, n)
    # mean of N = R int tau dphi over the patch, by parts
    axial[..., 0] = contact.radius[:, None] * (force * contact.phi).sum(axis=-1) / (2.0 * np.pi)
    wave = (n / radius) ** 2
    if beam.restraint == 0.0:
        bend = np.full_like(wave, 1.0 / beam.bending_stiffness)
    else:
        bend = wave / (beam.bending_stiffness * wave + beam.restraint)
    share = contact.layout.width_share[:, None]
    compliance = 1.0 / beam.extension_stiffness + beam.offset * beam.lever * bend
    out: ComplexArray = beam.strength * axial * compliance / share
    return out
