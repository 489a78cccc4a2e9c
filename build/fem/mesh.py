"""A structured mesh of eight-node quadrilaterals over half the section, phi from 0 to pi.

x points toward the trailing side, y up; a point is (r sin phi, -r cos phi). Element nodes run
outer edge, outer edge, inner edge, inner edge, so that edge 1 is the outer and edge 3 the inner
one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from section import Section

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Fineness:
    """Lengths of elements along the middle line [m] and elements through each layer."""

    contact_length: float = 2.0e-3
    free_length: float = 6.0e-3
    contact_angle: float = 0.42
    blend_angle: float = 0.35
    tread: int = 4
    liner: int = 1
    coat: int = 1
    core: int = 1

    def through(self, layer: str) -> int:
        """Elements through the layer."""
        return int(getattr(self, layer))


@dataclass(frozen=True)
class Mesh:
    """Nodes on a grid of half steps; ids are 1-based, 0 marks the missing element centers."""

    phi: Floats
    """Angles of the half steps, (2 n + 1,)."""
    y: Floats
    """Distances from the middle line of the half steps, (2 m + 1,)."""
    ids: Ints
    """Node ids, (2 n + 1, 2 m + 1)."""
    elements: Ints
    """Eight node ids, (n, m, 8)."""
    layers: tuple[str, ...]
    """Name of the layer of each of the m rows, from the inside."""
    layer_of_row: tuple[int, ...]
    """Its number among the section's layers."""
    radius: float

    def points(self) -> Floats:
        """Coordinates by node id minus 1, (nodes, 2)."""
        r = self.radius + self.y
        x = np.stack([np.outer(np.sin(self.phi), r), -np.outer(np.cos(self.phi), r)], axis=-1)
        return x[self.ids > 0]

    def element_ids(self, row: int) -> Ints:
        """Ids of the elements of a row from phi = 0 to pi."""
        n, m = self.elements.shape[:2]
        return np.arange(n) * m + row + 1


def angles(fine: Fineness, radius: float) -> Floats:
    """Element boundaries: constant in the contact, growing to constant outside."""
    steps, at = [], 0.0
    while at < np.pi:
        s = np.clip((at - fine.contact_angle) / fine.blend_angle, 0.0, 1.0)
        step = fine.contact_length * (fine.free_length / fine.contact_length) ** s / radius
        steps.append(step)
        at += step
    edge = np.concatenate([[0.0], np.cumsum(steps)])
    # Only the part beyond the contact is stretched to end at pi.
    keep = edge <= fine.contact_angle
    last = edge[keep][-1]
    edge[~keep] = last + (edge[~keep] - last) * (np.pi - last) / (edge[-1] - last)
    return edge


def mesh(section: Section, fine: Fineness) -> Mesh:
    """Mesh the section."""
    radius = section.target.ring_radius
    edge = angles(fine, radius)
    rows, names, numbers = [np.array([section.layers[0].inner])], [], []
    for number, layer in enumerate(section.layers):
        k = fine.through(layer.name)
        rows.append(np.linspace(layer.inner, layer.outer, k + 1)[1:])
        names += [layer.name] * k
        numbers += [number] * k
    y = np.concatenate(rows)
    phi2, y2 = _half_steps(edge), _half_steps(y)
    n, m = edge.size - 1, y.size - 1
    used = np.ones((2 * n + 1, 2 * m + 1), dtype=bool)
    used[1::2, 1::2] = False
    ids = np.zeros(used.shape, dtype=np.int64)
    ids[used] = np.arange(1, used.sum() + 1)
    i, j = 2 * np.arange(n)[:, None], 2 * np.arange(m)[None, :]
    nodes = [(0, 2), (2, 2), (2, 0), (0, 0), (1, 2), (2, 1), (1, 0), (0, 1)]
    elements = np.stack([ids[i + a, j + b] for a, b in nodes], axis=-1)
    return Mesh(phi2, y2, ids, elements, tuple(names), tuple(numbers), radius)


def _half_steps(edge: Floats) -> Floats:
    out = np.empty(2 * edge.size - 1)
    out[::2] = edge
    out[1::2] = (edge[1:] + edge[:-1]) / 2.0
    return out
