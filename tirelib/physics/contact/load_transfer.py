r"""Tilt of the contact across its width: crown, camber, and the roll moment of the side force.

Strip i at the lateral position y (left positive) is pressed by

.. math:: d_i = d_0 - \tfrac12 c\,y^2 - y \tan\gamma

with the crown's curvature c and the camber gamma (ISO 8855: a positive one leans the wheel's top to
the right, so the right strips, y < 0, go deeper).

The sidewalls hold the belt's lateral line load, but at the height h_r above the tread ("roll
lever"). With the reaction k_l w(phi) this is a roll moment per length h_r k_l w, which lifts the
left side where w > 0 (Fy > 0) and loads the right one. As a line load on the strips, outward
positive, linear across the width,

.. math:: q_{u,i}(\varphi) = -h_r\,k_l\,w(\varphi)\,\frac{y_i}{\sum_j y_j^2}, \qquad
          \sum_i q_{u,i} = 0, \quad -\sum_i y_i q_{u,i} = h_r\,k_l\,w.

The belt's tilt and the load transfer follow from the strips' own compliance.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.ring.ring import ComplexArray

LARGEST_CAMBER = 0.35
"""Beyond, the side of the tread would touch the road, [rad]."""


def strip_deflection(
    deflection: FloatArray, lateral: FloatArray, camber: FloatArray, crown_curvature: float
) -> FloatArray:
    """Return the deflection of each strip, shape (n_points, n_strips), [m].

    Parameters
    ----------
    deflection : shape (n_points,), [m]
        d0 at the equator.
    lateral : shape (n_strips,), [m]
    camber : shape (n_points,), [rad]
    crown_curvature : [1/m]

    Raises
    ------
    ParameterError
        If a camber is not finite or beyond 0.35 rad.
    """
    if not (np.abs(camber) <= LARGEST_CAMBER).all():
        worst = camber[~(np.abs(camber) <= LARGEST_CAMBER)][0]
        raise ParameterError(
            f"strips: camber = {worst:.4g} rad; allowed is up to {LARGEST_CAMBER} rad to either "
            "side; give it in radians"
        )
    drop = 0.5 * crown_curvature * lateral**2
    out: FloatArray = deflection[:, None] - drop - np.tan(camber)[:, None] * lateral
    return out


def roll_load(reaction: ComplexArray, lateral: FloatArray, lever: float) -> ComplexArray:
    """Return harmonics of the outward line load on each strip from the sidewalls' side force.

    Parameters
    ----------
    reaction : shape (n_points, n_modes + 1), [N/m]
        Lateral force of the belt on the sidewalls, left positive (`LateralDeflection.reaction`).
    lateral : shape (n_strips,), [m]
    lever : [m]
        h_r, height above the tread at which the sidewalls hold the belt.

    Returns
    -------
    shape (n_points, n_strips, n_modes + 1), [N/m]
    """
    square = float(np.sum(lateral**2))
    if square == 0.0:
        return np.zeros((reaction.shape[0], lateral.size, reaction.shape[1]), dtype=complex)
    out: ComplexArray = -lever * reaction[:, None, :] * (lateral / square)[:, None]
    return out
