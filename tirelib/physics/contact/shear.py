"""Contact of the rolling ring through tread elements that are pressed and sheared.

Eq. (79)-(81), (98)-(106), corrected. Flattening draws the tread's tips together, the road takes
them along at one speed: this shears the tread, and its forces bend and turn the belt. `shear_law`
has the elements, `shear_system` the equations, `shear_newton` their solution; all unknowns at
once, instead of the dissertation's linear solution with Picard iterations behind it.

Free rolling is the dissertation's by default: the tip stands R_e phi behind the axle, so h = h_0
and gamma h = 0 at the leading edge define R_l and R_e, (103), (104). With damping or sliding some
torque is left then; `torque=0.0` asks for rolling without it, `torque=T` for a driven or braked
wheel. The place of the tips is then R_e phi + x_0.

Known limits: h is that of a tip that moves with the road, Eq. (79), also where it slides, as in the
dissertation; friction acts along the belt (f_t, f_n), not along the road; an element that slid
sticks again where its limit allows the tip that never slid; outside the patch nothing is sheared.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact import radial
from tirelib.physics.contact.checks import (
    ComplianceAt,
    check_angle,
    check_one_patch,
    check_radii,
    check_tread,
    column,
)
from tirelib.physics.contact.fourier import evaluate_fields, load_harmonics
from tirelib.physics.contact.free_boundary import N_NODES, Constant
from tirelib.physics.contact.radial import RadialContact
from tirelib.physics.contact.shear_law import Shear
from tirelib.physics.contact.shear_newton import COARSE_NODES, TOLERANCE, Newton, solve
from tirelib.physics.contact.shear_result import ShearContact
from tirelib.physics.contact.shear_system import (
    LEAD,
    OFFSET,
    ROLL,
    TRAIL,
    Patch,
    ShearProblem,
)
from tirelib.physics.contact.tread import Tread, numbers
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray

__all__ = ["Shear", "ShearContact", "belt_traction", "fit_edges", "friction_loads", "load", "press"]


def press(
    compliance: Compliance | ComplianceAt,
    tread: Tread,
    shear: Shear,
    deflection: float | FloatArray,
    *,
    torque: float | FloatArray | None = None,
    extra: ComplexArray | None = None,
    n_nodes: int = N_NODES,
) -> ShearContact:
    """Return the contact at given deflections d0.

    Parameters
    ----------
    compliance : Compliance or callable
        Compliance of the ring, or a function of the deflections (n_points,), [m], that returns it.
    tread : Tread
        h_0 is its free radius minus the ring's radius.
    shear : Shear
    deflection : float or shape (n_points,), [m]
    torque : float or shape (n_points,), optional, [N m]
        Torque of the road about the axle, along +phi; 0 rolls freely, it is positive on a braked
        wheel. Without it free rolling is that of Eq. (103), x_0 = 0.
    extra : shape (n_points, n_modes + 1, 3), optional
        Harmonics of line loads (q_u, q_v, q_beta) on the belt besides the tread's, [N/m], [N].
    n_nodes : int
        Gauss nodes in the patch, even.

    Raises
    ------
    ParameterError
        If a number is not allowed, shapes do not match, or the ring's validity is left.
    ConvergenceError
        If Newton's method does not settle or the patch splits; carries the last contact.
    """
    n_points = _count(compliance, tread, shear, deflection)
    d0 = column(_WHERE, deflection, n_points, "deflection", "m", positive=True)
    first = _radial(lambda: radial.press(compliance, tread, d0, extra=extra, n_nodes=COARSE_NODES))
    return _solve(compliance, tread, shear, (d0, None, None), first, torque, extra, n_nodes)


def load(
    compliance: Compliance | ComplianceAt,
    tread: Tread,
    shear: Shear,
    vertical_load: float | FloatArray,
    *,
    torque: float | FloatArray | None = None,
    extra: ComplexArray | None = None,
    n_nodes: int = N_NODES,
) -> ShearContact:
    """Return the contact at given vertical loads Fz, [N]; else as `press`."""
    n_points = _count(compliance, tread, shear, vertical_load)
    target = column(_WHERE, vertical_load, n_points, "vertical load", "N", positive=True)
    first = _radial(
        lambda: radial.load(compliance, tread, target, extra=extra, n_nodes=COARSE_NODES)
    )
    return _solve(compliance, tread, shear, (None, target, None), first, torque, extra, n_nodes)


def fit_edges(
    compliance: Compliance,
    tread: Tread,
    shear: Shear,
    edges: FloatArray,
    *,
    torque: float | FloatArray | None = None,
    extra: ComplexArray | None = None,
    n_nodes: int = N_NODES,
) -> ShearContact:
    """Return the contact whose edges are known, for identification (Fig. 6-17).

    gamma h = 0 at the leading edge; R_l is such that what is left of the compression at the two
    edges is equal and opposite. `edge_mismatch` holds it: not zero when these angles cannot belong
    to this ring.

    Parameters
    ----------
    edges : shape (n_points, 2), [rad]
        Leading and trailing contact angle.
    compliance, tread, shear, torque, extra, n_nodes
        As for `press`.

    Raises
    ------
    ParameterError
        If the edges are not in order or outside the ring's validity, or as in `press`.
    ConvergenceError
        As in `press`.
    """
    edges = numbers(_WHERE, edges, "edges")
    n_points = _count(compliance, tread, shear, edges[:, 0] if edges.ndim == 2 else 0.0)
    if edges.ndim == 2 and n_points != len(edges):
        raise ParameterError(
            f"contact with shear: edges of {len(edges)} points for {n_points} points of ring, "
            "tread or shear; give one pair of edges a point"
        )
    first = radial.fit_edges(compliance, tread, edges, COARSE_NODES)
    given = (None, None, edges.copy())
    return _solve(compliance, tread, shear, given, first, torque, extra, n_nodes)


def belt_traction(contact: ShearContact, phi: FloatArray) -> FloatArray:
    """Return q_v, the tread's pull on the belt along +phi, [N/m], Eq. (81).

    Parameters
    ----------
    contact : ShearContact
    phi : shape (n_phi,) or (n_points, n_phi), [rad]

    Returns
    -------
    shape (n_points, n_phi)
        Zero outside the patch. Between the nodes the springs and the friction are evaluated, not
        interpolated, so the beginning of sliding stays sharp.
    """
    loads = contact.elements_at(phi).loads[..., 1]
    return np.where(contact.inside(phi), loads, 0.0)


def friction_loads(contact: ShearContact) -> ComplexArray:
    """Return harmonics of the belt loads that f_t alone makes: what the radial model leaves out.

    Returns
    -------
    shape (n_points, n_modes + 1, 3)
        Harmonics of (-f_t sin beta, f_t cos beta, h f_t), [N/m], [N/m], [N]; fits `extra` of the
        radial contact.
    """
    beta = contact.declination - contact.phi
    moment = contact.belt_loads[..., 2]
    along = contact.shear_traction
    loads = np.stack([-along * np.sin(beta), along * np.cos(beta), moment], axis=-1)
    weighted = contact.weights[..., None] * loads
    return load_harmonics(contact.phi, weighted, contact.compliance.n_modes)


def _radial(solution: Callable[[], RadialContact]) -> RadialContact:
    """Return the radial contact to start from; where that fails, its last iterate."""
    try:
        return solution()
    except ConvergenceError as error:
        if isinstance(error.iterate, RadialContact):
            return error.iterate
        raise


_WHERE = "contact with shear"

Given = tuple[FloatArray | None, FloatArray | None, FloatArray | None]


def _solve(
    compliance: Compliance | ComplianceAt,
    tread: Tread,
    shear: Shear,
    given: Given,
    first: RadialContact,
    torque: float | FloatArray | None,
    extra: ComplexArray | None,
    n_nodes: int,
) -> ShearContact:
    n_points = len(first)
    ring = first.compliance
    check_radii(_WHERE, tread, ring.radius)
    if isinstance(compliance, Compliance):
        compliance = Constant(compliance.spread(n_points))
    else:
        compliance = radial.each_point(compliance, n_points)
    moment = None if torque is None else column(_WHERE, torque, n_points, "torque", "N m")
    if moment is not None:
        _check_torque(moment, first, shear, given[1])
    problem = ShearProblem(
        compliance, tread.spread(n_points), shear.spread(n_points), *given, moment, extra
    )
    newton, iterations = solve(problem, first, n_nodes)
    contact = _contact(newton, iterations)
    _check_settled(newton, contact)
    _check(contact, problem)
    return contact


def _contact(newton: Newton, iterations: int) -> ShearContact:
    problem, x = newton.problem, newton.x
    patch = Patch.of(problem, newton.ring, newton.mesh, x)
    tread, inner = patch.tread, slice(1, -1)
    depth = (np.asarray(problem.tread.free_radius, dtype=float) - patch.ring.radius)[:, None]
    left = depth - tread.height[:, [0, -1]]
    phi = patch.phi[:, inner]
    belt = x[:, :LEAD].reshape(len(x), -1, 3)
    contact = ShearContact(
        edges=x[:, [LEAD, TRAIL]],
        deflection=newton.deflection,
        effective_radius=x[:, ROLL],
        tip_offset=x[:, OFFSET],
        phi=phi,
        weights=patch.weights[:, inner],
        compression=depth - tread.height[:, inner],
        shear=tread.offset[:, inner],
        pressure=-tread.normal[:, inner],
        shear_traction=tread.tangential[:, inner],
        sliding=tread.sliding[:, inner],
        declination=phi + belt[:, inner, 2],
        belt_loads=tread.loads[:, inner],
        compliance=patch.ring,
        tread=problem.tread,
        tread_shear=problem.shear,
        extra=problem.extra,
        edges_given=problem.edges is not None,
        edge_mismatch=left[:, 0] - left[:, 1],
        iterations=iterations,
        residual=np.zeros(len(x)),
    )
    rest = np.abs(belt - evaluate_fields(contact.displacement, patch.phi))
    rest[..., 2] *= patch.ring.radius[:, None]
    at_edges = np.abs(left).max(axis=1) if problem.edges is None else np.abs(left.sum(axis=1))
    return replace(contact, residual=np.maximum(rest.max(axis=(1, 2)), at_edges))


def _check_settled(newton: Newton, contact: ShearContact) -> None:
    moving = np.flatnonzero(~(newton.change < TOLERANCE))
    if moving.size:
        point = moving[0]
        worst = float(np.nan_to_num(contact.residual[moving], nan=np.inf).max())
        raise ConvergenceError(
            f"contact with shear: {moving.size} of {len(contact)} points, the first number {point} "
            f"at d0 = {1e3 * contact.deflection[point]:.2f} mm, leave a residual of {worst:.2e} m "
            f"after {contact.iterations} iterations; look at the last contact (attribute iterate); "
            "a smaller torque, load or shear stiffness, or more friction is needed",
            contact,
            worst,
        )


def _check(contact: ShearContact, problem: ShearProblem) -> None:
    """Refuse what lies outside the model: range, one patch, tread."""
    check_angle(_WHERE, contact, problem.at, problem.tread)
    if contact.edges_given:
        return
    half = np.abs(contact.edges).max(axis=1)
    away = np.array([0.03, 0.1, 0.3, 0.8]) * half[:, None]
    outside = np.concatenate([contact.edges[:, :1] - away, contact.edges[:, 1:] + away], axis=1)
    check_one_patch(_WHERE, contact, contact.compression_at(outside))
    thickness = contact.tread.thickness
    check_tread(_WHERE, contact.compression, thickness, contact.load, contact.deflection)


def _check_torque(
    torque: FloatArray, first: RadialContact, shear: Shear, vertical_load: FloatArray | None
) -> None:
    """Refuse a torque that friction cannot hold; near its limit Newton decides.

    The belt takes its moment on the undeformed radius, so the limit lies between mu Fz R_l and
    mu Fz R_0; the pressure's own shift adds to it. Refused is what is beyond all of that.
    """
    fz = first.load if vertical_load is None else vertical_load
    outer = np.asarray(first.tread.free_radius, dtype=float)
    limit = np.asarray(shear.friction, dtype=float) * fz * (outer - first.deflection)
    most = np.asarray(shear.friction, dtype=float) * fz * outer
    beyond = np.abs(torque) > most + np.abs(fz * first.pressure_centre)
    if beyond.any():
        point = int(np.flatnonzero(beyond)[0])
        raise ParameterError(
            f"{_WHERE}: point {point}: torque = {torque[point]:.6g} N m; friction holds some "
            f"mu Fz R_l = {limit[point]:.4g} N m at Fz = {fz[point]:.0f} N; lower the torque, or "
            "raise load or friction",
            point=point,
        )


def _count(
    compliance: Compliance | ComplianceAt, tread: Tread, shear: Shear, given: float | FloatArray
) -> int:
    rings = len(compliance) if isinstance(compliance, Compliance) else 1
    sizes = [rings, len(tread), len(shear), int(np.size(given))]
    if not set(sizes) <= {1, max(sizes)}:
        raise ParameterError(
            "contact with shear: ring, tread, shear and the given value have "
            f"{', '.join(map(str, sizes))} points; each needs one or all the same"
        )
    return max(sizes)
