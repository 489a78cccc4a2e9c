"""Contact of the standing ring with a flat road through radial tread springs, Eq. (37), (47)-(52).

The ring of `tirelib.physics.ring.green` carries radial tread springs k_t that can push but not
pull:

    q(phi) = k_t max(0, u - u_r),    u(phi) = int q(phi') G(phi - phi') R dphi'.

On N nodes this is a linear complementarity problem with a positive definite matrix, so it has one
solution. A semi-smooth Newton method (active set) finds it in a finite number of steps; the
contact angle is a result, never a guess. Eq. (49) is used with u - u_r taken at the node of the
pressure, and Eq. (51) on the contact nodes only.

Signs: phi = 0 at the road, pressure inward positive, u outward positive. Contact is symmetric.

Validity: frictionless, static, linear ring (no pretension, no tangential springs); deflection up to
a quarter of the free radius; tread compressed by less than its thickness (52).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact.static_solve import active_set, edge, flexibility
from tirelib.physics.ring.green import positive, pressed_shape, wrapped

LARGEST_DEFLECTION = 0.25
"""Largest deflection as a share of the free radius; beyond it the linear ring is not valid."""
_CHUNK = 32
_MARCH = 10
_NEAR_MOST = 21
_OUTSIDE = 128
_PASSES = 30
_LOAD_TOLERANCE = 1e-11
_LOAD_ITERATIONS = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticTire:
    """Ring, foundation and tread; every field may be an array over operating points.

    Attributes
    ----------
    ring_radius, free_radius : array, [m]
        R of the neutral line and R0 of the tread's surface, R < R0.
    bending_stiffness : array, [N m2]
        EI.
    radial_stiffness : array, [N/m2]
        k_u per length, or A of Eq. (54).
    tread_stiffness : array, [N/m2]
        k_t per length.
    softening : array, [1/m]
        B of Eq. (54), k_u = A exp(B d0) with the deflection d0; B <= 0.
    exact_gap : bool
        Road as in the exact geometry instead of Eq. (37).
    """

    ring_radius: npt.ArrayLike
    free_radius: npt.ArrayLike
    bending_stiffness: npt.ArrayLike
    radial_stiffness: npt.ArrayLike
    tread_stiffness: npt.ArrayLike
    softening: npt.ArrayLike = 0.0
    exact_gap: bool = False

    def __post_init__(self) -> None:
        inner, outer, *_ = positive(
            "static tire",
            ring_radius=self.ring_radius,
            free_radius=self.free_radius,
            bending_stiffness=self.bending_stiffness,
            radial_stiffness=self.radial_stiffness,
            tread_stiffness=self.tread_stiffness,
        )
        if np.any(inner >= outer):
            raise ParameterError(
                f"static tire: ring_radius = {inner.max():g} m is not below free_radius = "
                f"{outer.min():g} m; the tread lies outside the ring"
            )
        softening = np.asarray(self.softening, dtype=np.float64)
        if not (np.isfinite(softening) & (softening <= 0.0)).all():
            raise ParameterError(
                f"static tire: softening = {softening.max():g} 1/m; must be finite and <= 0, "
                "because the sidewall softens with deflection: k_u = A exp(B d0)"
            )


@dataclass(frozen=True, slots=True)
class StaticContact:
    """Solved contact; the leading dimensions are those of the operating points.

    Attributes
    ----------
    deflection, load : array, [m], [N]
        d0 and the vertical load, int q cos(phi) R dphi.
    angle, pressure, deformation : array, shape (..., nodes), [rad], [N/m], [m]
        Nodes, q and u there. The nodes reach somewhat beyond the contact.
    half_angle : array, [rad]
        Outer edge of the contact, where u = u_r, found between the nodes.
    centre_pressure, peak_pressure : array, [N/m]
        q at phi = 0 and its largest nodal value.
    radial_stiffness : array, [N/m2]
        k_u in use, after Eq. (54).
    iterations : array of int
        Newton steps of the last solution.
    residual : array
        largest abs(q - k_t max(0, u - u_r)) over the largest pressure.
    """

    deflection: FloatArray
    load: FloatArray
    angle: FloatArray
    pressure: FloatArray
    deformation: FloatArray
    half_angle: FloatArray
    centre_pressure: FloatArray
    peak_pressure: FloatArray
    radial_stiffness: FloatArray
    iterations: npt.NDArray[np.int64]
    residual: FloatArray


def road_gap(
    angle: npt.ArrayLike,
    deflection: npt.ArrayLike,
    free_radius: npt.ArrayLike,
    *,
    exact: bool = False,
) -> FloatArray:
    """Radial displacement u_r that would bring the tread's free surface onto the road.

    -d0 + R0 (1 - cos phi), Eq. (37); negative where the road is inside the undeformed tire.
    Exactly, along the radius: (R0 - d0) / cos phi - R0; both agree to first order in d0.

    Parameters
    ----------
    angle : array, [rad]
        From the road's normal through the axle; for the exact form abs(phi) < pi/2.
    deflection, free_radius : array, [m]
        d0 and R0. All broadcast.
    exact : bool
        Use the exact form.

    Returns
    -------
    array, [m]

    Raises
    ------
    ParameterError
        If a value is not finite, or the exact form is asked for where the road is never met.
    """
    phi = wrapped("road gap", angle)
    (d0, R0) = (np.asarray(x, dtype=np.float64) for x in (deflection, free_radius))
    if not (np.isfinite(d0).all() and np.isfinite(R0).all()):
        raise ParameterError("road gap: deflection or free_radius is not finite")
    if not exact:
        return -d0 + R0 * (1.0 - np.cos(phi))
    if np.any(np.abs(phi) >= 0.5 * np.pi):
        raise ParameterError(
            f"road gap: |angle| = {np.abs(phi).max():g} rad; the radius meets the road only below "
            "pi/2; use the form of Eq. (37) or a shorter arc"
        )
    return (R0 - d0) / np.cos(phi) - R0


def press_to_deflection(
    tire: StaticTire,
    deflection: npt.ArrayLike,
    *,
    nodes: int = 361,
    max_iterations: int = 60,
) -> StaticContact:
    """Press the tire onto the road by a given deflection.

    Parameters
    ----------
    tire : StaticTire
        Its fields broadcast against the deflection.
    deflection : array, [m]
        d0 = free radius - loaded radius; 0 < d0 <= a quarter of the free radius.
    nodes : int
        Odd number of nodes, 41 or more. The error falls with its square.
    max_iterations : int
        Newton steps allowed.

    Returns
    -------
    StaticContact

    Raises
    ------
    ParameterError
        If the deflection is out of range, the tread is pressed through, or the contact would reach
        the side of the wheel.
    ConvergenceError
        If the active set still changes; `iterate` is the pressure, `residual` its error.
    """
    solved = _press(tire, deflection, nodes, max_iterations)
    _check_tread(tire, solved)
    return solved


def press_to_load(
    tire: StaticTire,
    load: npt.ArrayLike,
    *,
    nodes: int = 361,
    max_iterations: int = 60,
) -> StaticContact:
    """Press the tire onto the road by a given vertical load.

    The deflection is marched up until the load is reached, then found by the Illinois method. With
    a strong softening the load has a maximum; the deflection before it is returned.

    Parameters
    ----------
    tire : StaticTire
        Its fields broadcast against the load.
    load : array, [N]
        Vertical load, > 0.
    nodes, max_iterations : int
        As in `press_to_deflection`.

    Returns
    -------
    StaticContact
        Its load equals the one asked for to 1e-11.

    Raises
    ------
    ParameterError
        If the load is not positive or more than the tire carries in the range of the model;
        and as in `press_to_deflection`.
    ConvergenceError
        As in `press_to_deflection`; or if the deflection is not found, which is then `iterate`.
    """
    (wanted,) = positive("static contact", load=load)
    like = (tire.ring_radius, tire.bending_stiffness, tire.radial_stiffness, tire.tread_stiffness)
    values = (np.asarray(x, dtype=np.float64) for x in (*like, tire.softening, tire.free_radius))
    wanted, *_, outer = np.broadcast_arrays(wanted, *values)

    def excess(d0: FloatArray) -> FloatArray:
        return _press(tire, d0, nodes, max_iterations).load - wanted

    low, high, below, above = np.zeros(wanted.shape), np.zeros(wanted.shape), -wanted, -wanted
    most, met_at = np.zeros(wanted.shape), np.zeros(wanted.shape)
    for step in range(1, _MARCH + 1):
        going = above < 0.0
        if not going.any():
            break
        low, below = np.where(going, high, low), np.where(going, above, below)
        high = np.where(going, step / _MARCH * LARGEST_DEFLECTION * outer, high)
        above = excess(high)
        larger = going & (above + wanted > most)
        most, met_at = np.where(larger, above + wanted, most), np.where(larger, high, met_at)
    for share in np.linspace(-1.0, 1.0, _NEAR_MOST):  # softening: the largest load lies between
        going = above < 0.0
        if not going.any():
            break
        near = met_at + share / _MARCH * LARGEST_DEFLECTION * outer
        near = np.clip(np.where(going, near, high), 1e-6, LARGEST_DEFLECTION * outer)
        carried = np.where(going, excess(near), above)
        low, below = np.where(going, 0.0, low), np.where(going, -wanted, below)
        high, above = np.where(going, near, high), carried
        most = np.where(going, np.maximum(most, carried + wanted), most)
    if np.any(above < 0.0):
        worst = int(np.argmax(above < 0.0))
        raise ParameterError(
            f"static contact: point {worst}: load = {wanted.flat[worst]:g} N; this tire carries 0 "
            f"to {most.flat[worst]:.4g} N up to a deflection of "
            f"{LARGEST_DEFLECTION * outer.flat[worst]:.3g} m; lower the load or raise the "
            "stiffness",
            point=worst,
        )
    for _ in range(_LOAD_ITERATIONS):
        middle = high - above * (high - low) / (above - below)
        error = excess(middle)
        if np.all(np.abs(error) <= _LOAD_TOLERANCE * wanted):
            solved = _press(tire, middle, nodes, max_iterations)
            _check_tread(tire, solved)
            return solved
        same = (error > 0.0) == (above > 0.0)  # keep the bracket; halve the end that stays
        low, below = np.where(same, low, high), np.where(same, 0.5 * below, above)
        high, above = middle, error
    raise ConvergenceError(
        f"static contact: load missed by {np.abs(error / wanted).max():.1e} of its value after "
        f"{_LOAD_ITERATIONS} steps; allowed is {_LOAD_TOLERANCE:.0e}; use more nodes",
        middle,
        float(np.abs(error / wanted).max()),
    )


def _press(
    tire: StaticTire, deflection: npt.ArrayLike, nodes: int, max_iterations: int
) -> StaticContact:
    """Solve all points without a look at the tread's thickness."""
    names = ("ring_radius", "free_radius", "bending_stiffness", "radial_stiffness")
    fields = [getattr(tire, name) for name in (*names, "tread_stiffness", "softening")]
    (d0,) = positive("static contact", deflection=deflection)
    many = np.broadcast_arrays(d0, *(np.asarray(x, dtype=np.float64) for x in fields))
    shape, flat = many[0].shape, [x.reshape(-1) for x in many]
    if nodes < 41 or nodes % 2 == 0:
        raise ParameterError(f"static contact: nodes = {nodes}; must be odd and 41 or more")
    if np.any(flat[0] > LARGEST_DEFLECTION * flat[2]):
        raise ParameterError(
            f"static contact: deflection = {flat[0].max():g} m; must be below "
            f"{LARGEST_DEFLECTION * flat[2].min():g} m, a quarter of the free radius: beyond it "
            "the linear ring does not hold"
        )
    parts = [
        _contact([x[i : i + _CHUNK] for x in flat], tire.exact_gap, nodes // 2, max_iterations)
        for i in range(0, flat[0].size, _CHUNK)
    ]
    joined = [np.concatenate(columns) for columns in zip(*parts, strict=True)]
    return StaticContact(*(x.reshape(shape + x.shape[1:]) for x in joined))


def _check_tread(tire: StaticTire, solved: StaticContact) -> None:
    """Raise ParameterError where the tread has no thickness left (52)."""
    thickness = np.asarray(tire.free_radius) - np.asarray(tire.ring_radius)
    compression = solved.peak_pressure / np.asarray(tire.tread_stiffness)
    compression, thickness = np.broadcast_arrays(compression, thickness)
    if np.any(compression >= thickness):
        point = int(np.argmax(compression - thickness))
        raise ParameterError(
            f"static contact: point {point} at {solved.load.flat[point]:.4g} N: tread pressed by "
            f"{compression.flat[point]:.3g} m; must stay below its thickness "
            f"{thickness.flat[point]:.3g} m (52); raise tread_stiffness or lower the load",
            point=point,
        )


def _contact(
    flat: list[FloatArray], exact: bool, half: int, max_iterations: int
) -> tuple[npt.NDArray[np.generic], ...]:
    """Solve some points, shape (p,) each; fit the arc of nodes to the contact."""
    d0, R, R0, EI, stiffness, k_t, softening = flat
    k_u = stiffness * np.exp(softening * d0)  # (54)
    ring = (R, EI, k_u)
    arc = 1.1 * np.arccos(1.0 - d0 / R0)
    limit = 0.5 * np.pi * (1.0 - 1e-6)
    outside = np.linspace(0.0, limit, _OUTSIDE)
    for _ in range(_PASSES):
        phi = arc[:, None] * np.linspace(0.0, 1.0, half + 1)
        u_r = road_gap(phi, d0[:, None], R0[:, None], exact=exact)
        matrix = flexibility(arc, half, ring)
        q, u, steps, residual = active_set(matrix, u_r, k_t, max_iterations)
        whole = np.concatenate((-phi[:, :0:-1], phi), axis=1)
        mirror = np.concatenate((q[:, :0:-1], q), axis=1)
        far = pressed_shape(
            outside, whole, mirror, ring_radius=R, bending_stiffness=EI, radial_stiffness=k_u
        )
        far -= road_gap(outside, d0[:, None], R0[:, None], exact=exact)
        last = half - np.argmax(q[:, ::-1] > 0.0, axis=1)
        touches = (last > half - 2) | ((far > 0.0) & (outside > arc[:, None])).any(axis=1)
        short = ~touches & (3 * last < half)
        if not (touches | short).any():
            break
        arc = np.where(touches, np.minimum(1.5 * arc, limit), arc)
        arc = np.where(short, 1.5 * arc * (last + 3) / half, arc)
    else:
        raise ParameterError(
            f"static contact: no arc of nodes holds the contact at a deflection of {d0.max():g} m: "
            "it reaches the side of the wheel or is too short; change stiffness or raise nodes"
        )
    shape = np.concatenate((u[:, :0:-1], u), axis=1)
    load = R * arc / half * np.sum(mirror * np.cos(whole), axis=1)
    half_angle = arc / half * edge(u - u_r, last)
    return d0, load, whole, mirror, shape, half_angle, q[:, 0], q.max(axis=1), k_u, steps, residual
