r"""Forces of the brush under a pressure that is flatter or more peaked than the parabola.

With X the place in the contact, 1 leading edge, -1 trailing edge, and c the flatness,

.. math:: p(X) = \frac{3 F_z}{4 a}\,(1 - X^2)\,\frac{1 + c X^2}{1 + c/5}.

c = 0 is the parabola, c = 1 rises with the fourth power toward the edges, above 1 the middle is
lower than the sides. With y the share of the contact that slides, at its trailing end, and t as in
`tirelib.brush.predict`,

.. math:: y\,\frac{1 + c (2y - 1)^2}{1 + c/5} = t,

and the sliding part's force and moment are polynomials of y. Axes ISO 8855.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.arrays import FloatArray
from tirelib.brush.predict import (
    PointConditions,
    PointForces,
    PointParameters,
    _answer,
    _Contact,
    predict_forces,
)
from tirelib.errors import ParameterError

LOWEST, HIGHEST = -0.9, 2.9
"""Allowed flatness: beyond -1 the pressure is negative, from 3 on sticking has no single end."""
_STEPS = 60


def predict_shaped(
    parameters: PointParameters, conditions: PointConditions, flatness: npt.ArrayLike = 0.0
) -> PointForces:
    """Return steady-state forces and aligning moment, shape (n,).

    Parameters
    ----------
    parameters, conditions
        As for `tirelib.brush.predict.predict_forces`, whose result this is without flatness.
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
    contact = _Shaped(plain.c_px, plain.c_py, plain.stick, plain.slide, plain.a, plain.kappa,
                      plain.tangent, c)  # fmt: skip
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
        y = _sliding(t, c)
        s = 1.0 - y
        stick = 2.0 * (self.a * s) ** 2 / np.where(rolling > 0.0, rolling, 1.0)
        slip = np.hypot(self.kappa, across)
        slip = np.where(slip > 0.0, slip, 1.0)
        slide_x, slide_y = self.slide * (self.kappa / slip), self.slide * (across / slip)
        share, arm = _share(y, c), _arm(y, c)
        Fx = stick * demand_x + share * slide_x
        Fy = stick * demand_y + share * slide_y
        moment = self.a * (stick * demand_y * (1.0 - 4.0 / 3.0 * s) + arm * slide_y)
        return Fx, Fy, moment


def _sliding(t: FloatArray, c: FloatArray) -> FloatArray:
    """Return the share of the contact that slides, by Newton steps kept inside a bracket."""
    scale = 1.0 + c / 5.0
    low, high = np.zeros(np.broadcast_shapes(t.shape, c.shape)), np.ones_like(t + c)
    y = np.clip(t, 0.0, 1.0) + 0.0 * c
    for _ in range(_STEPS):
        x = 2.0 * y - 1.0
        rest = y * (1.0 + c * x**2) / scale - t
        low, high = np.where(rest < 0.0, y, low), np.where(rest >= 0.0, y, high)
        slope = (1.0 + c * x**2 + 4.0 * c * x * y) / scale
        with np.errstate(invalid="ignore"):
            step = y - rest / slope
        inside = (step > low) & (step < high)
        new = np.where(inside, step, 0.5 * (low + high))
        if np.all(np.abs(new - y) < 1e-15):
            y = new
            break
        y = new
    whole = t >= (1.0 + c) / scale
    out: FloatArray = np.where(whole, 1.0, np.where(t > 0.0, y, 0.0))
    return out


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
