"""The integral equation of the contact on patches with given edges, collocated on Gauss nodes."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.physics.contact.fourier import evaluate, waves
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray


@dataclass(frozen=True, slots=True)
class Nodes:
    """Gauss-Legendre nodes on [-1, 1] and the rows that read a node polynomial at the two ends."""

    xi: FloatArray
    weights: FloatArray
    ends: FloatArray
    end_slopes: FloatArray
    readers: FloatArray
    """Columns: value at the left and right end, slope at the left and right end."""
    index: IntArray

    @classmethod
    @cache
    def of(cls, n_nodes: int) -> "Nodes":
        """Return an even number of nodes."""
        if n_nodes < 4 or n_nodes % 2:
            raise ParameterError(f"contact: {n_nodes} nodes; an even number >= 4 is needed")
        rule = legendre.leggauss(n_nodes)
        xi, weights = (np.asarray(part, dtype=np.float64) for part in rule)
        inverse = np.linalg.inv(legendre.legvander(xi, n_nodes - 1))
        ends = legendre.legvander(np.array([-1.0, 1.0]), n_nodes - 1) @ inverse
        slopes = np.stack([legendre.legder(column) for column in inverse.T], axis=-1)
        end_slopes = legendre.legvander(np.array([-1.0, 1.0]), n_nodes - 2) @ slopes
        return cls(
            xi,
            weights,
            ends,
            end_slopes,
            np.concatenate([ends, end_slopes]).T.copy(),
            np.arange(n_nodes),
        )


@cache
def between(n_from: int, n_to: int) -> FloatArray:
    """Return the matrix that takes a node polynomial to other nodes, shape (n_to, n_from)."""
    old, new = Nodes.of(n_from), Nodes.of(n_to)
    inverse = np.linalg.inv(legendre.legvander(old.xi, n_from - 1))
    out: FloatArray = legendre.legvander(new.xi, n_from - 1) @ inverse
    return out


@dataclass(frozen=True, slots=True)
class PatchEquation:
    """The integral equation on one set of patches, linearised about a compression.

    With the deflection d0 free, the compression at the nodes is d0 * lift + rest.
    """

    radius: FloatArray
    phi: FloatArray
    weights: FloatArray
    tangent: FloatArray
    offset: FloatArray
    lift: FloatArray
    rest: FloatArray

    @classmethod
    def of(
        cls,
        compliance: Compliance,
        tread: Tread,
        nodes: Nodes,
        edges: FloatArray,
        delta: FloatArray,
        extra: ComplexArray | None,
    ) -> "PatchEquation":
        """Solve delta + K q(delta) = d0 - R0 (1 - cos phi) + u_extra for lift and rest."""
        phi, weights = place(nodes, edges)
        kernel = kernel_matrix(compliance, nodes, edges)
        r0 = np.reshape(np.asarray(tread.free_radius, dtype=float), (-1, 1))
        known = -r0 * (1.0 - np.cos(phi))
        if tread.linear:
            stiffness = np.reshape(np.asarray(tread.normal_stiffness, dtype=float), (-1, 1))
            tangent = np.broadcast_to(stiffness, phi.shape)
            offset = np.zeros_like(phi)
        else:
            tangent = tread.tangent(delta)
            offset = tread.force(delta) - tangent * delta
            known -= (kernel @ (weights * offset)[..., None])[..., 0]
        matrix = kernel * (weights * tangent)[:, None, :]
        matrix[:, nodes.index, nodes.index] += 1.0
        if extra is not None:
            lifted = (compliance.matrix[..., 0, :] * extra).sum(axis=-1)
            known += evaluate(lifted, phi)
        sides = np.ones((*known.shape, 2))
        sides[..., 1] = known
        both = np.linalg.solve(matrix, sides)
        lift = np.asarray(both[..., 0], dtype=np.float64)
        rest = np.asarray(both[..., 1], dtype=np.float64)
        return cls(compliance.radius, phi, weights, tangent, offset, lift, rest)

    def compression(self, d0: FloatArray) -> FloatArray:
        """Return the compression at the nodes for deflections d0, [m]."""
        out: FloatArray = d0[:, None] * self.lift + self.rest
        return out

    def deflection(self, vertical_load: FloatArray) -> FloatArray:
        """Return the deflection that carries the load."""
        arm = self.radius[:, None] * self.weights * np.cos(self.phi)
        per_metre = np.sum(arm * self.tangent * self.lift, axis=1)
        fixed = np.sum(arm * (self.tangent * self.rest + self.offset), axis=1)
        out: FloatArray = (vertical_load - fixed) / per_metre
        return out


def place(nodes: Nodes, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the nodes' angles and weights on the patches."""
    half = 0.5 * (edges[:, 1:] - edges[:, :1])
    phi: FloatArray = 0.5 * (edges[:, 1:] + edges[:, :1]) + half * nodes.xi
    return phi, half * nodes.weights


def kernel_matrix(compliance: Compliance, nodes: Nodes, edges: FloatArray) -> FloatArray:
    """Return the inward displacement at node i per unit pressure and radian at node j.

    It depends on differences of angle only, so the waves are taken about the patch's middle, where
    the nodes lie in pairs: those on the right give the cosine and sine products of all.
    """
    middle = nodes.xi.size // 2
    half = 0.5 * (edges[:, 1:] - edges[:, :1])
    cos, sin = waves(half * nodes.xi[middle:], compliance.n_modes)
    h = compliance.radial / np.pi
    h[:, 0] *= 0.5
    across = cos.swapaxes(1, 2), sin.swapaxes(1, 2)
    in_phase = h.real[:, None, :]
    even, odd = (cos * in_phase) @ across[0], (sin * in_phase) @ across[1]
    kernel = np.empty((half.shape[0], nodes.xi.size, nodes.xi.size))
    same, other = even + odd, even - odd
    right, left = slice(middle, None), slice(middle - 1, None, -1)  # pairs, from the middle
    if h.imag.any():  # damping: the belt answers later
        late = (sin * h.imag[:, None, :]) @ across[0]
        early = late.swapaxes(1, 2)
        skew, shift = early - late, early + late
        kernel[:, right, right] = same + skew
        kernel[:, left, left] = same - skew
        kernel[:, right, left] = other - shift
        kernel[:, left, right] = other + shift
    else:
        kernel[:, right, right] = kernel[:, left, left] = same
        kernel[:, right, left] = kernel[:, left, right] = other
    return kernel
