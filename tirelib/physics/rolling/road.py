r"""Tread and road: pressure that can only push, friction that grows with slip.

The tread's tip lies h = R0 - R below the belt along its section's normal. Where it would reach
below the road by delta > 0, the tread is compressed and pushes back. Its crown is curved across the
width, so that the strip at y meets the road later, by C y^2 / 2; per length of belt

.. math:: P = k_t \int_{-B}^{B}\left[\delta_y + s\,\delta_y^2 / h_0\right] \frac{dy}{2 B},
          \qquad \delta_y = \max(\delta - C y^2 / 2, 0).

Tread rubber keeps its volume. Where the belt is bent flat its fibres outside are pressed together
along the circumference, and it grows thicker: with the bend psi' the tip of a tread of thickness
h_0, whose middle lies at h_m from the belt's neutral line, moves out by T psi',

.. math:: T = \bar\nu\,h_0\,\frac{h_m}{R + h_m}, \qquad \bar\nu = \frac{\nu}{1 - \nu},

straight down, which within the contact is its own direction. The same coupling is the moment P T
with which rubber that is compressed by the road, and pushes along the belt outside its neutral
line, bends the belt (a layer bonded to the belt, in plane strain; blocks with grooves around have
less).

Under the contact the road runs with V = rho Omega. A bristle is sheared by the way that road and
belt move apart, less the slip g of its foot, all per radian, and its shear is the friction of that
slip:

.. math:: q' = \rho - X' - g, \qquad k_s\,q = \mu P\,\frac{g}{\sqrt{g^2 + (c\rho)^2}},

X the place of the tread's tip along the road. The friction of rubber grows with its sliding speed
(Grosch, Proc. R. Soc. A 274 (1963)); c, the creep, is the slip at which it has 71 % of its full
value. With c = 0 a bristle sticks until k_s |q| = mu P and slides from there. rho, the rolling
radius, follows from the wheel's torque.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.physics.rolling.constants import Constants

SLIDING_STIFFNESS = 0.01
"""Share of a further shear that a sliding bristle takes: the road's speed stays determined where
everything slides."""
SLIP_STEPS = 60
SLIP_TOLERANCE = 1e-14
"""Relative to the shear of a bristle that sticks."""


@dataclass(frozen=True, slots=True, eq=False)
class Tip:
    """Place of the tread's tip and its slopes by (u, v, psi, psi'); arrays (n_points, ...) each.

    Attributes
    ----------
    down, along : [m]
        Y downwards from the axle and X along the road's motion.
    arm : [m]
        Lever of the road's shear about the axle: Y less what the tread has grown thicker.
    by_down, by_along : tuple of four
    lever_down, lever_along : [m]
        Minus the second derivatives by psi.
    """

    down: FloatArray
    along: FloatArray
    arm: FloatArray
    by_down: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    by_along: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    lever_down: FloatArray
    lever_along: FloatArray


def tip(
    u: FloatArray,
    v: FloatArray,
    psi: FloatArray,
    bend: FloatArray,
    phi: FloatArray,
    k: Constants,
) -> Tip:
    """Return the tip for displacements (n_points, ...) and bend = psi' at angles (...)."""
    shape = (-1, *[1] * (u.ndim - 1))
    radius, h = k.radius.reshape(shape), (k.free_radius - k.radius).reshape(shape)
    sin, cos = np.sin(phi), np.cos(phi)
    lean_sin, lean_cos = h * np.sin(phi - psi), h * np.cos(phi - psi)
    ones = np.ones_like(u)
    thicker = k.thickening.reshape(shape) * ones
    arm = (radius + u) * cos - v * sin + lean_cos
    return Tip(
        arm + thicker * bend,
        (radius + u) * sin + v * cos + lean_sin,
        arm,
        (cos * ones, -sin * ones, lean_sin, thicker),
        (sin * ones, cos * ones, -lean_cos, 0.0 * ones),
        lean_cos,
        lean_sin,
    )


def pressure(delta: FloatArray, k: Constants) -> tuple[FloatArray, FloatArray]:
    """Return P [N/m] and dP / d delta [N/m^2] for overlaps (n_points, ...)."""
    shape = (-1, *[1] * (delta.ndim - 1))
    curve, half = k.crown.reshape(shape), k.half_width.reshape(shape)
    stiff, harder = k.k_t.reshape(shape), (k.hardening / k.thickness).reshape(shape)
    d = np.maximum(delta, 0.0)
    reach = np.minimum(half, np.sqrt(2.0 * d / np.maximum(curve, 1e-9)))
    drop = curve * reach**2
    plain = reach * (d - drop / 6.0) / half
    square = reach * (d**2 - d * drop / 3.0 + drop**2 / 20.0) / half
    return stiff * (plain + harder * square), stiff * (reach / half + 2.0 * harder * plain)


def bristles(
    wanted: FloatArray, limit: FloatArray, creep: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the shear of bristles after a step, by the implicit Euler method.

    Parameters
    ----------
    wanted : shape (...), [m]
        Shear of a bristle that sticks all the way.
    limit : shape (...), [m]
        Shear of one that slides, mu P / k_s; zero where there is no contact.
    creep : shape (...), [m]
        Slip over the step at which friction has 71 % of its full value.

    Returns
    -------
    shear, and its slopes by the three
    """
    touches = limit > 0.0
    slip = _slip(np.abs(wanted), np.where(touches, limit, 1.0), creep)
    root = np.hypot(slip, creep)
    stiff = limit * creep**2 + root**3
    sticks = np.divide(limit * creep**2, stiff, out=np.ones_like(stiff), where=stiff > 0.0)
    full = np.divide(slip, root, out=np.zeros_like(root), where=root > 0.0)
    slower = np.divide(limit * slip * creep, stiff, out=np.zeros_like(stiff), where=stiff > 0.0)
    side = np.sign(wanted) * touches * (1.0 - SLIDING_STIFFNESS)
    return (
        touches * wanted - side * slip,
        touches * (sticks + SLIDING_STIFFNESS * (1.0 - sticks)),
        side * full * (1.0 - sticks),
        -side * slower,
    )


def _slip(wanted: FloatArray, limit: FloatArray, creep: FloatArray) -> FloatArray:
    """Return the slip s >= 0 with s + limit s / sqrt(s^2 + creep^2) = wanted; limit > 0.

    Newton's method on a concave function, from below: every step is too short.
    """
    slip = np.maximum(wanted - limit, wanted * creep / (limit + creep))
    for _ in range(SLIP_STEPS):
        root = np.hypot(slip, creep)
        safe = np.where(root > 0.0, root, 1.0)
        off = wanted - slip - np.where(root > 0.0, limit * slip / safe, wanted - slip)
        step = off / (1.0 + limit * creep**2 / safe**3)
        slip = slip + step
        if (np.abs(step) <= SLIP_TOLERANCE * wanted).all():
            break
    return slip


def entered(before: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the share of a step on which a bristle touches, by the overlaps at its two ends.

    Returns
    -------
    share, its slopes by the overlap before and after, [1/m]
    """
    enters = (before < 0.0) & (after > 0.0)
    rise = np.where(enters, after - before, 1.0)
    share = np.where(enters, after / rise, 1.0)
    return share, np.where(enters, after, 0.0) / rise**2, np.where(enters, -before, 0.0) / rise**2
