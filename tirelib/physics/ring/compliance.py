"""Compliance of the ring per harmonic: from line loads on the belt to its displacements.

Rows and columns are (u, v, beta) and (q_u, q_v, q_beta); see `tirelib.physics.ring.ring` for the
equations.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.physics.ring.ring import (
    FREE,
    ComplexArray,
    Ring,
    columns,
    dashpots,
    modal_damping_time,
    modal_parts,
    plain_stiffness,
)

_RIM = 1e9
"""Stiffness, in k_u, that takes the belt along with the rim where k_v = 0 does not (n = 0)."""


@dataclass(frozen=True, slots=True)
class Compliance:
    """Displacement harmonics per load harmonic.

    Attributes
    ----------
    radius : shape (n_points,), [m]
    matrix : shape (n_points, n_modes + 1, 3, 3)
        X_n = matrix @ Q_n; u, v in m, beta in rad, per N/m (moment: per N).
    """

    radius: FloatArray
    matrix: ComplexArray

    def __len__(self) -> int:
        return int(self.matrix.shape[0])

    def spread(self, n_points: int) -> "Compliance":
        """Return the compliance with one row per point."""
        if len(self) == n_points:
            return self
        return Compliance(
            np.broadcast_to(self.radius, (n_points,)),
            np.broadcast_to(self.matrix, (n_points, *self.matrix.shape[1:])),
        )

    def take(self, index: IntArray | slice) -> "Compliance":
        """Return the compliance of some points (of one with a row per point)."""
        return Compliance(self.radius[index], self.matrix[index])

    @property
    def n_modes(self) -> int:
        """Highest harmonic."""
        return int(self.matrix.shape[1]) - 1

    @property
    def radial(self) -> ComplexArray:
        """Displacement u per q_u, shape (n_points, n_modes + 1)."""
        out: ComplexArray = self.matrix[..., 0, 0]
        return out


def compliance(ring: Ring, omega: float | FloatArray, n_modes: int = 60) -> Compliance:
    """Return the ring's compliance in steady rolling.

    Parameters
    ----------
    ring : Ring
    omega : [rad/s]
        Turn rate, one value or one per point.
    n_modes : int
        Highest harmonic.

    Raises
    ------
    ParameterError
        If the rotating ring has lost its stiffness in some harmonic (a critical speed).
    """
    if n_modes < 2:
        raise ParameterError(f"ring: {n_modes} modes; at least 2 are needed, 60 are usual")
    speeds = np.asarray(omega, dtype=float)
    if not np.isfinite(speeds).all():
        raise ParameterError("ring: the turn rate is not a finite number; give it in rad/s")
    everything = columns(omega, *[getattr(ring, field.name) for field in fields(ring)])
    radius = np.broadcast_to(np.asarray(ring.radius, dtype=float), (everything[0].shape[0],))
    if ring.inextensible and ring.unshearable:
        return Compliance(radius, _plain(ring, omega, n_modes))
    return Compliance(radius, _general(ring, omega, n_modes))


def _plain(ring: Ring, omega: float | FloatArray, n_modes: int) -> ComplexArray:
    """Compliance of the inextensible Bernoulli-Euler ring: one scalar a harmonic, Eq. (89)."""
    r, m, rho_i, share, more, w = columns(
        ring.radius, ring.mass, ring.rotary_inertia, ring.inertia_share, ring.tension, omega
    )
    n = np.arange(n_modes + 1.0)[None, :]
    static = plain_stiffness(ring, n_modes)
    free = _unheld(ring, static)
    static = np.where(free, 1.0, static)
    # (1 - n^2)^2 from the centrifugal tension, -(1 + n^2)^2 + 4 n^2 from inertia: they cancel
    rotation = share * m * w**2 * ((1.0 - n**2) ** 2 - (1.0 + n**2) ** 2 + 4.0 * n**2)
    rotary = -rho_i * (n * w * (1.0 - n**2) / r) ** 2
    further = more * ((1.0 - n**2) / r) ** 2
    lagging = static * (1.0 + 1j * n * w * modal_damping_time(ring, n_modes))
    c_u, c_v = dashpots(ring)
    lagging = lagging + 1j * n * w * (c_v + c_u * n**2)
    dynamic = lagging + rotation + rotary + further
    _refuse_critical(dynamic.real, static)
    shape = np.stack(
        np.broadcast_arrays(-1j * n + 0 * r, np.ones_like(n * r), (1.0 - n**2) / r + 0j), axis=-1
    )
    each = np.where(free, 0.0, 1.0 / dynamic)
    out: ComplexArray = shape[..., :, None] * shape[..., None, :].conj() * each[..., None, None]
    return out


def _general(ring: Ring, omega: float | FloatArray, n_modes: int) -> ComplexArray:
    """Compliance with extension or shear: the free displacements of each harmonic are solved."""
    elastic, inertial = modal_parts(ring, omega, n_modes)
    r, ea, ga, w = columns(ring.radius, ring.extension_stiffness, ring.shear_stiffness, omega)
    n = np.arange(n_modes + 1.0)[None, :]
    zero = np.zeros(elastic.shape[:2], dtype=complex)
    one = zero + 1.0
    if not ring.inextensible:
        stretch = np.stack([one / r, 1j * n / r + zero, zero], axis=-1)
        elastic = elastic + ea[..., None, None] * _outer(stretch)
    if not ring.unshearable:
        shear = np.stack([1j * n / r + zero, -one / r, one], axis=-1)
        elastic = elastic + ga[..., None, None] * _outer(shear)
    free = _unheld(ring, plain_stiffness(ring, n_modes))
    elastic[..., 1, 1] += np.where(free, _RIM * np.asarray(ring.radial_stiffness).max(), 0.0)
    lag = 1.0 + 1j * n * w * modal_damping_time(ring, n_modes)
    dynamic = elastic * lag[..., None, None] + inertial
    c_u, c_v = dashpots(ring)
    dynamic[..., 0, 0] += 1j * n * w * c_u
    dynamic[..., 1, 1] += 1j * n * w * c_v
    if ring.inextensible:  # v and beta are free, u = -v'
        basis = _basis([-1j * n + zero, one, zero], [zero, zero, one])
    elif ring.unshearable:  # u and v are free, beta = (v - u') / R
        basis = _basis([one, zero, -1j * n / r + zero], [zero, one, one / r])
    else:
        return _inverse(dynamic)
    across = basis.conj().swapaxes(-1, -2)
    out: ComplexArray = basis @ _inverse(across @ dynamic @ basis) @ across
    return out


def _inverse(stiffness: ComplexArray) -> ComplexArray:
    """Return the inverses of the harmonics' stiffness; refuse what does not hold the ring."""
    held = 0.5 * (stiffness + stiffness.conj().swapaxes(-1, -2))
    try:
        np.linalg.cholesky(held)
    except np.linalg.LinAlgError:  # some are not positive; which?
        _refuse_critical(np.linalg.eigvalsh(held).min(axis=-1), np.ones(held.shape[:2]))
    return np.asarray(np.linalg.inv(stiffness), dtype=np.complex128)


def _unheld(ring: Ring, static: FloatArray) -> BoolArray:
    """Return where nothing holds the belt round the rim (k_v = 0): there it is taken along."""
    (ku,) = columns(ring.radial_stiffness)
    out: BoolArray = static < FREE * ku
    return out


def _basis(*shapes: list[npt.NDArray[Any]]) -> ComplexArray:
    """Return free displacement shapes as columns, shape (n_points, n_modes + 1, 3, n_free)."""
    out: ComplexArray = np.stack([np.stack(shape, axis=-1) for shape in shapes], axis=-1)
    return out


def _outer(row: ComplexArray) -> ComplexArray:
    """Return row^H row, the stiffness of one strain measure."""
    out: ComplexArray = row.conj()[..., :, None] * row[..., None, :]
    return out


def _refuse_critical(stiffness: FloatArray, scale: FloatArray) -> None:
    if (stiffness <= 0).any():
        scale = np.broadcast_to(scale, stiffness.shape)
        point, mode = np.argwhere(stiffness <= 0)[0]
        raise ParameterError(
            f"ring: point {point} has no stiffness left in harmonic {mode} "
            f"({stiffness[point, mode]:.4g} N/m^2, non-rotating scale {scale[point, mode]:.4g}); "
            "the speed is beyond a critical speed or a stiffness is not physical",
            point=int(point),
        )
