"""The node equations of the standing contact: flexibility, active set, edge between the nodes."""

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ConvergenceError
from tirelib.physics.ring.green import point_response


def flexibility(arc: FloatArray, half: int, ring: tuple[FloatArray, ...]) -> FloatArray:
    """Return -u at node i per symmetric pressure at node j, shape (p, half + 1, half + 1)."""
    R, EI, k_u = (x[:, None] for x in ring)
    step = arc[:, None] / half
    green = point_response(
        step * np.arange(2 * half + 1), ring_radius=R, bending_stiffness=EI, radial_stiffness=k_u
    )
    i = np.arange(half + 1)
    folded = green[:, np.abs(i[:, None] - i)] + green[:, i[:, None] + i]
    folded[:, :, 0] *= 0.5  # the middle node is its own mirror image
    matrix: FloatArray = -folded * (R * step)[:, :, None]
    return matrix


def active_set(
    matrix: FloatArray, u_r: FloatArray, k_t: FloatArray, max_iterations: int
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64], FloatArray]:
    """Return pressure, deformation, steps, residual of q = k_t max(0, u - u_r)."""
    scaled = k_t[:, None, None] * matrix
    eye: FloatArray = np.eye(u_r.shape[1])
    active: BoolArray = u_r < 0.0
    steps = np.zeros(k_t.shape, dtype=np.int64)
    for step in range(1, max_iterations + 1):
        system = eye + scaled * (active[:, :, None] & active[:, None, :])
        right = np.where(active, -k_t[:, None] * u_r, 0.0)
        q = np.asarray(np.linalg.solve(system, right[..., None])[..., 0], dtype=np.float64)
        u = -np.einsum("pij,pj->pi", matrix, q)
        pushed = np.where(active, q > 0.0, u > u_r)
        changing = (pushed != active).any(axis=1)
        steps[changing | (steps == 0)] = step
        active = pushed
        if not changing.any():
            break
    error = np.abs(q - k_t[:, None] * np.maximum(0.0, u - u_r)).max(axis=1)
    residual: FloatArray = error / np.abs(q).max(axis=1)
    if changing.any():
        raise ConvergenceError(
            f"static contact: {int(changing.sum())} of {k_t.size} points still change after "
            f"{max_iterations} steps (residual {residual.max():.1e}); raise max_iterations",
            q,
            float(residual.max()),
        )
    return q, u, steps, residual


def edge(gap: FloatArray, last: npt.NDArray[np.int64]) -> FloatArray:
    """Return where the gap vanishes after node `last`, in node distances, by a cubic."""
    row = np.arange(gap.shape[0])
    y0, y1, y2, y3 = (gap[row, last + k] for k in (-1, 0, 1, 2))
    second, third = y0 - 2.0 * y1 + y2, y3 - 3.0 * y2 + 3.0 * y1 - y0
    t = y1 / (y1 - y2)
    for _ in range(8):  # fixed point of the cubic; its bent part is small
        bent = 0.5 * t * (t - 1.0) * second + (t + 1.0) * t * (t - 1.0) / 6.0 * third
        t = (y1 + bent) / (y1 - y2)
    edge: FloatArray = last + t
    return edge
