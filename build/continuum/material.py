"""The law of all rubber: compressible neo-Hookean, with cords or cuts along the circumference.

    W = mu/2 (F:F - 2 - 2 ln J) + lambda/2 (ln J)^2 + c/2 E_t^2,   E_t = (F e_t . F e_t - 1)/2

in the plane. c > 0 is a ply of cords, c < 0 a tread that is cut across: it takes away stiffness
along the circumference and leaves that to compression and shear. At no strain
C_tt = lambda + 2 mu + c, C_rr = lambda + 2 mu, C_tr = lambda, and the shear modulus is mu. A
compressed tread hardens by itself, as rubber does.

Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), ch. 6.
"""

from dataclasses import dataclass

import numpy as np

from continuum.polar import Array


@dataclass(frozen=True)
class Rubber:
    """Moduli in the plane [Pa] and density [kg/m^3]."""

    shear: float
    lame: float
    cords: float
    density: float

    @property
    def upright(self) -> float:
        """C_rr: compression of a layer that cannot widen [Pa]."""
        return self.lame + 2.0 * self.shear

    @property
    def along(self) -> float:
        """Modulus along the circumference of a layer that is free across [Pa]."""
        return self.upright + self.cords - self.lame**2 / self.upright


def rubber(upright: float, shear: float, along: float, density: float) -> Rubber:
    """Choose the moduli for a wanted C_rr, shear modulus and modulus along the circumference."""
    lame = upright - 2.0 * shear
    return Rubber(shear, lame, along - upright + lame**2 / upright, density)


def stress(moduli: Array, frame: Array, grad: Array) -> tuple[Array, Array]:
    """Return the first Piola stress (..., 2, 2) and its derivative (..., 2, 2, 2, 2) [Pa].

    Parameters
    ----------
    moduli : shape (..., 3)
        mu, lambda, c.
    frame, grad : shape (..., 2, 2)
        [component, direction]: reference directions, and the displacement's derivatives.
    """
    mu, lame, cords = (moduli[..., k, None, None] for k in range(3))
    f = frame + grad
    inverse = np.empty_like(f)  # F^-T
    det = f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]
    inverse[..., 0, 0], inverse[..., 1, 1] = f[..., 1, 1], f[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -f[..., 1, 0], -f[..., 0, 1]
    inverse /= det[..., None, None]
    log = np.log(np.where(det > 0.0, det, np.nan))[..., None, None]
    p = mu * (f - inverse) + lame * log * inverse
    t = f[..., 0]
    stretch = 0.5 * (np.sum(t * t, axis=-1) - 1.0)[..., None]
    p[..., 0] += cords[..., 0] * stretch * t
    a = lame[..., None, None] * np.einsum("...ia,...jb->...iajb", inverse, inverse)
    a += (mu - lame * log)[..., None, None] * np.einsum("...ib,...ja->...iajb", inverse, inverse)
    eye = np.eye(2)
    a += mu[..., None, None] * np.einsum("ij,ab->iajb", eye, eye)
    a[..., :, 0, :, 0] += cords * (stretch[..., None] * eye + t[..., :, None] * t[..., None, :])
    return p, a
