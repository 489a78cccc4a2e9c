"""Finite elements on a sector of a ring: quadratic elements in polar coordinates, exact geometry.

Positions are Cartesian (x forward, z up), the reference is polar: phi = 0 points down and grows the
way a rolling wheel's material goes, so that e_r = (-sin phi, -cos phi), e_t = d e_r / d phi. The
displacement is interpolated by components, X = r e_r is exact, and rigid translations are in the
space. Elements are 8-node serendipity quadrilaterals, meshed, numbered and integrated by
scikit-fem, with 3 Gauss points across a layer and 2 along it: with 3 along, a thin layer of cords
locks (the third mode of a ring comes 2 % too high).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementQuadS2, FacetBasis, MeshQuad

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def radial(phi: Array) -> Array:
    """Return e_r, shape (..., 2)."""
    return np.stack([-np.sin(phi), -np.cos(phi)], axis=-1)


def tangential(phi: Array) -> Array:
    """Return e_t, shape (..., 2)."""
    return np.stack([-np.cos(phi), np.sin(phi)], axis=-1)


@dataclass(frozen=True)
class Bulk:
    """Gauss points of the elements; E elements, Q points each.

    Attributes
    ----------
    dofs : shape (E, 8)
        Node numbers; node k has the unknowns 2 k (x) and 2 k + 1 (z).
    grad : shape (E, Q, 8, 2)
        Derivatives of the shape functions along e_t and e_r.
    frame : shape (E, Q, 2, 2)
        [component, direction]: e_t and e_r as columns.
    volume : shape (E, Q)
        Area of the reference section at a point [m^2].
    radius : shape (E, Q)
    """

    dofs: Index
    grad: Array
    frame: Array
    volume: Array
    radius: Array


@dataclass(frozen=True)
class Line:
    """Gauss points on a circle of element edges; 3 nodes an edge, sorted by the angle.

    `value` and `slope` (d/dphi) have shape (E, Q, 3), `phi` and `weight` (dphi) shape (E, Q),
    `radius` shape (E, 1).
    """

    dofs: Index
    value: Array
    slope: Array
    phi: Array
    weight: Array
    radius: Array


@dataclass(frozen=True)
class Sector:
    """A mesh of layers.

    Attributes
    ----------
    bulk : Bulk
    nodes : shape (n, 2)
        phi and r of the nodes.
    layer : shape (E,)
        Layer of each element, counted from inside.
    lines : tuple of Line
        At every boundary between layers, from inside.
    """

    bulk: Bulk
    nodes: Array
    layer: Index
    lines: tuple[Line, ...]

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.nodes)


def sector(phi: Array, r: Array, *, closed: bool) -> Sector:
    """Mesh the layers between the radii r [m] with element borders at the angles phi [rad].

    A closed sector joins its two ends: the last angle must be the first plus a turn.
    """
    mesh = MeshQuad.init_tensor(phi, r)
    element = ElementQuadS2()
    basis = Basis(mesh, element, quadrature=_points(3, 2))
    places = basis.doflocs
    number, kept = _numbering(places, phi, closed=closed)
    x = np.moveaxis(np.asarray(basis.global_coordinates()), 0, -1)
    grad = np.stack([np.moveaxis(b[0].grad, 0, -1) for b in basis.basis], axis=2)
    grad[..., 0] /= x[:, :, None, 1]
    frame = np.stack([tangential(x[..., 0]), radial(x[..., 0])], axis=-1)
    bulk = Bulk(
        number[basis.element_dofs.T], grad, frame, np.asarray(basis.dx) * x[..., 1], x[..., 1]
    )
    middle = mesh.p[1, mesh.t].mean(axis=0)
    layer = np.searchsorted(r, middle) - 1
    lines = tuple(_line(mesh, element, number, float(radius)) for radius in r)
    return Sector(bulk, places.T[kept], layer, lines)


def _points(across: int, along: int) -> tuple[Array, Array]:
    """Return Gauss points (2, n) and weights of a unit square, its first side across a layer."""
    (x, a), (y, b) = (np.polynomial.legendre.leggauss(n) for n in (across, along))
    place = np.stack([g.ravel() for g in np.meshgrid(x, y, indexing="ij")])
    return 0.5 * (1.0 + place), np.outer(0.5 * a, 0.5 * b).ravel()


def _numbering(places: Array, phi: Array, *, closed: bool) -> tuple[Index, Index]:
    """Return the number of every node, along the ring with joined ends, and which are kept."""
    merged = np.arange(places.shape[1])
    if closed:
        end = np.flatnonzero(np.abs(places[0] - phi[-1]) < 1e-9)
        start = np.flatnonzero(np.abs(places[0] - phi[0]) < 1e-9)
        merged[end[np.argsort(places[1, end])]] = start[np.argsort(places[1, start])]
    kept = np.flatnonzero(merged == np.arange(len(merged)))
    kept = kept[np.lexsort((places[1, kept], places[0, kept]))]
    number = np.empty(len(merged), dtype=np.intp)
    number[kept] = np.arange(len(kept))
    return number[merged], kept


def _line(mesh: MeshQuad, element: ElementQuadS2, number: Index, radius: float) -> Line:
    facets = mesh.facets_satisfying(lambda x: np.abs(x[1] - radius) < 1e-9)
    basis = FacetBasis(mesh, element, facets=facets, intorder=7)
    x = np.moveaxis(np.asarray(basis.global_coordinates()), 0, -1)
    order = np.argsort(x[:, 0, 0])
    value = np.stack([np.asarray(b[0]) for b in basis.basis], axis=-1)[order]
    slope = np.stack([b[0].grad[0] for b in basis.basis], axis=-1)[order]
    on = np.argsort(-np.abs(value).max(axis=1), axis=1)[:, :3]
    on.sort(axis=1)
    dofs = np.take_along_axis(basis.element_dofs.T[order], on, axis=1)
    pick = on[:, None, :]
    return Line(
        number[dofs],
        np.take_along_axis(value, pick, axis=2),
        np.take_along_axis(slope, pick, axis=2),
        x[order, :, 0],
        np.asarray(basis.dx)[order],
        np.full((len(order), 1), radius),
    )
