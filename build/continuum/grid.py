"""The strips' meshes as one: fine in the contact, coarse at the top, numbered along the wheel."""

from dataclasses import dataclass, replace

import numpy as np

from continuum.elements import Pattern, pattern, unknowns
from continuum.polar import Array, Bulk, Index, Line, sector
from continuum.tire import STRIPS, Tire

ZONE = 0.46
"""Half of the angle in which elements are small [rad]."""
FINE, COARSE, GROWTH = 0.0115, 0.04, 1.25
"""Smallest and largest element [rad], and the ratio of neighbours between them. On three tires the
strain moves by .4 to .8e-6 rms when all are halved; with a largest of .08 by 1 to 14e-6."""


@dataclass(frozen=True)
class Grid:
    """All elements of the strips, strip after strip.

    Attributes
    ----------
    n : int
        Number of nodes.
    bulk : Bulk
    layer, strip : shape (E,)
        Layer and strip of each element of `bulk`.
    gage, carcass, back, surface : Line
        Innerliner, inner and outer face of the belt, and tread surface; the elements of a strip
        stand together.
    tied : shape (E, 9)
        Nodes of the three strips' carcass at the same angles.
    add : Pattern
        For the groups bulk, gage, carcass, surface, tied, and back with carcass.
    nodes : shape (n, 3)
        phi, r and strip of the nodes.
    """

    n: int
    bulk: Bulk
    layer: Index
    strip: Index
    gage: Line
    carcass: Line
    back: Line
    surface: Line
    tied: Index
    add: Pattern
    nodes: Array

    def of_strip(self, values: Array, line: Line) -> Array:
        """Repeat values of the strips for the elements of a line, shape (E, 1)."""
        return np.repeat(values, len(line.dofs) // len(STRIPS))[:, None]


def angles(fine: float = FINE) -> Array:
    """Return the element borders round the wheel, from -pi to pi."""
    scale = fine / FINE
    inner = np.linspace(0.0, ZONE, round(ZONE / fine) + 1)
    sizes, size, left = [0.0], fine, np.pi - ZONE
    while sum(sizes) < left:
        size = min(size * GROWTH**scale, COARSE * scale)
        sizes.append(size)
    outer = ZONE + np.cumsum(sizes[1:]) * left / sum(sizes)
    half = np.concatenate([inner, outer])
    half[-1] = np.pi
    return np.concatenate([-half[:0:-1], half])


def grid(tire: Tire, fine: float = FINE) -> Grid:
    """Mesh a tire with elements of the size `fine` [rad] in the contact."""
    phi = angles(fine)
    parts = [sector(phi, tire.radii(i), closed=True) for i in range(len(STRIPS))]
    size = parts[0].n
    nodes = np.concatenate([np.c_[p.nodes, np.full(p.n, i)] for i, p in enumerate(parts)])
    order = np.lexsort((nodes[:, 1], nodes[:, 2], np.round(nodes[:, 0], 9)))
    number = np.empty(len(order), dtype=np.intp)
    number[order] = np.arange(len(order))
    own = [number[i * size : (i + 1) * size] for i in range(len(parts))]
    bulk = Bulk(
        np.concatenate([m[p.bulk.dofs] for m, p in zip(own, parts, strict=True)]),
        *(
            np.concatenate([getattr(p.bulk, name) for p in parts])
            for name in ("grad", "frame", "volume", "radius")
        ),
    )
    gage, carcass, back, surface = (_joined([p.lines[k] for p in parts], own) for k in range(4))
    tied = np.concatenate(np.split(carcass.dofs, len(parts)), axis=1)
    section = np.concatenate([back.dofs, carcass.dofs], axis=1)
    groups = (bulk.dofs, gage.dofs, carcass.dofs, surface.dofs, tied, section)
    return Grid(
        n=len(nodes),
        bulk=bulk,
        layer=np.concatenate([p.layer for p in parts]),
        strip=np.repeat(np.arange(len(parts)), len(parts[0].layer)),
        gage=gage,
        carcass=carcass,
        back=back,
        surface=surface,
        tied=tied,
        add=pattern(2 * len(nodes), [unknowns(d) for d in groups]),
        nodes=nodes[order],
    )


def _joined(lines: list[Line], own: list[Index]) -> Line:
    dofs = np.concatenate([m[line.dofs] for m, line in zip(own, lines, strict=True)])
    return replace(
        lines[0],
        dofs=dofs,
        **{
            name: np.concatenate([getattr(line, name) for line in lines])
            for name in ("value", "slope", "phi", "weight", "radius")
        },
    )
