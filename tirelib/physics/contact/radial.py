"""Contact of the rolling ring with a flat road through radial tread springs.

Eq. (78), (90)-(97), (114). Where the tread is pressed the pressure follows from its compression,
elsewhere there is none: a complementarity problem. Its operator (tread spring plus ring compliance)
is positive definite, so it has one solution. That is found as a free-boundary problem: inside the
patch [a, b] the pressure solves a Fredholm equation of the second kind, collocated on
Gauss-Legendre nodes, and the two edges follow from q(a) = q(b) = 0, both at once. At the solution a
shift of one edge changes the pressure nowhere else (it enters with q(edge) = 0), so Newton's matrix
for the two edges is diagonal and the iteration needs no derivative of the ring. It starts from an
estimate in closed form (`tirelib.physics.contact.start`), else from the patch of the undeformed
tire, an upper bound, and ends with a test of complementarity outside the patch.

Deflection, load, or both contact angles can be given (`press`, `load`, `fit_edges`).
"""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact.checks import (
    LARGEST_ANGLE,
    ComplianceAt,
    carried,
    check_angle,
    check_one_patch,
    check_radii,
    check_tread,
    column,
    one_or_each,
)
from tirelib.physics.contact.fourier import evaluate, load_harmonics
from tirelib.physics.contact.free_boundary import (
    MAX_ITERATIONS,
    N_NODES,
    TOLERANCE,
    Constant,
    ContactProblem,
    Solution,
    Start,
    refuse_point,
    solve,
)
from tirelib.physics.contact.patch import Nodes, PatchEquation, place
from tirelib.physics.contact.tread import Tread, numbers
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray

_FIT_TOLERANCE = 1e-10
"""Largest last change of a fitted deflection, [m]; only a hardening tread needs a second step."""

_OUTSIDE = np.linspace(0.02, 1.0, 14)
"""Where clearance is tested beyond both edges, in half patches of the undeformed tire."""


@dataclass(frozen=True, slots=True)
class RadialContact:
    """The tire on the road, one row per operating point.

    Attributes
    ----------
    edges : shape (n_points, 2), [rad]
        Leading (negative) and trailing contact angle, from below the axle.
    deflection : shape (n_points,), [m]
        d0, free radius minus loaded radius.
    phi, weights, delta : shape (n_points, n_nodes), [rad], [rad], [m]
        Gauss nodes in the patch, their weights and the tread's compression there.
    compliance : Compliance
        Compliance of the ring, at the solution.
    tread : Tread
    extra : shape (n_points, n_modes + 1, 3) or None, [N/m]
        Harmonics of other line loads on the belt.
    edge_mismatch : shape (n_points,), [m]
        Tread compression left at the leading minus at the trailing edge; zero unless the angles
        were given.
    iterations : int
    """

    edges: FloatArray
    deflection: FloatArray
    phi: FloatArray
    weights: FloatArray
    delta: FloatArray
    compliance: Compliance
    tread: Tread
    extra: ComplexArray | None
    edge_mismatch: FloatArray
    iterations: int

    def __len__(self) -> int:
        return int(self.deflection.shape[0])

    @property
    def start(self) -> Start:
        """From where a contact nearby is found soon."""
        return Start(self.edges, self.deflection, self.delta)

    @property
    def pressure(self) -> FloatArray:
        """Pressure at the nodes, inward positive, per length of belt, [N/m]."""
        return self.tread.force(self.delta)

    @property
    def load(self) -> FloatArray:
        """Vertical load Fz = R int q cos(phi) dphi, [N], shape (n_points,)."""
        return self._moment(np.cos(self.phi))

    @property
    def drag(self) -> FloatArray:
        """Horizontal resultant of the radial pressure along +phi at the road, [N]."""
        return self._moment(-np.sin(self.phi))

    @property
    def pressure_centre(self) -> FloatArray:
        """R int q sin / int q cos: where the resultant cuts the belt, negative toward the entry."""
        centre: FloatArray = -self.compliance.radius * self.drag / self.load
        return centre

    @property
    def harmonics(self) -> ComplexArray:
        """Harmonics of the pressure, inward positive, [N/m], shape (n_points, n_modes + 1)."""
        return load_harmonics(self.phi, self.weights * self.pressure, self.compliance.n_modes)

    @property
    def displacement(self) -> ComplexArray:
        """Harmonics of (u, v, beta), shape (n_points, n_modes + 1, 3), [m], [m], [rad]."""
        out: ComplexArray = -self.compliance.matrix[..., :, 0] * self.harmonics[..., None]
        if self.extra is not None:
            out = out + (self.compliance.matrix @ self.extra[..., None])[..., 0]
        return out

    def compression(self, phi: FloatArray) -> FloatArray:
        """Return delta at the angles (n_phi,) or (n_points, n_phi), [m]; negative is clearance."""
        u = evaluate(self._radial_displacement(), phi)
        r0 = np.reshape(np.asarray(self.tread.free_radius, dtype=float), (-1, 1))
        delta: FloatArray = self.deflection[:, None] - r0 * (1.0 - np.cos(phi)) + u
        return delta

    def pressure_at(self, phi: FloatArray) -> FloatArray:
        """Return the pressure at the angles (n_phi,) or (n_points, n_phi), [N/m]."""
        inside = (phi >= self.edges[:, :1]) & (phi <= self.edges[:, 1:])
        return np.where(inside, self.tread.pressure(self.compression(phi)), 0.0)

    def _radial_displacement(self) -> ComplexArray:
        """Return the harmonics of u alone."""
        u: ComplexArray = -self.compliance.radial * self.harmonics
        if self.extra is not None:
            u = u + (self.compliance.matrix[..., 0, :] * self.extra).sum(axis=-1)
        return u

    def _moment(self, weight: FloatArray) -> FloatArray:
        total: FloatArray = self.compliance.radius * np.sum(
            self.weights * self.pressure * weight, axis=1
        )
        return total


def press(
    compliance: Compliance | ComplianceAt,
    tread: Tread,
    deflection: float | FloatArray,
    *,
    extra: ComplexArray | None = None,
    n_nodes: int = N_NODES,
) -> RadialContact:
    """Return the contact at given deflections d0.

    Parameters
    ----------
    compliance : Compliance or callable
        Compliance of the ring; a callable takes the deflections (n_points,), [m], and returns it,
        for sidewalls that soften with deflection, Eq. (54).
    tread : Tread
    deflection : float or shape (n_points,), [m]
    extra : shape (n_points, n_modes + 1, 3), optional, [N/m]
        Harmonics of line loads (q_u, q_v, q_beta) on the belt besides the radial pressure, for
        instance traction.
    n_nodes : int
        Gauss nodes in the patch, even.

    Raises
    ------
    ParameterError
        If a deflection is not positive, or larger than the linear ring can describe.
    ConvergenceError
        If the edges do not settle or the patch splits; carries the last contact.
    """
    n_points = max(np.size(deflection), len(tread), _length(compliance))
    d0 = column("contact", deflection, n_points, "deflection", "m", positive=True)
    return _solve(compliance, tread, d0, None, extra, n_nodes)


def load(
    compliance: Compliance | ComplianceAt,
    tread: Tread,
    vertical_load: float | FloatArray,
    *,
    extra: ComplexArray | None = None,
    n_nodes: int = N_NODES,
    start: Start | None = None,
) -> RadialContact:
    """Return the contact at given vertical loads Fz, Eq. (114).

    Parameters
    ----------
    compliance, tread, extra, n_nodes
        As for `press`.
    vertical_load : float or shape (n_points,), [N]
    start : Start, optional
        Solution of a contact nearby, of as many points: saves time and changes nothing else.

    Raises
    ------
    ParameterError
        If a load is not positive, or more than the tire carries within the ring's validity.
    ConvergenceError
        As for `press`.
    """
    n_points = max(np.size(vertical_load), len(tread), _length(compliance))
    target = column("contact", vertical_load, n_points, "vertical load", "N", positive=True)
    return _solve(compliance, tread, None, target, extra, n_nodes, start)


def fit_edges(
    compliance: Compliance, tread: Tread, edges: FloatArray, n_nodes: int = N_NODES
) -> RadialContact:
    """Return the contact whose edges are known, for identification (Fig. 6-17).

    The deflection is the one that leaves the least tread compression at the two edges; what is
    left stands in `edge_mismatch`: not zero when these angles cannot belong to this ring.

    Parameters
    ----------
    edges : shape (n_points, 2), [rad]
        Leading and trailing contact angle.

    Raises
    ------
    ParameterError
        If the edges are not in order, or outside the ring's validity.
    """
    edges = numbers("contact", edges, "edges")
    if edges.ndim != 2 or edges.shape[1] != 2 or not (edges[:, 0] < edges[:, 1]).all():
        raise ParameterError(
            f"contact: edges of shape {edges.shape}; (n_points, 2) with leading < trailing is "
            "needed; check the order and the angle's zero"
        )
    if np.abs(edges).max() > LARGEST_ANGLE:
        raise ParameterError(
            f"contact: an edge at {np.abs(edges).max():.3f} rad; the ring holds up to "
            f"{LARGEST_ANGLE} rad; check the angle's zero"
        )
    nodes = Nodes.of(n_nodes)
    one_or_each("contact", len(compliance), len(edges), "compliance")
    one_or_each("contact", len(tread), len(edges), "tread")
    compliance, tread = compliance.spread(len(edges)), tread.spread(len(edges))
    check_radii("contact", tread, compliance.radius)
    problem = ContactProblem(Constant(compliance), tread, None, None)
    delta = np.zeros((len(edges), n_nodes))
    d0 = np.zeros(len(edges))
    iteration, moving = 0, True
    while moving and iteration < MAX_ITERATIONS:
        iteration += 1
        step = PatchEquation.of(compliance, tread, nodes, edges, delta, None)
        lift, rest = step.lift @ nodes.ends.T, step.rest @ nodes.ends.T
        used, d0 = d0, -np.sum(lift * rest, axis=1) / np.sum(lift**2, axis=1)
        delta = step.compression(d0)
        moving = not np.abs(d0 - used).max() < _FIT_TOLERANCE
    contact = _contact(problem, Solution(edges, edges, d0, delta, iteration, np.zeros_like(d0)))
    left = delta @ nodes.ends.T
    return replace(contact, edge_mismatch=left[:, 0] - left[:, 1])


def _solve(
    compliance: Compliance | ComplianceAt,
    tread: Tread,
    deflection: FloatArray | None,
    vertical_load: FloatArray | None,
    extra: ComplexArray | None,
    n_nodes: int,
    start: Start | None = None,
) -> RadialContact:
    given = deflection if deflection is not None else vertical_load
    assert given is not None  # noqa: S101 - one of the two is always given
    if isinstance(compliance, Compliance):
        one_or_each("contact", len(compliance), given.size, "compliance")
        compliance = Constant(compliance.spread(given.size))
    else:
        compliance = each_point(compliance, given.size)
    one_or_each("contact", len(tread), given.size, "tread")
    problem = ContactProblem(compliance, tread.spread(given.size), vertical_load, extra)
    first = problem.at(np.full(given.size, 0.02) if deflection is None else deflection)
    check_radii("contact", problem.tread, first.radius)
    if extra is not None:
        _check_extra(extra, (given.size, first.n_modes + 1, 3))
    found = solve(problem, deflection, n_nodes, start)
    contact, d0, change = _contact(problem, found), found.deflection, found.change
    moving = np.flatnonzero(~(change < TOLERANCE))
    if moving.size:
        point = int(moving[0])
        most = carried(problem.at, problem.tread, point)[0]
        if vertical_load is not None and vertical_load[point] > most:
            refuse_point(point, d0, problem)
        worst = float(change[moving].max())
        raise ConvergenceError(
            f"contact: {moving.size} of {d0.size} points, the first number {moving[0]} at "
            f"d0 = {1e3 * d0[moving[0]]:.2f} mm, still change by {worst:.2e} after "
            f"{found.iterations} iterations; look at the last contact (attribute iterate); "
            "another load, a stiffer belt, a softer tread or more harmonics may settle",
            contact,
            worst,
        )
    _check(contact, problem)
    return contact


def _contact(problem: ContactProblem, found: Solution) -> RadialContact:
    phi, weights = place(Nodes.of(found.delta.shape[1]), found.patch)
    d0 = found.deflection
    return RadialContact(
        found.edges,
        d0,
        phi,
        weights,
        found.delta,
        problem.at(d0),
        problem.tread,
        problem.extra,
        np.zeros_like(d0),
        found.iterations,
    )


def _length(compliance: Compliance | ComplianceAt) -> int:
    return len(compliance) if isinstance(compliance, Compliance) else 1


def each_point(at: ComplianceAt, n_points: int) -> ComplianceAt:
    """Return the same rings with one row per point; refuse a callable with other rows."""

    def rows(deflection: FloatArray) -> Compliance:
        found = at(deflection)
        one_or_each("contact", len(found), n_points, "ring that the callable returns")
        return found.spread(n_points)

    return rows


def _check(contact: RadialContact, problem: ContactProblem) -> None:
    """Refuse what lies outside the model: range, one patch, tread."""
    check_angle("contact", contact, problem.at, problem.tread)
    away = np.arccos(1.0 - contact.deflection / contact.tread.free_radius)[:, None] * _OUTSIDE
    outside = np.concatenate([contact.edges[:, :1] - away, contact.edges[:, 1:] + away], axis=1)
    check_one_patch("contact", contact, contact.compression(outside))
    check_tread("contact", contact.delta, contact.tread.thickness, contact.load, contact.deflection)


def _check_extra(extra: ComplexArray, shape: tuple[int, int, int]) -> None:
    if extra.shape != shape or not np.isfinite(extra).all():
        raise ParameterError(
            f"contact: extra has shape {extra.shape}; finite harmonics of shape {shape} (points, "
            "modes + 1, loads on u, v, beta) are needed"
        )
