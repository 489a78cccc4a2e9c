r"""Contact pressure over the contact length, as force per length [N/m].

Sources: dissertation Eq. (28) and (53), both in their corrected form, and the classical parabola.
x points forward, so the contact runs from its trailing edge a1 to its leading edge a2 > a1; a
symmetric contact of half length a has a1 = -a and a2 = +a. Pressure is never negative.

A profile carries quadrature nodes, weights and pressures for many operating points at once, whose
sum is the load, Eq. (24), and the curve itself, so that a user of it may cut the contact where it
must (at the edge of sliding) and still integrate exactly. The nodes are Gauss-Legendre in a
stretched variable, half of them on each side of the middle: every end power of the edges, and a
cusp in the middle, is integrated to about 1e-12.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import betaln

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.contact.curves import Curve, PowerCurve, SampledCurve, stretched_rule

CROWN_SCALE = 5000.0
"""The number under S_f in Eq. (53), [1/m^2]."""
NODES = 64
FEWEST_NODES = 8
SMALLEST_EXPONENT = 0.05
"""Below it the end power exceeds 20: all load on the middle, no contact pressure any more."""


@dataclass(frozen=True, slots=True, eq=False)
class PressureProfile:
    """Pressure over the contact of one or many operating points.

    Attributes
    ----------
    x : array, shape (..., n_nodes), [m]
        Nodes, ascending: from the trailing to the leading edge.
    weight : array, shape (..., n_nodes), [m]
        ``sum(weight * pressure)`` is the load.
    pressure : array, shape (..., n_nodes), [N/m]
    trailing, leading : arrays, shape (...), [m]
        The edges, trailing < leading.
    load : array, shape (...), [N]
    curve : Curve
        The pressure between the nodes; its rows are the operating points in C order.
    """

    x: FloatArray
    weight: FloatArray
    pressure: FloatArray
    trailing: FloatArray
    leading: FloatArray
    load: FloatArray
    curve: Curve

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the operating points."""
        return self.load.shape

    @property
    def length(self) -> FloatArray:
        """Contact length, shape (...), [m]."""
        return self.leading - self.trailing

    @property
    def center(self) -> FloatArray:
        """Centre of pressure, shape (...), [m]."""
        rows = np.arange(self.load.size)
        _, moment = self.curve.cumulative(np.ones(rows.size), rows)
        return self.leading - self.length * moment.reshape(self.shape) / self.load

    def pressure_at(self, x: npt.ArrayLike) -> FloatArray:
        """Return the pressure at any x, zero outside the contact.

        Parameters
        ----------
        x : array, shape (..., n) or (n,), [m]

        Returns
        -------
        pressure : array, shape (..., n), [N/m]
        """
        place = np.atleast_1d(np.asarray(x, dtype=np.float64))
        u = (self.leading[..., None] - place) / self.length[..., None]
        rows = np.arange(self.load.size).reshape(self.shape)[..., None]
        inside = (u >= 0.0) & (u <= 1.0)
        found = self.curve.pressure(np.where(inside, u, 0.0), np.broadcast_to(rows, u.shape))
        return np.where(inside, found, 0.0)


def parabola(
    load: npt.ArrayLike, trailing: npt.ArrayLike, leading: npt.ArrayLike, *, nodes: int = NODES
) -> PressureProfile:
    r"""Return the classical parabola about the middle of a contact of half length a.

    .. math:: q(x) = \frac{3 F_z}{4 a^3} (a^2 - x^2)

    Parameters
    ----------
    load : array_like, [N]
        > 0; broadcasts with the edges.
    trailing, leading : array_like, [m]
        trailing < leading.
    nodes : int
        Quadrature nodes, even, at least 8.

    Raises
    ------
    ParameterError
        If a load is not positive or an edge is out of order.

    Examples
    --------
    >>> p = parabola(4000.0, -0.06, 0.06)
    >>> float((p.weight * p.pressure).sum()), float(p.pressure_at(0.0)[0])
    (4000.0, 50000.0)
    """
    return power_law(load, trailing, leading, 1.0, nodes=nodes)


def power_law(
    load: npt.ArrayLike,
    trailing: npt.ArrayLike,
    leading: npt.ArrayLike,
    n: npt.ArrayLike,
    *,
    nodes: int = NODES,
) -> PressureProfile:
    r"""Return the profile of Eq. (28), convex for every n: n = 1 is the parabola, 2 the ellipse.

    .. math:: q(x) = q_0 \left[1 - (x/a)^2\right]^{1/n}, \qquad
              q_0 = \frac{F_z\,\Gamma(1/n + 3/2)}{a \sqrt{\pi}\,\Gamma(1/n + 1)}

    The text leaves q0 open. n = 1 .. 8 goes from rounded to flat; below 1 the pressure has no
    slope at the edges, above 1 an infinite one. No n gives a dip in the middle.

    Arguments and errors as for `parabola`, and n : array_like, the exponent, at least 0.05.
    """
    Fz, a1, a2, exponent = _broadcast(load=load, trailing=trailing, leading=leading, n=n)
    _check(Fz, a1, a2)
    _check_exponent("n", exponent)
    p = 1.0 / exponent
    # Beta(1/2, p + 1) = sqrt(pi) Gamma(p + 1) / Gamma(p + 3/2), the integral over xi = -1 .. 1.
    scale = 2.0 * Fz / np.exp(betaln(0.5, p + 1.0))
    zero = np.zeros_like(p)
    return _from_powers(Fz, a1, a2, (scale, zero, zero, p, zero), nodes)


def convex_concave(
    load: npt.ArrayLike,
    trailing: npt.ArrayLike,
    leading: npt.ArrayLike,
    n_p: npt.ArrayLike,
    S_f: npt.ArrayLike,
    S: npt.ArrayLike = 0.0,
    *,
    nodes: int = NODES,
) -> PressureProfile:
    r"""Return the profile of Eq. (53), convex or concave, symmetric or skewed.

    .. math:: q(x) = q_0\,[1 + S (x - x_m)]
              \left[(x - a_1)(a_2 - x)\left(\frac{S_f}{5000} + (x - x_m)^2\right)\right]^{1/n_p},
              \qquad x_m = \frac{a_1 + a_2}{2}

    The print lacks the minus sign in x - x_m and has (x - a1)(x - a2), negative inside the contact.
    With h half the contact length, the middle is a dip for S_f < 5000 h^2 and a crown above it; the
    centre of pressure is x_m + S <xi^2>, <xi^2> being the variance of the profile with S = 0.

    Arguments and errors as for `parabola`, and

    n_p : array_like
        Curvature exponent, at least 0.05.
    S_f : array_like
        Shape factor, >= 0.
    S : array_like, [1/m]
        Skew, positive toward the leading edge; abs(S) < 1/h keeps the pressure positive.
    """
    Fz, a1, a2, exponent, crown, skew = _broadcast(
        load=load, trailing=trailing, leading=leading, n_p=n_p, S_f=S_f, S=S
    )
    _check(Fz, a1, a2)
    _check_exponent("n_p", exponent)
    if not np.all(np.isfinite(crown) & (crown >= 0.0)):
        raise ParameterError(f"S_f = {_worst(crown)}; allowed is S_f >= 0; give a shape factor")
    half = 0.5 * (a2 - a1)
    if not np.all(np.abs(skew) * half < 1.0):
        raise ParameterError(
            f"S = {_worst(skew)} 1/m; allowed is abs(S) < 1/h, here {float(1.0 / half.max()):.4g} "
            "1/m, h being half the contact length; a larger skew makes the pressure negative"
        )
    p, fill = 1.0 / exponent, crown / (CROWN_SCALE * half**2)
    one = np.ones_like(p).ravel()
    powers = (skew * half).ravel(), fill.ravel(), p.ravel(), p.ravel()
    whole, _ = PowerCurve(one, one, *powers).cumulative(one, np.arange(one.size))
    return _from_powers(Fz, a1, a2, (Fz / whole.reshape(Fz.shape), *powers), nodes)


def sampled(
    x: npt.ArrayLike, pressure: npt.ArrayLike, *, load: npt.ArrayLike | None = None
) -> PressureProfile:
    """Return a profile given by samples, as a ring model makes it; straight lines between them.

    The samples themselves are the nodes. The edges are the first and the last sample.

    Parameters
    ----------
    x : array, shape (..., n) or (n,), [m]
        Strictly ascending: from the trailing to the leading edge; at least 3 samples.
    pressure : array, shape (..., n), [N/m]
        Never negative, not zero everywhere.
    load : array_like, shape (...), [N], optional
        Scales the samples to this load; by default they are taken as they are.

    Raises
    ------
    ShapeError
        If x and pressure do not fit each other.
    ParameterError
        If x does not ascend, a pressure is negative or not finite, or all are zero.
    """
    place, value = np.asarray(x, dtype=np.float64), np.asarray(pressure, dtype=np.float64)
    if place.ndim == 0 or value.ndim == 0 or place.shape[-1] != value.shape[-1]:
        raise ShapeError(
            f"x has shape {place.shape} but pressure has {value.shape}; both need the same samples "
            "along the last axis"
        )
    if place.shape[-1] < 3:
        raise ShapeError(f"{place.shape[-1]} samples are given; a profile needs at least 3")
    place, value = (np.ascontiguousarray(a) for a in np.broadcast_arrays(place, value))
    if not np.all(np.diff(place, axis=-1) > 0.0):
        raise ParameterError(
            "x of the sampled pressure does not ascend; it must grow from the trailing to the "
            "leading edge; flip or sort the samples"
        )
    if not np.all(np.isfinite(value) & (value >= 0.0)):
        raise ParameterError(
            f"sampled pressure = {_worst(value)} N/m; it must be finite and >= 0; "
            "cut the samples to the contact"
        )
    weight = np.zeros_like(place)
    weight[..., 1:] = 0.5 * np.diff(place, axis=-1)
    weight[..., :-1] += 0.5 * np.diff(place, axis=-1)
    whole = np.asarray((weight * value).sum(axis=-1))
    if not np.all(whole > 0.0):
        raise ParameterError("the sampled pressure is zero everywhere; a profile must carry load")
    if load is not None:
        (target,) = _broadcast(load=load)
        _check_load(target)
        whole, scale = np.broadcast_to(target, whole.shape), target / whole
        value = value * scale[..., None]
    a1, a2 = place[..., 0], place[..., -1]
    count = place.shape[-1]
    u = ((a2[..., None] - place) / (a2 - a1)[..., None])[..., ::-1].reshape(-1, count)
    curve = SampledCurve(u, value[..., ::-1].reshape(-1, count), np.ravel(a2 - a1))
    return PressureProfile(place, weight, value, a1, a2, np.array(whole), curve)


def _from_powers(
    load: FloatArray,
    trailing: FloatArray,
    leading: FloatArray,
    powers: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    nodes: int,
) -> PressureProfile:
    """Build the profile of a `PowerCurve` on its nodes."""
    if nodes < FEWEST_NODES or nodes % 2:
        raise ParameterError(
            f"nodes = {nodes}; allowed are even numbers of at least {FEWEST_NODES}"
        )
    half_rule, half_weight = stretched_rule(nodes // 2)
    u = np.concatenate([0.5 * half_rule, 1.0 - 0.5 * half_rule[::-1]])[::-1]
    weight = np.concatenate([0.5 * half_weight, 0.5 * half_weight[::-1]])
    length = leading - trailing
    scale, skew, fill, edge_power, fill_power = (np.ravel(part) for part in powers)
    curve = PowerCurve(scale, np.ravel(length), skew, fill, edge_power, fill_power)
    rows = np.arange(load.size).reshape(load.shape)[..., None]
    pressure = curve.pressure(*np.broadcast_arrays(u, rows))
    return PressureProfile(
        leading[..., None] - u * length[..., None],
        weight * length[..., None],
        pressure,
        trailing,
        leading,
        load,
        curve,
    )


def _broadcast(**given: npt.ArrayLike) -> tuple[FloatArray, ...]:
    """Return the arguments as arrays of one shape."""
    arrays = [np.asarray(value, dtype=np.float64) for value in given.values()]
    try:
        return tuple(np.array(a) for a in np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(given, arrays, strict=True))
        raise ShapeError(
            f"shapes {shapes} do not broadcast; give one value or one per operating point"
        ) from None


def _check(load: FloatArray, trailing: FloatArray, leading: FloatArray) -> None:
    _check_load(load)
    if not np.all(np.isfinite(trailing) & np.isfinite(leading) & (trailing < leading)):
        raise ParameterError(
            f"trailing = {_worst(trailing)} m, leading = {_worst(leading)} m; allowed: trailing < "
            "leading, both finite; two positive lengths need a minus sign at the trailing one"
        )


def _check_load(load: FloatArray) -> None:
    if not np.all(np.isfinite(load) & (load > 0.0)):
        raise ParameterError(f"load = {_worst(load)} N; it must be finite and > 0")


def _check_exponent(name: str, value: FloatArray) -> None:
    if not np.all(np.isfinite(value) & (value >= SMALLEST_EXPONENT)):
        raise ParameterError(
            f"{name} = {_worst(value)}; allowed is {name} >= {SMALLEST_EXPONENT}; 1 is the parabola"
        )


def _worst(values: FloatArray) -> str:
    """Show one value, or the range of many."""
    if values.size == 1:
        return f"{float(values.ravel()[0]):.6g}"
    return f"{float(values.min()):.6g} .. {float(values.max()):.6g}"
