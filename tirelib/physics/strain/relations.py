"""Circumferential strain of a layer of the belt from the belt's displacements, Eq. (29)-(35).

A point of the belt lies at the distance y from the neutral line, outward positive: y < 0 at the
innerliner, y = 0 at the first steel belt. Cross-sections stay plane and normal to the neutral line.
u is positive outward, v along +phi, strain positive in tension. Where the road flattens the belt,
u + u'' > 0, so the innerliner is in tension there; a layer outside the neutral line is compressed.

Three forms, each with what it leaves out:

- `full_strain` (32): stretch, bending, and the rotation squared;
- `bending_strain` (33): bending alone, linear;
- `inextensible_strain` (35): bending with v' = -u (34).

Validity: abs(y) / R < 0.1, rotations (u' - v) / R below about 0.3 rad. With 1/r = 1/(R + y) written
out, the bending term of (32) is -(y/R^2)(u + u''), the form of (35). (32) and (33) hold v' in place
of -u, which differs by (y/R^2)(u + v'): nothing for an inextensible belt, else a share y/R of the
stretch.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError


@dataclass(frozen=True, slots=True)
class BeltShape:
    """Displacements of the neutral line and the derivatives that the strain needs.

    Attributes
    ----------
    u, v : array, shape (..., n), [m]
        Radial and tangential displacement.
    u_prime, v_prime, u_second : array, shape (..., n), [m]
        u', v', u'' by the angle.
    """

    u: FloatArray
    v: FloatArray
    u_prime: FloatArray
    v_prime: FloatArray
    u_second: FloatArray


def sampled_shape(radial: npt.ArrayLike, tangential: npt.ArrayLike) -> BeltShape:
    """Shape from samples on a uniform grid over one full turn, derivatives by Fourier series.

    Parameters
    ----------
    radial, tangential : array, shape (..., n), [m]
        u and v at phi_0 + 2 pi k / n, k = 0 .. n - 1; the end is not repeated.

    Returns
    -------
    BeltShape

    Raises
    ------
    ShapeError
        If u and v differ in shape or have fewer than 4 samples.
    ParameterError
        If a sample is not finite.
    """
    u, v = (np.asarray(x, dtype=np.float64) for x in (radial, tangential))
    if u.shape != v.shape or u.ndim == 0 or u.shape[-1] < 4:
        raise ShapeError(
            f"belt shape: radial has shape {u.shape}, tangential {v.shape}; both need the same "
            "uniform grid over one turn with 4 samples or more as last dimension"
        )
    if not (np.isfinite(u).all() and np.isfinite(v).all()):
        raise ParameterError("belt shape: a displacement is not finite; fill or drop the turn")
    return BeltShape(u, v, _derivative(u, 1), _derivative(v, 1), _derivative(u, 2))


def series_shape(
    angle: npt.ArrayLike,
    radial_cosine: npt.ArrayLike,
    radial_sine: npt.ArrayLike,
    tangential_cosine: npt.ArrayLike,
    tangential_sine: npt.ArrayLike,
) -> BeltShape:
    """Shape at any angles from Fourier coefficients, f = sum_n c_n cos n phi + s_n sin n phi.

    Parameters
    ----------
    angle : array, shape (n,), [rad]
    radial_cosine, radial_sine, tangential_cosine, tangential_sine : array, shape (..., orders), [m]
        Coefficients of orders 0, 1, 2, ...; all of one shape. sine[0] has no effect.

    Returns
    -------
    BeltShape
        Arrays of shape (..., n).

    Raises
    ------
    ShapeError
        If the coefficients differ in shape.
    ParameterError
        If an angle or a coefficient is not finite.
    """
    phi = np.atleast_1d(np.asarray(angle, dtype=np.float64))
    given = (radial_cosine, radial_sine, tangential_cosine, tangential_sine)
    uc, us, vc, vs = (np.asarray(x, dtype=np.float64) for x in given)
    if not uc.shape == us.shape == vc.shape == vs.shape or uc.ndim == 0:
        raise ShapeError(
            f"belt shape: coefficients have shapes {uc.shape}, {us.shape}, {vc.shape}, {vs.shape}; "
            "all four need the same (..., orders)"
        )
    if not all(np.isfinite(x).all() for x in (phi, uc, us, vc, vs)):
        raise ParameterError("belt shape: an angle or a coefficient is not finite")
    n = np.arange(uc.shape[-1], dtype=np.float64)
    cosine, sine = np.cos(n[:, None] * phi), np.sin(n[:, None] * phi)
    return BeltShape(
        uc @ cosine + us @ sine,
        vc @ cosine + vs @ sine,
        (n * us) @ cosine - (n * uc) @ sine,
        (n * vs) @ cosine - (n * vc) @ sine,
        -(n**2 * uc) @ cosine - (n**2 * us) @ sine,
    )


def inextensible_tangential(radial: npt.ArrayLike) -> FloatArray:
    """Tangential displacement that keeps the belt's length, v' = -u (34), without mean rotation.

    Parameters
    ----------
    radial : array, shape (..., n), [m]
        u on a uniform grid over one turn, with zero mean: a ring that keeps its length can not
        grow.

    Returns
    -------
    array, shape (..., n), [m]

    Raises
    ------
    ParameterError
        If the mean of u exceeds 1e-6 of its largest value.
    """
    u = np.asarray(radial, dtype=np.float64)
    mean, largest = np.abs(u.mean(axis=-1)), np.abs(u).max(axis=-1)
    if np.any(mean > 1e-6 * largest):
        raise ParameterError(
            f"inextensible belt: mean of u is {mean.max():.3g} m; must be 0 (1e-6 of its largest "
            "value); subtract it, or use the displacements of a belt that stretches"
        )
    return -_derivative(u, -1)


def full_strain(
    shape: BeltShape, *, ring_radius: npt.ArrayLike, layer_offset: npt.ArrayLike
) -> FloatArray:
    r"""Strain with stretch, bending and the square of the rotation, Eq. (32).

    .. math:: \varepsilon = \frac{u + v'}{R} + \frac{y}{R^2} (v' - u'')
              + \frac{(u' - v)^2}{2 R^2}

    The last term is of second order: half the squared rotation of the belt. It is what keeps the
    neutral line unstrained when the belt turns as a rigid body (Eq. (29) needs the same square,
    which the print lacks). The square of the stretch is left out, being much smaller.

    Parameters
    ----------
    shape : BeltShape
        Arrays (..., n).
    ring_radius : array, shape (...), [m]
        R > 0.
    layer_offset : array, shape (...), [m]
        y, abs(y) < R; negative at the innerliner.

    Returns
    -------
    array, shape (..., n), [-]

    Raises
    ------
    ParameterError
        If R is not positive or abs(y) >= R.
    """
    R, y = _geometry(ring_radius, layer_offset)
    stretch = (shape.u + shape.v_prime) / R
    rotation = (shape.u_prime - shape.v) / R
    strain: FloatArray = stretch + y / R**2 * (shape.v_prime - shape.u_second) + 0.5 * rotation**2
    return strain


def bending_strain(
    shape: BeltShape, *, ring_radius: npt.ArrayLike, layer_offset: npt.ArrayLike
) -> FloatArray:
    """Strain of bending alone, (y/R^2)(v' - u''), Eq. (33).

    Parameters, returns and errors as in `full_strain`. What a gage sees once its offset has been
    removed, if the belt's stretch does not vary round the wheel.
    """
    R, y = _geometry(ring_radius, layer_offset)
    strain: FloatArray = y / R**2 * (shape.v_prime - shape.u_second)
    return strain


def inextensible_strain(
    shape: BeltShape, *, ring_radius: npt.ArrayLike, layer_offset: npt.ArrayLike
) -> FloatArray:
    """Strain of bending of a belt that keeps its length, -(y/R^2)(u + u''), Eq. (35).

    Parameters, returns and errors as in `full_strain`; v is not used. A rigid shift of the belt
    (cos phi, sin phi) gives no strain.

    Examples
    --------
    A belt flat on the road, u = -d0 + R0 (1 - cos phi) near phi = 0, seen 2 mm inside of it:

    >>> phi = np.linspace(-0.1, 0.1, 3)
    >>> u = -0.02 + 0.3125 * (1 - np.cos(phi))
    >>> flat = BeltShape(u, 0 * u, 0.3125 * np.sin(phi), -u, 0.3125 * np.cos(phi))
    >>> strain = inextensible_strain(flat, ring_radius=0.3, layer_offset=-0.002)
    >>> [round(float(100 * e), 3) for e in strain]
    [0.65, 0.65, 0.65]
    """
    R, y = _geometry(ring_radius, layer_offset)
    strain: FloatArray = -y / R**2 * (shape.u + shape.u_second)
    return strain


def _geometry(ring_radius: npt.ArrayLike, offset: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return R and y with a last dimension for the angle."""
    R, y = (np.asarray(x, dtype=np.float64)[..., None] for x in (ring_radius, offset))
    if not (np.isfinite(R) & (R > 0.0)).all():
        raise ParameterError(f"strain: ring_radius = {R.min():g} m; must be finite and > 0")
    if not (np.abs(y) < R).all():
        raise ParameterError(
            f"strain: layer_offset = {y.flat[np.argmax(np.abs(y))]:g} m; must lie within the "
            f"ring's radius {R.min():g} m; negative means inside the neutral line"
        )
    return R, y


def _derivative(f: FloatArray, order: int) -> FloatArray:
    """Return a derivative (order 1, 2) or the integral (-1) of samples over one turn."""
    count = f.shape[-1]
    n = np.fft.rfftfreq(count, d=1.0 / count)
    factor = np.zeros(n.size, dtype=np.complex128)
    factor[1:] = (1j * n[1:]) ** order
    if count % 2 == 0 and order % 2 != 0:
        factor[-1] = 0.0  # the highest harmonic of an even count has no defined slope
    return np.fft.irfft(factor * np.fft.rfft(f), n=count)
