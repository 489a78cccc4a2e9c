"""All equations of the contact with shear in one system, with their derivatives.

Unknown are u, v, beta at the nodes of the patch and at its two edges, the edges, R_e, R_l and x_0.
Equations are: the belt's displacement is the ring's answer to the loads that `shear_law` gives for
it; h = h_0 and gamma h = 0 at the leading edge, (103), (104); h = h_0 at the trailing edge, (106);
the given deflection or load; x_0 = 0 or the given torque. The nodes move with the edges, and the
derivatives hold that too.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.physics.contact.checks import ComplianceAt
from tirelib.physics.contact.patch import Nodes
from tirelib.physics.contact.shear_law import Elements, Rolling, Shear, elements
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray

FORCE_TO_LENGTH = 1e-7
"""Makes residuals of force and torque as large as those of length, [m/N]."""

LEAD, TRAIL, ROLL, HEIGHT, OFFSET = range(-5, 0)
"""Places of the edges, R_e, R_l and x_0 among the unknowns."""


@dataclass(frozen=True)
class ShearProblem:
    """The contact problem; exactly one of load, deflection and edges is given, not None."""

    at: ComplianceAt
    tread: Tread
    shear: Shear
    deflection: FloatArray | None
    vertical_load: FloatArray | None
    edges: FloatArray | None
    torque: FloatArray | None
    extra: ComplexArray | None

    def take(self, index: IntArray) -> "ShearProblem":
        """Return the problem of some points."""
        if index.size == len(self.tread):
            return self
        return ShearProblem(
            self.at,
            self.tread.take(index),
            self.shear.take(index),
            None if self.deflection is None else self.deflection[index],
            None if self.vertical_load is None else self.vertical_load[index],
            None if self.edges is None else self.edges[index],
            None if self.torque is None else self.torque[index],
            None if self.extra is None else self.extra[index],
        )


@dataclass(frozen=True, slots=True)
class Mesh:
    """Gauss nodes of [-1, 1] between its two ends, which carry no weight."""

    xi: FloatArray
    weights: FloatArray

    @classmethod
    def of(cls, n_nodes: int) -> "Mesh":
        """Return an even number of nodes and the two ends."""
        nodes = Nodes.of(n_nodes)
        return cls(np.concatenate([[-1.0], nodes.xi, [1.0]]), np.pad(nodes.weights, 1))

    @property
    def shares(self) -> tuple[FloatArray, FloatArray]:
        """How far each node moves with the leading and trailing edge, shape (n_nodes + 2, 1)."""
        return 0.5 * (1.0 - self.xi)[:, None], 0.5 * (1.0 + self.xi)[:, None]

    def place(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the angles and weights on the patches of the unknowns."""
        middle, half = 0.5 * (x[:, TRAIL] + x[:, LEAD]), 0.5 * (x[:, TRAIL] - x[:, LEAD])
        phi: FloatArray = middle[:, None] + half[:, None] * self.xi
        return phi, half[:, None] * self.weights


@dataclass(frozen=True, slots=True)
class Patch:
    """A few points in one state.

    Attributes
    ----------
    problem : ShearProblem
    ring : Compliance
    mesh : Mesh
    x : shape (n_points, 3 (n_nodes + 2) + 5)
        u, v, beta at the nodes and edges; leading and trailing edge, R_e, R_l, x_0.
    phi, weights : shape (n_points, n_nodes + 2)
    tread : Elements
    """

    problem: ShearProblem
    ring: Compliance
    mesh: Mesh
    x: FloatArray
    phi: FloatArray
    weights: FloatArray
    tread: Elements

    @classmethod
    def of(cls, problem: ShearProblem, ring: Compliance, mesh: Mesh, x: FloatArray) -> "Patch":
        """Return the points with their tread elements."""
        phi, weights = mesh.place(x)
        belt = x[:, :LEAD].reshape(len(x), -1, 3)
        rolling = Rolling(x[:, ROLL], x[:, HEIGHT], x[:, OFFSET])
        tread = elements(belt, phi, rolling, ring.radius, problem.tread, problem.shear)
        return cls(problem, ring, mesh, x, phi, weights, tread)


@dataclass(frozen=True, slots=True)
class System:
    """Residual and Jacobian of all equations, to be filled row by row."""

    residual: FloatArray
    jacobian: FloatArray


def assemble(patch: Patch, softening: ComplexArray | None) -> System:
    """Return the equations.

    Parameters
    ----------
    patch : Patch
    softening : shape (n_points, n_modes + 1, 3, 3) or None
        d compliance / d R_l, of a ring that depends on the deflection.
    """
    n_points, size = patch.x.shape
    fields = size - 5
    system = System(np.empty((n_points, size)), np.zeros((n_points, size, size)))
    answer = _ring_answer(patch, softening)
    system.residual[:, :fields] = patch.x[:, :fields] - answer[:, :, -6]
    system.jacobian[:, :fields, 3 : fields - 3] = -answer[:, :, : fields - 6]
    system.jacobian[:, :fields, fields:] = -answer[:, :, -5:]
    index = np.arange(fields)
    system.jacobian[:, index, index] += 1.0
    _edge_rows(patch, system)
    _given_rows(patch, system)
    return system


def _ring_answer(patch: Patch, softening: ComplexArray | None) -> FloatArray:
    """Return the ring's displacements at the nodes, shape (n_points, 3 (n_nodes + 2), columns).

    Columns: derivatives by u, v, beta of each inner node; displacement itself; derivatives by the
    two edges, R_e, R_l and x_0.
    """
    mesh, x, tread = patch.mesh, patch.x, patch.tread
    n_points, n_inner = len(x), mesh.xi.size - 2
    n = np.arange(patch.ring.n_modes + 1.0)
    unit = (np.where(n == 0, 0.5, 1.0) / np.pi)[:, None, None]
    matrix = patch.ring.matrix * unit
    angle = (0.5 * (x[:, TRAIL] - x[:, LEAD])[:, None] * mesh.xi)[:, :, None] * n
    cos, sin = np.cos(angle), np.sin(angle)

    whole = _whole_patch(patch, matrix, unit, cos - 1j * sin, softening)
    # loads of the inner nodes one by one: Re(matrix exp(-i n xi)) and -Im of it
    weighted = (patch.weights[..., None, None] * tread.d_loads[..., :3])[:, 1:-1]
    weighted = weighted.swapaxes(1, 2).reshape(n_points, 3, -1)
    shape = (n_points, n.size, 3, n_inner, 3)
    real = (matrix.real.reshape(n_points, -1, 3) @ weighted).reshape(shape)
    imag = (matrix.imag.reshape(n_points, -1, 3) @ weighted).reshape(shape)
    c = cos[:, 1:-1].swapaxes(1, 2)[:, :, None, :, None]
    s = sin[:, 1:-1].swapaxes(1, 2)[:, :, None, :, None]
    coefficients = np.empty((n_points, 2, n.size, 3, 3 * n_inner + 7))
    coefficients[:, 0, ..., :-7] = (real * c + imag * s).reshape(*shape[:3], -1)
    coefficients[:, 1, ..., :-7] = (real * s - imag * c).reshape(*shape[:3], -1)
    coefficients[:, 0, ..., -7:] = whole.real
    coefficients[:, 1, ..., -7:] = -whole.imag

    waves = np.concatenate([cos, sin], axis=2)
    out = (waves @ coefficients.reshape(n_points, 2 * n.size, -1)).reshape(
        n_points, mesh.xi.size, 3, -1
    )
    with_lead, with_trail = mesh.shares
    out[..., -6] += out[..., -1] * with_lead  # the nodes themselves move with the edges
    out[..., -5] += out[..., -1] * with_trail
    result: FloatArray = out.reshape(n_points, 3 * mesh.xi.size, -1)[..., :-1]
    return result


def _whole_patch(
    patch: Patch,
    matrix: ComplexArray,
    unit: FloatArray,
    waves: ComplexArray,
    softening: ComplexArray | None,
) -> ComplexArray:
    """Return displacement harmonics about the patch's middle, shape (..., n_modes + 1, 3, 7).

    The last axis holds the displacement under all loads, its derivatives by the edges, R_e, R_l and
    x_0, and its slope.
    """
    weight, (loads, d_loads) = patch.weights[..., None], (patch.tread.loads, patch.tread.d_loads)
    with_lead, with_trail = patch.mesh.shares
    along = weight * d_loads[..., 3]
    stretch = 0.5 * patch.mesh.weights[:, None] * loads
    sums = [
        weight * loads,
        along * with_lead - stretch,
        along * with_trail + stretch,
        *(weight * d_loads[..., k] for k in (4, 5, 6)),
        weight * loads * with_lead,
        weight * loads * with_trail,
    ]
    total = waves.swapaxes(1, 2) @ np.concatenate(sums, axis=-1)
    total = total.reshape(*total.shape[:2], len(sums), 3).swapaxes(2, 3)
    n = np.arange(matrix.shape[1])
    if patch.problem.extra is not None:
        middle = 0.5 * (patch.x[:, LEAD] + patch.x[:, TRAIL])
        turn = np.exp(1j * n * middle[:, None])[..., None]
        total[..., 0] += patch.problem.extra * turn / unit[..., 0]
    field: ComplexArray = matrix @ total
    slope = 1j * n[:, None]
    field[..., 1] -= slope * field[..., 6]
    field[..., 2] -= slope * field[..., 7]
    if softening is not None:
        field[..., 4] += (softening @ (total[..., :1] * unit))[..., 0]
    field[..., 6] = slope * field[..., 0]
    return field[..., :7]


def _edge_rows(patch: Patch, system: System) -> None:
    """Fill in h = h_0 at both edges and gamma h = 0 at the leading one."""
    problem, x, tread = patch.problem, patch.x, patch.tread
    residual, jacobian = system.residual, system.jacobian
    depth = np.asarray(problem.tread.free_radius, dtype=float) - patch.ring.radius
    value = tread.height[:, [0, -1]] - depth[:, None]
    rows = np.zeros((2, *x.shape))
    _insert(rows[0], 0, LEAD, tread.d_height[:, 0])
    _insert(rows[1], x.shape[1] - 8, TRAIL, tread.d_height[:, -1])
    if problem.edges is None:
        residual[:, [LEAD, TRAIL]] = value
        jacobian[:, LEAD], jacobian[:, TRAIL] = rows
    else:  # the edges stand; what is left of h - h_0 is the same with opposite signs
        residual[:, [LEAD, TRAIL]] = x[:, [LEAD, TRAIL]] - problem.edges
        jacobian[:, [LEAD, TRAIL], [LEAD, TRAIL]] = 1.0
        residual[:, HEIGHT] = value.sum(axis=1)
        jacobian[:, HEIGHT] = rows.sum(axis=0)
    residual[:, ROLL] = tread.offset[:, 0]
    _insert(jacobian[:, ROLL], 0, LEAD, tread.d_offset[:, 0])


def _insert(row: FloatArray, node: int, edge: int, gradient: FloatArray) -> None:
    """Write the derivatives of something at an edge into a row of the Jacobian."""
    row[:, node : node + 3] = gradient[:, :3]
    row[:, edge] = gradient[:, 3]
    row[:, ROLL:] = gradient[:, 4:]


def _given_rows(patch: Patch, system: System) -> None:
    """Fill in the given deflection or load, and x_0 = 0 or the given torque."""
    problem, x, phi = patch.problem, patch.x, patch.phi
    if problem.deflection is not None:
        free_radius = np.asarray(problem.tread.free_radius, dtype=float)
        system.residual[:, HEIGHT] = x[:, HEIGHT] - (free_radius - problem.deflection)
        system.jacobian[:, HEIGHT, HEIGHT] = 1.0
    zero = np.zeros_like(phi)
    if problem.vertical_load is not None:
        up = np.stack([-np.cos(phi), np.sin(phi), zero], axis=-1)
        turn = np.stack([np.sin(phi), np.cos(phi), zero], axis=-1)
        _resultant(patch, system, HEIGHT, problem.vertical_load, up, turn)
    if problem.torque is None:
        system.residual[:, OFFSET] = x[:, OFFSET]
        system.jacobian[:, OFFSET, OFFSET] = 1.0
    else:
        arm = np.stack([zero, zero + patch.ring.radius[:, None], zero + 1.0], axis=-1)
        _resultant(patch, system, OFFSET, problem.torque, arm, np.zeros_like(arm))


def _resultant(
    patch: Patch,
    system: System,
    row: int,
    target: FloatArray,
    direction: FloatArray,
    turn: FloatArray,
) -> None:
    """Fill in R int q . direction dphi = target; `turn` is d direction / dphi."""
    mesh, tread, weights = patch.mesh, patch.tread, patch.weights
    scale = patch.ring.radius * FORCE_TO_LENGTH
    density = (tread.loads * direction).sum(axis=-1)
    gradient = scale[:, None, None] * (tread.d_loads * direction[..., None]).sum(axis=-2)
    by_angle = gradient[..., 3] + scale[:, None] * (tread.loads * turn).sum(axis=-1)
    half = 0.5 * scale[:, None] * mesh.weights * density
    lead, trail = (share[:, 0] for share in mesh.shares)
    out = system.jacobian[:, row]
    system.residual[:, row] = (weights * density).sum(axis=1) * scale - target * FORCE_TO_LENGTH
    out[:, :LEAD] = (weights[..., None] * gradient[..., :3]).reshape(len(target), -1)
    out[:, LEAD] = (weights * by_angle * lead - half).sum(axis=1)
    out[:, TRAIL] = (weights * by_angle * trail + half).sum(axis=1)
    out[:, ROLL:] = (weights[..., None] * gradient[..., 4:]).sum(axis=1)
