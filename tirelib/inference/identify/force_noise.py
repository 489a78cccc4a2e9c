"""Noise of a force's points from repeats: of the data alone, whatever the model.

Points in one cell of conditions are repeats. Within a cell the conditions differ a little, and the
force with them: up to half a cell's width times the slope of the force. That is no noise, and is
taken out along the slopes that the campaign itself shows: a plane through the nearest points around
each cell, weighted by their distance (local linear regression, W. S. Cleveland, Journal of the
American Statistical Association 74 (1979) 829-836).
"""

import numpy as np
from scipy.spatial import cKDTree

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.force_points import (
    CELL_ANGLE,
    CELL_RATIO,
    CELL_SHARE,
    CELL_TEMPERATURE,
    ForcePoints,
    noise_of,
)

FEWEST_NEIGHBOURS, MOST_NEIGHBOURS, NEIGHBOUR_REACH = 12, 40, 3.0
"""Points of other cells that a plane is laid through: the nearest ones of a sparse plan, where the
force bends between more, and up to so many within a distance in cells where a sweep is dense.
`build/force_noise.py` measures what half and double of each do."""
PASSES = 3
"""Fits of a plane, each with the noise that the one before left."""
STEEPEST = 0.2
"""Prior standard deviation of a slope, in the rms force per cell: half a degree of slip angle is a
tenth to a fifth of the way to sliding, and a tenth more load gives a tenth more force. It holds at
zero what the neighbours do not tell, as where all set points of a pressure are the same."""


def force_noise(points: ForcePoints, force: FloatArray) -> tuple[float, int, int]:
    """Return the noise of a point, its degrees of freedom, and the number of repeated cells.

    Parameters
    ----------
    force : shape (n,), [N] or [N m]
        Measured, finite.
    """
    shift, passed_on = _within(points, force)
    noise, freedom, cells = noise_of(force - shift, points.cell)
    # the slopes' own noise adds to the differences
    return noise * float(np.sqrt(freedom / max(freedom + passed_on, 1.0))), freedom, cells


def _within(points: ForcePoints, force: FloatArray) -> tuple[FloatArray, float]:
    """Return what the conditions' differences within each repeated cell change, shape (n,).

    And the variance that the planes' noise adds to their squares, over that of a point.
    """
    place = _scaled(points)
    tree, out, passed_on = cKDTree(place), np.zeros(len(points)), 0.0
    steepest = STEEPEST * float(np.sqrt(np.mean(force**2)))
    order = np.argsort(points.cell, kind="stable")
    ends = np.flatnonzero(np.diff(points.cell[order])) + 1
    for member in np.split(order, ends):
        if member.size < 2:
            continue
        middle = place[member].mean(axis=0)
        # a cell's own points would hide their noise in the plane
        count = min(MOST_NEIGHBOURS + member.size, len(points))
        far, near = (np.asarray(found) for found in tree.query(middle, k=count))
        others = points.cell[near] != points.cell[member[0]]
        far, near = far[others], near[others]
        within = int(np.searchsorted(far, NEIGHBOUR_REACH))
        chosen = slice(0, min(MOST_NEIGHBOURS, max(FEWEST_NEIGHBOURS, within)))
        far, near = far[chosen], near[chosen]
        weight = np.clip(1.0 - (far / max(far[-1], 1e-12)) ** 3, 0.0, 1.0) ** 3
        gain = _plane(place[near] - middle, force[near], weight, steepest)
        weights = (place[member] - middle) @ gain
        out[member] = weights @ force[near]
        passed_on += float(np.sum(weights**2))
    return out, passed_on


def _plane(apart: FloatArray, force: FloatArray, weight: FloatArray, steepest: float) -> FloatArray:
    """Return the matrix (k, n) from forces of n neighbours to the slopes of the plane through them.

    What the plane leaves is its noise.
    """
    design = np.column_stack([np.ones(len(apart)), apart])
    weighed = (design * weight[:, None]).T
    held = np.diag(np.r_[0.0, np.ones(apart.shape[1])])
    left = float(np.average((force - np.average(force, weights=weight)) ** 2, weights=weight))
    for _ in range(PASSES):
        gain = np.linalg.solve(weighed @ design + held * left / steepest**2, weighed)
        left = float(np.average((force - design @ (gain @ force)) ** 2, weights=weight))
    return np.asarray(gain[1:])


def _scaled(points: ForcePoints) -> FloatArray:
    """Return the conditions in cells, those that are known everywhere, shape (n, k)."""
    d = points.data
    columns = [
        np.log(d.load) / CELL_SHARE,
        np.log(np.maximum(d.pressure, 1.0)) / CELL_SHARE,
        np.log(np.maximum(np.abs(d.speed), 1e-3)) / CELL_SHARE,
        d.slip_angle / CELL_ANGLE,
        d.camber / CELL_ANGLE,
        d.slip_ratio / CELL_RATIO,
        d.temperature / CELL_TEMPERATURE,
    ]
    return np.stack([column for column in columns if np.isfinite(column).all()], axis=1)
