"""The integral equation of the contact on patches with given edges, collocated on Gauss nodes."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from tirelib.arrays import FloatArray
from tirelib.contact.fourier import evaluate
from tirelib.contact.tread import Tread
from tirelib.errors import ParameterError
from tirelib.ring.compliance import Compliance
from tirelib.ring.ring import ComplexArray


@dataclass(frozen=True, slots=True)
class Nodes:
    """Gauss-Legendre nodes on [-1, 1] and the rows that read a node polynomial at the two ends."""

    xi: FloatArray
    weights: FloatArray
    ends: FloatArray
    end_slopes: FloatArray

    @classmethod
    @cache
    def of(cls, n_nodes: int) -> "Nodes":
        """Return an even number of nodes."""
        if n_nodes < 4 or n_nodes % 2:
            raise ParameterError(f"contact: {n_nodes} nodes; an even number >= 4 is needed")
        xi, weights = legendre.leggauss(n_nodes)
        inverse = np.linalg.inv(legendre.legvander(xi, n_nodes - 1))
        ends = legendre.legvander(np.array([-1.0, 1.0]), n_nodes - 1) @ inverse
        slopes = np.stack([legendre.legder(column) for column in inverse.T], axis=-1)
        end_slopes = legendre.legvander(np.array([-1.0, 1.0]), n_nodes - 2) @ slopes
        return cls(xi, weights, ends, end_slopes)


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
        kernel = kernel_matrix(compliance, nodes, edges) * weights[:, None, :]
        tangent: FloatArray = tread.tangent(delta)
        offset = tread.force(delta) - tangent * delta
        matrix = kernel * tangent[:, None, :]
        index = np.arange(matrix.shape[1])
        matrix[:, index, index] += 1.0
        r0 = np.reshape(np.asarray(tread.free_radius, dtype=float), (-1, 1))
        known = -r0 * (1.0 - np.cos(phi)) - (kernel @ offset[..., None])[..., 0]
        if extra is not None:
            lifted = (compliance.matrix[..., 0, :] * extra).sum(axis=-1)
            known = known + evaluate(lifted, phi)
        both = np.linalg.solve(matrix, np.stack([np.ones_like(known), known], axis=-1))
        lift: FloatArray = both[..., 0]
        rest: FloatArray = both[..., 1]
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
    phi: FloatArray = edges.mean(axis=1)[:, None] + half * nodes.xi
    return phi, half * nodes.weights


def kernel_matrix(compliance: Compliance, nodes: Nodes, edges: FloatArray) -> FloatArray:
    """Return the inward displacement at node i per unit pressure and radian at node j.

    It depends on differences of angle only, so the waves are taken about the patch's middle.
    """
    n = np.arange(compliance.n_modes + 1.0)
    half = 0.5 * (edges[:, 1] - edges[:, 0])
    # nodes lie in pairs about the middle: cos is even, sin is odd
    right = (half[:, None] * nodes.xi[nodes.xi.size // 2 :])[:, :, None] * n
    cos, sin = np.cos(right), np.sin(right)
    cos = np.concatenate([cos[:, ::-1], cos], axis=1)
    sin = np.concatenate([-sin[:, ::-1], sin], axis=1)
    h = compliance.radial[:, None, :] * (np.where(n == 0, 0.5, 1.0) / np.pi)
    waves = np.concatenate([cos, sin], axis=2)
    answer = np.concatenate([cos * h.real + sin * h.imag, sin * h.real - cos * h.imag], axis=2)
    kernel: FloatArray = waves @ answer.swapaxes(1, 2)
    return kernel
