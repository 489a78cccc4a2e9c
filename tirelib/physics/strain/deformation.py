"""From measured strain back to the radial deformation of the belt in the contact, Eq. (35)-(40).

Eq. (35), u + u'' = -R^2 eps / y, is an ordinary differential equation for u. Its free solutions are
cos phi and sin phi, the rigid shift of the belt: it causes no strain, and the mean of u goes with
the gages' offset. In the contact the belt meets the road at both edges (38), which replaces what
the strain does not determine; finite differences of second order do the rest. A whole turn has no
such help: `tirelib.physics.strain.full_turn`.

The right side of Eq. (39) is -eps_i - a u_1 (from (36)); the print lacks the minus sign.

Signs: phi = 0 at the road, leading edge < 0 < trailing edge, u outward, strain positive in tension,
liner_offset y < 0 (a table that lists "y = 2 mm" means -2 mm here).

Validity: that of Eq. (35): small rotations, no stretch; strain offset removed over a full turn.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_banded

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.contact.static import LARGEST_DEFLECTION, road_gap

SMALLEST_EIGENVALUE = 0.05
"""Smallest eigenvalue of u + u'' on the arc; an error of the strain grows by its inverse."""
LARGEST_STRAIN = 0.1
"""Largest strain of an innerliner; more is microstrain or percent taken for strain."""


@dataclass(frozen=True, slots=True)
class ContactDeformation:
    """Radial deformation in the contact.

    Attributes
    ----------
    angle, deformation : array, shape (..., n), [rad], [m]
        Nodes from leading to trailing edge, and u there.
    condition : array, shape (...)
        Condition number of the matrix of Eq. (39).
    """

    angle: FloatArray
    deformation: FloatArray
    condition: FloatArray


def arc_nodes(leading: npt.ArrayLike, trailing: npt.ArrayLike, count: int) -> FloatArray:
    """Return uniform nodes from edge to edge, shape (..., count), [rad]."""
    start, end = (np.asarray(x, dtype=np.float64)[..., None] for x in (leading, trailing))
    if count < 5:
        raise ParameterError(f"contact nodes: count = {count}; must be 5 or more")
    if not (np.isfinite(start).all() and np.isfinite(end).all() and np.all(start < end)):
        raise ParameterError(
            "contact nodes: leading must be finite and below trailing; drop turns without contact"
        )
    return start + (end - start) * np.linspace(0.0, 1.0, count)


def symmetric_series(
    angle: npt.ArrayLike, strain: npt.ArrayLike, centre: npt.ArrayLike, terms: int
) -> FloatArray:
    """Fourier-cosine series of strain about a centre: its even part, without mean.

    The static ring can only explain a symmetric trace, so the dissertation replaces the measured
    strain by a cosine series (section 5.1.2). The mean over the turn is left out: it is the gages'
    offset, and a belt of constant length has none.

    Parameters
    ----------
    angle : array, shape (n,), [rad]
        Uniform grid over one turn, increasing, end not repeated.
    strain : array, shape (..., n)
        Traces.
    centre : array, shape (...), [rad]
        Angle about which each trace is made even, such as the middle of its contact.
    terms : int
        Highest order kept, 2 to below n / 2.

    Returns
    -------
    array, shape (..., terms)
        Coefficients of cos m (phi - centre), m = 1 .. terms.

    Raises
    ------
    ShapeError
        If the grid is not one uniform turn of the traces' length.
    ParameterError
        If a sample is not finite or `terms` is out of range.
    """
    phi, trace = (np.asarray(x, dtype=np.float64) for x in (angle, strain))
    n = phi.size
    if phi.ndim != 1 or trace.shape[-1:] != phi.shape or n < 8:
        raise ShapeError(
            f"symmetric series: angle has shape {phi.shape}, strain {trace.shape}; one uniform "
            "turn of 8 samples or more is needed as last dimension"
        )
    if not np.allclose(np.diff(phi), 2.0 * np.pi / n, rtol=1e-6, atol=0.0):
        raise ShapeError(f"symmetric series: angle must advance by one turn / {n}; resample first")
    if not np.isfinite(trace).all():
        raise ParameterError("symmetric series: a sample is not finite; fill or drop the turn")
    if not 2 <= terms < n / 2:
        raise ParameterError(f"symmetric series: terms = {terms}; must be 2 to below {n / 2:g}")
    order = np.arange(1, terms + 1)
    # sum of eps exp(-i m phi), turned to the centre
    spectrum = np.fft.rfft(trace)[..., 1 : terms + 1] * 2.0 / n
    turn = order * (np.asarray(centre, dtype=np.float64)[..., None] - phi[0])
    return np.real(spectrum * np.exp(1j * turn))


def series_strain(coefficients: npt.ArrayLike, angle: npt.ArrayLike) -> FloatArray:
    """Return the even trace of `symmetric_series` at angles (..., m) from its centre, [rad]."""
    a, phi = (np.asarray(x, dtype=np.float64) for x in (coefficients, angle))
    order = np.arange(1, a.shape[-1] + 1)
    value: FloatArray = np.sum(a[..., None, :] * np.cos(phi[..., None] * order), axis=-1)
    return value


def contact_deformation(
    strain: npt.ArrayLike,
    leading: npt.ArrayLike,
    trailing: npt.ArrayLike,
    *,
    deflection: npt.ArrayLike,
    ring_radius: float,
    free_radius: float,
    liner_offset: float,
    exact_gap: bool = False,
) -> ContactDeformation:
    """Radial deformation in the contact from the strain there, Eq. (36)-(40).

    All traces are solved in one banded system; each has its own edges and deflection.

    Parameters
    ----------
    strain : array, shape (..., n)
        Strain at the nodes of `arc_nodes(leading, trailing, n)`, without offset. The values at
        the edges themselves have no effect.
    leading, trailing : array, shape (...), [rad]
        Contact edges, where the tread carries nothing: u = u_r (38).
    deflection : array, shape (...), [m]
        d0 = free radius - loaded radius.
    ring_radius, free_radius : float, [m]
        R and R0.
    liner_offset : float, [m]
        y of the gages from the neutral line, < 0.
    exact_gap : bool
        Take u_r from the exact geometry instead of Eq. (37).

    Returns
    -------
    ContactDeformation

    Raises
    ------
    ParameterError
        If a value is out of range or not finite, or the arc is close to k pi, where a shift of the
        belt meets both edge conditions and the problem is singular; the message has the condition
        number.
    ShapeError
        If edges and deflections do not fit the traces.

    Examples
    --------
    A belt flat on the road is found back from its constant strain:

    >>> strain = np.full(41, 0.002 / 0.3**2 * (0.3125 - 0.02))
    >>> found = contact_deformation(strain, -0.2, 0.2, deflection=0.02, ring_radius=0.3,
    ...                             free_radius=0.3125, liner_offset=-0.002)
    >>> round(float(found.deformation[20]), 5)
    -0.02
    """
    eps = np.asarray(strain, dtype=np.float64)
    check_belt(ring_radius, free_radius, liner_offset)
    if eps.ndim == 0 or eps.shape[-1] < 5:
        raise ShapeError(
            f"contact deformation: strain has shape {eps.shape}; 5 nodes or more are needed as "
            "last dimension"
        )
    if not np.isfinite(eps[..., 1:-1]).all():
        raise ParameterError("contact deformation: a strain is not finite; drop that turn")
    n, lead = eps.shape[-1], eps.shape[:-1]
    try:
        edges = [np.broadcast_to(np.asarray(x, float), lead) for x in (leading, trailing)]
        d0 = np.broadcast_to(np.asarray(deflection, dtype=np.float64), lead)
    except ValueError as error:
        raise ShapeError(
            f"contact deformation: edges or deflection do not fit traces of shape {eps.shape}; "
            f"give one number or shape {lead}"
        ) from error
    _check_sizes(eps, d0, free_radius)
    angle = arc_nodes(edges[0], edges[1], n)
    condition = arc_condition(edges[1] - edges[0], n)
    borders = road_gap(angle[..., [0, -1]], d0[..., None], free_radius, exact=exact_gap)
    h2 = np.asarray(((edges[1] - edges[0]) / (n - 1)) ** 2)[..., None]
    # (36) times (R dphi)^2 / y
    right = -h2 * ring_radius**2 / liner_offset * eps[..., 1:-1]
    right[..., 0] -= borders[..., 0]
    right[..., -1] -= borders[..., 1]
    inner = _tridiagonal(np.broadcast_to(h2 - 2.0, right.shape), right)
    u = np.concatenate((borders[..., :1], inner, borders[..., 1:]), axis=-1)
    return ContactDeformation(angle, u, condition)


def arc_condition(length: npt.ArrayLike, nodes: int) -> FloatArray:
    """Condition number of the matrix of Eq. (39) on arcs of given length.

    Its eigenvalues are 1 - (2/dphi)^2 sin^2(k pi dphi / 2 L), k = 1 .. n - 2, close to
    1 - (k pi / L)^2: one of them vanishes where L = k pi.

    Parameters
    ----------
    length : array, shape (...), [rad]
        Arc from edge to edge, > 0.
    nodes : int
        Nodes on it, edges included.

    Returns
    -------
    array, shape (...)

    Raises
    ------
    ParameterError
        If the smallest eigenvalue is below `SMALLEST_EIGENVALUE`.
    """
    arc = np.asarray(length, dtype=np.float64)
    k = np.arange(1, nodes - 1)
    sine = np.sin(0.5 * np.pi * k / (nodes - 1))
    eigenvalues = np.abs(1.0 - (2.0 * (nodes - 1) / arc[..., None] * sine) ** 2)
    smallest = np.maximum(eigenvalues.min(axis=-1), np.finfo(float).eps)
    condition: FloatArray = eigenvalues.max(axis=-1) / smallest
    if np.any(smallest < SMALLEST_EIGENVALUE):
        worst = np.argmin(smallest)
        raise ParameterError(
            f"contact deformation: on an arc of {arc.flat[worst]:.6g} rad the condition number is "
            f"{condition.flat[worst]:.2e} and errors of the strain grow "
            f"{1.0 / smallest.flat[worst]:.1e} fold; an arc near k pi leaves the "
            "shift of the belt open; use edges well within half a turn"
        )
    return condition


def recomputed_strain(
    angle: npt.ArrayLike, deformation: npt.ArrayLike, *, ring_radius: float, liner_offset: float
) -> FloatArray:
    """Strain at the inner nodes from the deformation by the central difference of Eq. (36).

    Parameters
    ----------
    angle, deformation : array, shape (..., n), [rad], [m]
        Uniform nodes and u.
    ring_radius, liner_offset : float, [m]
        R > 0 and y < 0.

    Returns
    -------
    array, shape (..., n - 2)
        The input of `contact_deformation`, to rounding, if u came from there.

    Raises
    ------
    ParameterError
        If R or y is out of range.
    """
    check_belt(ring_radius, np.inf, liner_offset)
    phi, u = (np.asarray(x, dtype=np.float64) for x in (angle, deformation))
    step = (phi[..., -1:] - phi[..., :1]) / (phi.shape[-1] - 1)
    second = (u[..., 2:] - 2.0 * u[..., 1:-1] + u[..., :-2]) / step**2
    strain: FloatArray = -liner_offset / ring_radius**2 * (u[..., 1:-1] + second)
    return strain


def _tridiagonal(diagonal: FloatArray, right: FloatArray) -> FloatArray:
    """Solve x_(i-1) + d_i x_i + x_(i+1) = r_i along the last axis, all traces in one system."""
    n = right.shape[-1]
    bands = np.ones((3, right.size))
    bands[0, ::n] = 0.0  # nothing above the first unknown of a trace,
    bands[2, n - 1 :: n] = 0.0  # nothing below the last one
    bands[1] = diagonal.reshape(-1)
    solved: FloatArray = solve_banded((1, 1), bands, right.reshape(-1))
    return solved.reshape(right.shape)


def _check_sizes(strain: FloatArray, deflection: FloatArray, free_radius: float) -> None:
    """Raise ParameterError where a deflection or a strain has another unit or sign."""
    good = (deflection > 0.0) & (deflection <= LARGEST_DEFLECTION * free_radius)
    if not good.all():
        worst = deflection[~good].flat[0]
        raise ParameterError(
            f"contact deformation: trace {int(np.argmin(good))} has deflection = {worst:g} m; "
            f"above 0 and up to {LARGEST_DEFLECTION * free_radius:g} m, a quarter of the free "
            "radius, is needed; it is free minus loaded radius, in metres"
        )
    inner = np.abs(strain[..., 1:-1])
    if inner.size and inner.max() > LARGEST_STRAIN:
        trace = int(np.argmax(inner.max(axis=-1)))
        raise ParameterError(
            f"contact deformation: trace {trace} has a strain of {inner.max():g}; up to "
            f"{LARGEST_STRAIN} in size is allowed; give it as a fraction, not in percent or "
            "microstrain"
        )


def check_belt(ring_radius: float, free_radius: float, liner_offset: float) -> None:
    """Raise ParameterError unless 0 < -y < R < R0, all in [m]."""
    if not 0.0 < ring_radius < free_radius:
        raise ParameterError(
            f"belt: ring_radius = {ring_radius:g} m, free_radius = {free_radius:g} m; "
            "0 < ring_radius < free_radius is needed"
        )
    if not -ring_radius < liner_offset < 0.0:
        raise ParameterError(
            f"belt: liner_offset = {liner_offset:g} m; must lie between {-ring_radius:g} m and 0: "
            "the innerliner is inside the neutral line; enter its distance as a negative number"
        )
