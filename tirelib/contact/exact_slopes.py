"""How the exact contact changes with the constants of ring and tread, and with the load.

At a solution the energy's slope G(x, d0; c) by the coefficients is zero and the tread carries the
load, so that with the Newton matrix J = dG/d(x, d0)

    d(x, d0)/dc = -J^-1 dG/dc,    d(x, d0)/dFz = J^-1 e_last;

the energy is linear in EA, EI, p b, k_u, k_v and k_t. One matrix serves all slopes of a point.
"""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact import exact_energy as energy
from tirelib.contact.exact import CHUNK, INEXTENSIBLE, ExactContact
from tirelib.errors import ParameterError

NAMES = (*energy.LINEAR, "load")


@dataclass(frozen=True, slots=True)
class ExactSlopes:
    """Slopes of a solution along directions in the constants.

    Attributes
    ----------
    coefficients : shape (n_directions, n_points, n_dof), [m]
    deflection : shape (n_directions, n_points), [m]
    inverse : shape (n_points, n_dof + 1, n_dof + 1)
        Inverse of the Newton matrix.
    """

    coefficients: FloatArray
    deflection: FloatArray
    inverse: FloatArray

    def moved(self, solved: ExactContact, z: FloatArray) -> ExactContact:
        """Return the first-order guess of the solution after a move z (n_directions,).

        It is a start for `load_exact`; what depends on the solution (half angle) is not moved.
        """
        x = solved.coefficients + np.tensordot(z, self.coefficients, axes=1)
        even, odd = np.split(x, [energy.N_MODES + 1], axis=1)
        return replace(
            solved,
            even=even,
            odd=np.pad(odd, ((0, 0), (1, 0))),
            deflection=solved.deflection + z @ self.deflection,
            inverse=self.inverse,
        )

    def strain(
        self, solved: ExactContact, offset: FloatArray, by_offset: FloatArray, phi: FloatArray
    ) -> FloatArray:
        """Return the slopes of the innerliner strain, (n_directions, n_points, n_phi).

        Parameters
        ----------
        solved : ExactContact
        offset : shape (n_points,), [m]
        by_offset : shape (n_directions, n_points), [m]
            Change of the offset along the directions.
        phi : shape (n_phi,), [rad]
        """
        at = energy.basis(phi)
        local = energy.measures(solved.coefficients, at)
        r = solved.radius[:, None]
        a, c, da, dc = r + local[..., 2], local[..., 3], local[..., 4], local[..., 5]
        q = a * a + c * c
        y = offset[:, None]
        bend = (a * dc - c * da) / q
        root = np.sqrt(q)
        # strain = sqrt(q) / r - 1 - y bend / r, by (a, c, a', c')
        by_measure = (
            np.stack(
                [
                    a / root - y * (dc - 2.0 * a * bend) / q,
                    c / root + y * (da + 2.0 * c * bend) / q,
                    y * c / q,
                    -y * a / q,
                ],
                axis=-1,
            )
            / r[..., None]
        )
        out = np.empty((len(self.coefficients), *q.shape))
        for row, x, move in zip(out, self.coefficients, by_offset, strict=True):
            row[:] = np.einsum("pni,pni->pn", by_measure, energy.measures(x, at)[..., 2:])
            row -= move[:, None] * bend / r
        return out


def exact_slopes(solved: ExactContact, directions: FloatArray) -> ExactSlopes:
    """Return the slopes of a solution along directions.

    Parameters
    ----------
    solved : ExactContact
    directions : shape (n_directions, n_points, 7)
        Change of each of `NAMES` (EA, EI, p b, k_u, k_v, k_t, Fz), SI.

    Raises
    ------
    ParameterError
        If the directions have another shape.
    """
    shape = (len(directions), len(solved), len(NAMES))
    if directions.shape != shape:
        raise ParameterError(
            f"slopes of the exact contact: directions of shape {directions.shape}; {shape} are "
            f"needed (directions, points, changes of {', '.join(NAMES)})"
        )
    k = solved.constants
    x, d0 = solved.coefficients, solved.deflection
    # a belt beyond `INEXTENSIBLE` is held at it, whatever its EA
    free = np.where(k.ea[:, 0] < INEXTENSIBLE, directions[..., 0], 0.0)
    moves = np.concatenate([free[..., None], directions[..., 1:-1]], axis=2)
    right = -np.einsum("dpc,cpn->pnd", moves, energy.residuals(x, d0, k), optimize=True)
    right[:, -1] += directions[..., -1].T
    parts = []
    for first in range(0, len(solved), CHUNK):
        rows = slice(first, first + CHUNK)
        parts.append(np.linalg.inv(energy.jacobian(x[rows], d0[rows], k.take(rows))))
    inverse = np.concatenate(parts)
    found = np.moveaxis(inverse @ right, 2, 0)
    return ExactSlopes(found[..., :-1], found[..., -1], inverse)
