r"""Forces of the brush under a pressure that is flatter or more peaked than the parabola.

With X the place in the contact, 1 leading edge, -1 trailing edge, and c the flatness,

.. math:: p(X) = \frac{3 F_z}{4 a}\,(1 - X^2)\,\frac{1 + c X^2}{1 + c/5}.

c = 0 is the parabola, c = 1 rises with the fourth power toward the edges, above 1 the middle is
lower than the sides. With y a place in the contact, 0 trailing and 1 leading edge, and t as in
`tirelib.physics.brush.predict`, bristles stick where

.. math:: y\,\frac{1 + c (2y - 1)^2}{1 + c/5} > t.

They slide behind, and under a peaked pressure (c < -0.2) also ahead of that; force and moment of
the parts are polynomials of the ends. Axes ISO 8855.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.brush.predict import (
    PointConditions,
    PointForces,
    PointParameters,
    _answer,
    _Contact,
    predict_forces,
)

LOWEST, HIGHEST = -0.9, 2.9
"""Allowed flatness: beyond -1 the pressure is negative, from 3 on sticking has no single end."""
ONE_END = -0.2
"""Flatness below which the contact may slide at the leading end as well, where pressure is low."""
_STEPS = 60
_SAME = 1e-15
"""Change of a share at which its Newton steps end."""


def predict_shaped(
    parameters: PointParameters, conditions: PointConditions, flatness: npt.ArrayLike = 0.0
) -> PointForces:
    """Return steady-state forces and aligning moment, shape (n,).

    Parameters
    ----------
    parameters, conditions
        As for `tirelib.physics.brush.predict.predict_forces`, whose result this is without
        flatness.
    flatness : array_like
        c, one for all points or one per point.

    Raises
    ------
    ParameterError
        If a number is out of range.
    ShapeError
        If parameters and conditions do not broadcast.
    ConvergenceError
        If the balance with a compliant carcass is not found.
    """
    c = np.asarray(flatness, dtype=np.float64)
    if not np.any(c):
        return predict_forces(parameters, conditions)
    if not np.all((c >= LOWEST) & (c <= HIGHEST)):
        wrong = c[~((c >= LOWEST) & (c <= HIGHEST))]
        raise ParameterError(
            f"brush: flatness = {float(wrong.ravel()[0]):.6g} of the pressure; allowed is "
            f"{LOWEST:g} to {HIGHEST:g}, 0 is the parabola"
        )
    plain = _Contact.of(parameters, conditions)
    contact = _Shaped(
        plain.c_px, plain.c_py, plain.stick, plain.slide, plain.a, plain.kappa, plain.tangent, c
    )
    return _answer(contact, parameters)


@dataclass(frozen=True, slots=True, eq=False)
class _Shaped(_Contact):
    """A contact under a shaped pressure."""

    c: FloatArray

    def forces(self, turn: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return Fx, Fy and the moment about the middle, for a turn of the contact."""
        rolling, c = 1.0 + self.kappa, self.c
        across = rolling * turn - self.tangent
        demand_x, demand_y = self.c_px * self.kappa, self.c_py * across
        limit = 1.5 * rolling * self.stick / self.a**2
        size = np.hypot(demand_x, demand_y)
        t = np.where(limit > 0.0, size / np.where(limit > 0.0, limit, 1.0), np.inf)
        y, lead = _ends(t, c)
        s, s_lead = 1.0 - y, 1.0 - lead
        stick = 2.0 * self.a**2 / np.where(rolling > 0.0, rolling, 1.0)
        slip = np.hypot(self.kappa, across)
        slip = np.where(slip > 0.0, slip, 1.0)
        slide_x, slide_y = self.slide * (self.kappa / slip), self.slide * (across / slip)
        share = _share(y, c) + 1.0 - _share(lead, c)
        arm = _arm(y, c) - _arm(lead, c)
        held = stick * (s**2 - s_lead**2)
        turned = held - 4.0 / 3.0 * stick * (s**3 - s_lead**3)
        Fx = held * demand_x + share * slide_x
        Fy = held * demand_y + share * slide_y
        moment = self.a * (turned * demand_y + arm * slide_y)
        return Fx, Fy, moment


def _ends(t: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return between which shares y, from the trailing end, the contact sticks."""
    t, c = np.broadcast_arrays(t, c)
    peaked = c < ONE_END
    flat = np.where(peaked, c, -1.0)
    peak = np.where(peaked, 1.0 / 3.0 - np.sqrt(flat**2 - 3.0 * flat) / (6.0 * flat), 1.0)
    whole = t >= _reach(peak, c)
    part = ~whole & (t > 0.0)
    both = peaked & ~whole & (t > _reach(np.ones_like(peak), c))
    trailing, leading = np.where(whole, 1.0, 0.0), np.ones(t.shape)
    trailing[part] = _root(t[part], c[part], np.zeros(t.shape)[part], peak[part])
    leading[both] = _root(t[both], c[both], np.ones(t.shape)[both], peak[both])
    return trailing, leading


def _reach(y: FloatArray, c: FloatArray) -> FloatArray:
    """Return the demand t up to which a bristle at y sticks."""
    out: FloatArray = y * (1.0 + c * (2.0 * y - 1.0) ** 2) / (1.0 + c / 5.0)
    return out


def _root(t: FloatArray, c: FloatArray, below: FloatArray, above: FloatArray) -> FloatArray:
    """Return y where `_reach` is t, by Newton steps kept between too low and too high a reach."""
    y = below + (above - below) * np.clip(t, 0.0, 1.0)
    for _ in range(_STEPS):
        x = 2.0 * y - 1.0
        rest = _reach(y, c) - t
        below, above = np.where(rest < 0.0, y, below), np.where(rest >= 0.0, y, above)
        slope = (1.0 + c * x**2 + 4.0 * c * x * y) / (1.0 + c / 5.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = y - rest / slope
        inside = (step > np.minimum(below, above)) & (step < np.maximum(below, above))
        there = np.abs(step - y) < _SAME
        new = np.where(inside | there, step, 0.5 * (below + above))
        if there.all():
            return new
        y = new
    return y


def _share(y: FloatArray, c: FloatArray) -> FloatArray:
    """Return the share of the load on the sliding end of the contact."""
    inside = 3.0 * (1.0 + c) - y * (2.0 * (1.0 + 5.0 * c) - y * (12.0 * c - 4.8 * c * y))
    out: FloatArray = y**2 * inside / (1.0 + c / 5.0)
    return out


def _arm(y: FloatArray, c: FloatArray) -> FloatArray:
    """Return the moment of the pressure on the sliding end about the middle, over Fz a."""
    inside = -3.0 * (1.0 + c) + y * (
        2.0 * (3.0 + 7.0 * c) - y * (1.5 * (2.0 + 18.0 * c) - y * (24.0 * c - 8.0 * c * y))
    )
    out: FloatArray = y**2 * inside / (1.0 + c / 5.0)
    return out
