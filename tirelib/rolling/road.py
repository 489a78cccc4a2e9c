r"""Tread and road: pressure that can only push, shear that sticks or slides.

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

Under the contact the road runs with V = rho Omega. A bristle that sticks is sheared by
dq / dphi = rho - X', X the place of its tip along the road, and slides where k_s |q| > mu P.
rho, the rolling radius, follows from the wheel's torque.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.rolling.constants import Constants

SLIDING_STIFFNESS = 0.01
"""Share of a further shear that a sliding bristle takes: the road's speed stays determined where
everything slides."""


@dataclass(frozen=True, slots=True, eq=False)
class Tip:
    """Place of the tread's tip and its slopes by (u, v, psi, psi'); arrays (n_points, ...) each.

    Attributes
    ----------
    down, along : [m]
        Y downwards from the axle and X along the road's motion.
    arm : [m]
        Of the road's shear about the axle: Y less what the tread has grown thicker.
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
    step: FloatArray, before: FloatArray, limit: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return shear of bristles that come from `before` through `step`, held up to `limit`.

    Returns
    -------
    shear, its slope by before + step (1 where it sticks), its slope by the limit
    """
    wanted = before + step
    sticks = np.abs(wanted) <= limit
    side = np.sign(wanted) * ~sticks
    held = side * limit * (1.0 - SLIDING_STIFFNESS) + SLIDING_STIFFNESS * wanted
    slope = np.where(sticks, 1.0, SLIDING_STIFFNESS * (limit > 0.0))
    return (
        np.where(sticks, wanted, np.where(limit > 0.0, held, 0.0)),
        slope,
        side * (1.0 - SLIDING_STIFFNESS) * (limit > 0.0),
    )


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
