r"""Point-load response of a static, inextensible Bernoulli-Euler ring on radial springs.

The tread band is a closed ring of radius R and bending stiffness EI, held by radial springs k_u
per length (sidewall and air). A line force P presses it inward at the road. Radial and tangential
balance without the hoop force give the dissertation's Eq. (41), where the last coefficient is
lambda_u squared (the print lacks the square):

.. math:: u^{(5)} + 2 u''' + \lambda_u^2 u' = 0, \qquad
          \lambda_u = \sqrt{R^4 k_u / EI + 1} \quad (42)

Signs: phi = 0 at the load, that is at the road. The dissertation's angle is phi + pi (its load
sits at pi); the response is even, so the sense of rotation does not matter. u is positive outward,
the load positive inward: u < 0 at phi = 0.

Validity: small rotations, no stretch, no tangential springs, no pretension, no inertia.
"""

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError

_BLOCK = 256


def point_response(
    angle: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    bending_stiffness: npt.ArrayLike,
    radial_stiffness: npt.ArrayLike,
    derivative: int = 0,
) -> FloatArray:
    r"""Radial displacement per unit of inward line force at phi = 0, in closed form.

    .. math:: u = C_0 + C_1 \cosh\alpha x \cos\beta x + C_4 \sinh\alpha x \sin\beta x,
              \qquad x = \pi - |\varphi|,

    Eq. (43) to (46), without the factor alpha that the print has before sinh in (45) and (46).
    The hyperbolic functions enter multiplied by exp(-pi alpha), so nothing overflows however stiff
    the springs; and sin(pi beta) is taken from beta - 1, so nothing cancels when they are soft.

    Parameters
    ----------
    angle : array, [rad]
        Angle from the load; any number of turns.
    ring_radius, bending_stiffness, radial_stiffness : array, [m], [N m2], [N/m2]
        R, EI and k_u, > 0. All four arguments broadcast against each other.
    derivative : int
        Order of the derivative by phi, 0 or more. The third jumps by -R^3/EI at phi = 0; there the
        value at phi = +0 is returned.

    Returns
    -------
    array, [m/N]

    Raises
    ------
    ParameterError
        If a stiffness or the radius is not positive and finite, an angle is not finite, or the
        order of the derivative is negative.

    Examples
    --------
    >>> u = point_response([0.0, np.pi], ring_radius=0.3, bending_stiffness=2.0,
    ...                    radial_stiffness=6.3e5)
    >>> [f"{value:.6e}" for value in u]
    ['-1.258297e-05', '8.417650e-07']
    """
    where = "point response of the ring"
    R, EI, k_u = positive(
        where,
        ring_radius=ring_radius,
        bending_stiffness=bending_stiffness,
        radial_stiffness=radial_stiffness,
    )
    if derivative < 0:
        raise ParameterError(f"{where}: derivative = {derivative}; must be 0, 1, 2, ...")
    phi = wrapped(where, angle)
    alpha, beta, c0, c1, c4 = scaled_constants(R, EI, k_u)
    x = np.pi - np.abs(phi)
    rising = np.exp(-alpha * np.abs(phi) + 1j * beta * x)
    falling = np.exp(-alpha * (np.pi + x) - 1j * beta * x)
    hyperbolic = 0.5 * (rising + (-1) ** derivative * falling)
    # cosh cos = Re, sinh sin = Im of cosh((alpha + i beta) x)
    s = alpha + 1j * beta
    turned = np.real((c1 - 1j * c4) * s**derivative * hyperbolic)
    value: FloatArray = turned * np.where(phi < 0.0, 1.0, -1.0) ** derivative
    return value + c0 if derivative == 0 else value


def scaled_constants(R: FloatArray, EI: FloatArray, k_u: FloatArray) -> tuple[FloatArray, ...]:
    """Return alpha, beta, C0, C1 exp(pi alpha), C4 exp(pi alpha) of Eq. (42) to (46).

    C0, C1, C4 are per unit load, [m/N]. Arguments broadcast; they are not checked.
    """
    ratio = R**4 * k_u / EI
    lam = np.sqrt(ratio + 1.0)  # (42)
    alpha = np.sqrt(0.5 * ratio / (lam + 1.0))
    beta = np.sqrt(0.5 * (lam + 1.0))
    beyond = np.pi * alpha**2 / (beta + 1.0)  # pi (beta - 1)
    sine, cosine = -np.sin(beyond), -np.cos(beyond)  # of pi beta
    cosh = 0.5 * (1.0 + np.exp(-2.0 * np.pi * alpha))  # of pi alpha, times exp(-pi alpha)
    sinh = -0.5 * np.expm1(-2.0 * np.pi * alpha)
    # cos 2 pi beta - cosh 2 pi alpha, times exp(-2 pi alpha)
    bracket = -2.0 * (np.exp(-2.0 * np.pi * alpha) * sine**2 + sinh**2)
    K = R**3 / (2.0 * EI * alpha * beta * (alpha**2 + beta**2) * bracket)
    c0 = R**3 / (2.0 * np.pi * EI * lam**2)  # (44)
    c1 = K * (alpha * cosh * sine + beta * sinh * cosine)  # (45)
    c4 = K * (beta * cosh * sine - alpha * sinh * cosine)  # (46)
    return alpha, beta, c0, c1, c4


def modal_response(
    order: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    bending_stiffness: npt.ArrayLike,
    radial_stiffness: npt.ArrayLike,
) -> FloatArray:
    """Radial displacement of harmonic n per unit of inward pressure of harmonic n.

    -1 / [EI/R^4 (n^2 - 1)^2 + k_u] for n >= 1; 0 for n = 0, because the ring does not stretch.

    Parameters
    ----------
    order : array of int
        n >= 0.
    ring_radius, bending_stiffness, radial_stiffness : array, [m], [N m2], [N/m2]
        R, EI and k_u, > 0. All four arguments broadcast against each other.

    Returns
    -------
    array, [m / (N/m)]

    Raises
    ------
    ParameterError
        If a parameter is not positive and finite, or an order is not a whole number >= 0.
    """
    where = "modal response of the ring"
    R, EI, k_u = positive(
        where,
        ring_radius=ring_radius,
        bending_stiffness=bending_stiffness,
        radial_stiffness=radial_stiffness,
    )
    n = whole_orders(where, order)
    return np.where(n == 0.0, 0.0, -1.0 / (EI / R**4 * (n**2 - 1.0) ** 2 + k_u))


def point_response_series(
    angle: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    bending_stiffness: npt.ArrayLike,
    radial_stiffness: npt.ArrayLike,
    terms: int | None = None,
) -> FloatArray:
    r"""Compute what `point_response` computes, as a Fourier series.

    .. math:: u = -\frac{1}{\pi R} \sum_{n=1}^{N}
              \frac{\cos n\varphi}{EI (n^2 - 1)^2 / R^4 + k_u}

    Independent of the closed form; for checks. The terms fall with n^-4 beyond n = beta: what is
    left out is below R^3 / (3 pi EI N^3), that is (beta / N)^3 of the peak.

    Parameters
    ----------
    angle, ring_radius, bending_stiffness, radial_stiffness : array
        As in `point_response`.
    terms : int, optional
        Number N of harmonics, >= 1; 2000 beta of the stiffest foundation if not given.

    Returns
    -------
    array, [m/N]

    Raises
    ------
    ParameterError
        As in `point_response`, or if `terms` < 1.
    """
    where = "series response of the ring"
    phi = wrapped(where, angle)[..., None]
    R, EI, k_u = positive(
        where,
        ring_radius=ring_radius,
        bending_stiffness=bending_stiffness,
        radial_stiffness=radial_stiffness,
    )
    if terms is None:
        terms = int(np.ceil(2000.0 * np.max(scaled_constants(R, EI, k_u)[1])))
    if terms < 1:
        raise ParameterError(f"{where}: terms = {terms}; must be 1 or more")
    shape = np.broadcast_shapes(phi.shape[:-1], R.shape, EI.shape, k_u.shape)
    total = np.zeros(shape)
    for last in range(terms, 0, -_BLOCK):  # small terms first
        n = np.arange(max(last - _BLOCK, 0) + 1, last + 1)
        weight = modal_response(
            n,
            ring_radius=R[..., None],
            bending_stiffness=EI[..., None],
            radial_stiffness=k_u[..., None],
        )
        total += np.sum(weight * np.cos(n * phi), axis=-1)
    return total / (np.pi * R)


def pressed_shape(
    angle: npt.ArrayLike,
    pressure_angle: npt.ArrayLike,
    pressure: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    bending_stiffness: npt.ArrayLike,
    radial_stiffness: npt.ArrayLike,
    derivative: int = 0,
) -> FloatArray:
    """Deformation of the ring under a given pressure, Eq. (47), by the trapezoidal rule.

    Parameters
    ----------
    angle : array, shape (..., m), [rad]
        Where the deformation is wanted.
    pressure_angle, pressure : array, shape (..., n), [rad], [N/m]
        Nodes in increasing order, any spacing, and the inward pressure there; zero outside.
    ring_radius, bending_stiffness, radial_stiffness : array, shape (...), [m], [N m2], [N/m2]
        R, EI and k_u of each operating point.
    derivative : int
        Order of the derivative by phi, below 4.

    Returns
    -------
    array, shape (..., m), [m]

    Raises
    ------
    ParameterError
        If a parameter is not positive, a value not finite, or the nodes do not increase.
    ShapeError
        If nodes and pressures differ in number, or there are fewer than two.
    """
    where = "deformation under a given pressure"
    phi, at, q = (np.asarray(x, dtype=np.float64) for x in (angle, pressure_angle, pressure))
    if at.shape[-1:] != q.shape[-1:] or at.ndim == 0 or at.shape[-1] < 2:
        raise ShapeError(
            f"{where}: pressure_angle has shape {at.shape} but pressure has {q.shape}; "
            "both need the same number of nodes, two or more, as last dimension"
        )
    step = np.diff(at, axis=-1)
    if not (np.isfinite(q).all() and np.isfinite(at).all() and np.all(step > 0.0)):
        raise ParameterError(f"{where}: nodes must be finite and increase, pressures be finite")
    weight = np.zeros_like(at)
    weight[..., :-1] += 0.5 * step
    weight[..., 1:] += 0.5 * step
    R, EI, k_u = (
        np.asarray(x, dtype=np.float64)[..., None, None]
        for x in (ring_radius, bending_stiffness, radial_stiffness)
    )
    response = point_response(
        phi[..., :, None] - at[..., None, :],
        ring_radius=R,
        bending_stiffness=EI,
        radial_stiffness=k_u,
        derivative=derivative,
    )
    u: FloatArray = R[..., 0] * np.sum(response * (weight * q)[..., None, :], axis=-1)
    return u


def positive(where: str, **values: npt.ArrayLike) -> tuple[FloatArray, ...]:
    """Return the values as arrays; raise ParameterError unless all are finite and > 0."""
    arrays = []
    for name, value in values.items():
        array = np.asarray(value, dtype=np.float64)
        bad = ~(np.isfinite(array) & (array > 0.0))
        if bad.any():
            raise ParameterError(
                f"{where}: {name} = {array[bad].flat[0]:g}; must be finite and > 0; "
                "give it in SI units"
            )
        arrays.append(array)
    return tuple(arrays)


def whole_orders(where: str, order: npt.ArrayLike) -> FloatArray:
    """Return mode orders as floats; raise ParameterError unless all are whole and >= 0."""
    n = np.asarray(order, dtype=np.float64)
    bad = ~(np.isfinite(n) & (n >= 0.0) & (n == np.round(n)))
    if bad.any():
        raise ParameterError(f"{where}: order = {n[bad].flat[0]:g}; must be 0, 1, 2, ...")
    return n


def wrapped(where: str, angle: npt.ArrayLike) -> FloatArray:
    """Return angles moved by whole turns into [-pi, pi]."""
    phi = np.asarray(angle, dtype=np.float64)
    if not np.isfinite(phi).all():
        raise ParameterError(f"{where}: an angle is not finite; remove unknown samples first")
    turns: FloatArray = phi - 2.0 * np.pi * np.round(phi / (2.0 * np.pi))
    return turns
