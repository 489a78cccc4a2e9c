"""The rotating ring on its sidewall: modal stiffness, Eq. (55)-(77), (82)-(90), (107).

The belt is a circular beam of radius R on radial and tangential springs, under the tension
N = p b R + rho A R^2 Omega^2. Three displacements describe it over the wheel angle: u radial
outward, v tangential along +phi, beta rotation of the cross-section. Three line loads act on it:
q_u outward, q_v along +phi, and the moment q_beta. Seen from the road every field is steady,

    f(phi) = Re sum_n F_n exp(i n phi),    n = 0 ... n_modes,

and each harmonic obeys its own 3 x 3 system D_n X_n = Q_n (per length of circumference). The
dissertation's ring is the special case without extension (u = -v') and without shear
(beta = (v - u') / R); there D_n shrinks to the scalar M_n - G_n + i C_n of Eq. (89).

Known differences to the print: the tension holds its centrifugal part, so that without damping the
rolling ring has the same shape at every speed; damping acts on the non-rotating stiffness.
"""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire

ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Ring:
    """Constants of the ring, one value per operating point (or one for all).

    Attributes
    ----------
    radius : float or shape (n_points,), [m]
        R, of the neutral line.
    bending_stiffness : [N m^2]
        EI of the belt in its plane.
    mass : [kg/m]
        rho A per length of circumference.
    inflation : [N/m]
        p b, inflation pressure times belt width.
    radial_stiffness, tangential_stiffness : [N/m^2]
        k_u and k_v of the sidewall per length of circumference.
    damping : [-]
        lambda of Eq. (107): c_n = 2 lambda sqrt(m_n k_n), k_n without rotation.
    dashpots : [-]
        lambda of dashpots beside the sidewall's springs, c = 2 lambda sqrt(k rho A) each.
    extension_stiffness : [N]
        EA; infinite for the dissertation's inextensible ring.
    shear_stiffness : [N]
        GA of the Timoshenko beam; infinite for Bernoulli-Euler.
    rotary_inertia : [kg m]
        rho I of the cross-section; the dissertation leaves it out.
    inertia_share : [-]
        Share of the rotating inertia (Coriolis, centrifugal and its tension) that acts; 1 is all.
    tension : [N]
        Belt tension beside p b R + rho A R^2 Omega^2, either sign; it has no damping of its own.
    """

    radius: float | FloatArray
    bending_stiffness: float | FloatArray
    mass: float | FloatArray
    inflation: float | FloatArray
    radial_stiffness: float | FloatArray
    tangential_stiffness: float | FloatArray
    damping: float | FloatArray = 0.0
    dashpots: float | FloatArray = 0.0
    extension_stiffness: float | FloatArray = np.inf
    shear_stiffness: float | FloatArray = np.inf
    rotary_inertia: float | FloatArray = 0.0
    inertia_share: float | FloatArray = 1.0
    tension: float | FloatArray = 0.0

    def __post_init__(self) -> None:
        sizes = {}
        for field in fields(self):
            value = _numbers(field.name, getattr(self, field.name))
            sizes[field.name] = value.size
            if field.name not in _INFINITE and np.isinf(value).any():
                point = int(np.argmax(np.isinf(value)))
                raise ParameterError(
                    f"ring: {field.name} = {value.flat[point]:g} at point {point}; a finite number "
                    f"is needed (only {' and '.join(sorted(_INFINITE))} may be infinite); check "
                    "the tire's value",
                    point=point,
                )
            lowest = value.min() if value.size else np.nan
            positive = field.name in _POSITIVE
            negative = lowest < 0 and field.name not in _SIGNED
            if np.isnan(value).any() or negative or (positive and lowest == 0):
                worst = lowest if not np.isnan(value).any() else np.nan
                raise ParameterError(
                    f"ring: {field.name} = {worst:.6g}; a number {'>' if positive else '>='} 0 is "
                    "needed; check the tire's value and its dependence on pressure and deflection"
                )
        many = {name: size for name, size in sizes.items() if size != 1}
        if len(set(many.values())) > 1:
            listed = ", ".join(f"{name} {size}" for name, size in many.items())
            raise ParameterError(
                f"ring: fields for different numbers of points ({listed}); one value for all or "
                "one a point is needed; give every field the same length"
            )

    @classmethod
    def of(
        cls, tire: Tire, pressure: float | FloatArray, deflection: float | FloatArray = 0.0
    ) -> "Ring":
        """Return the ring of a tire at inflation pressures [Pa] and deflections d0 [m].

        k_u and k_v follow the pressure along a line; k_u the deflection as in Eq. (54),
        k_u = A exp(B d0).

        Raises
        ------
        ParameterError
            If a pressure is negative, or the line leads to a stiffness that is not physical.
        """
        p = np.asarray(pressure, dtype=float)
        if not (np.isfinite(p) & (p >= 0)).all():
            raise ParameterError(
                f"ring: inflation pressure {np.min(p) / 1e5:g} bar; a finite number >= 0 is "
                "needed, gauge"
            )
        above = p - tire.pressure
        radial = tire.radial_stiffness + tire.radial_pressure_slope * above
        return cls(
            radius=tire.ring_radius,
            bending_stiffness=tire.bending_stiffness,
            mass=tire.mass,
            inflation=p * tire.belt_width,
            radial_stiffness=radial * np.exp(tire.radial_deflection_rate * np.asarray(deflection)),
            tangential_stiffness=tire.tangential_stiffness + tire.tangential_pressure_slope * above,
            damping=tire.damping,
            extension_stiffness=tire.extension_stiffness,
            shear_stiffness=tire.shear_stiffness,
            rotary_inertia=tire.rotary_inertia,
        )

    @property
    def inextensible(self) -> bool:
        """Whether the belt cannot stretch."""
        return bool(np.isinf(self.extension_stiffness).all())

    @property
    def unshearable(self) -> bool:
        """Whether cross-sections stay normal to the belt."""
        return bool(np.isinf(self.shear_stiffness).all())


FREE = 1e-12
"""Share of k_u below which a harmonic's stiffness is none (n = 0 without k_v)."""

_POSITIVE = frozenset(
    {"radius", "bending_stiffness", "mass", "extension_stiffness", "shear_stiffness"}
) | {"radial_stiffness"}
_SIGNED = frozenset({"tension"})
_INFINITE = frozenset({"extension_stiffness", "shear_stiffness"})


def _numbers(name: str, value: object) -> FloatArray:
    """Return an array of floats with one axis at most, or refuse the value."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"ring: {name} is {value!r:.60}; a number or an array of numbers in SI units is "
            "needed; convert texts and fill gaps first"
        ) from error
    if array.ndim > 1:
        raise ParameterError(
            f"ring: {name} has shape {array.shape}; one value or one a point is needed; flatten "
            "the operating points"
        )
    return array


def modal_stiffness(ring: Ring, omega: float | FloatArray, n_modes: int) -> ComplexArray:
    """Return what harmonic n of (u, v, beta) costs in (q_u, q_v, q_beta).

    Extension and shear are left out (they are constraints or penalties that `compliance` adds), so
    this is bending, tension, pressure, sidewall and steady inertia of Eq. (76).

    Parameters
    ----------
    ring : Ring
    omega : [rad/s]
        Turn rate, one value or one per point.
    n_modes : int
        Highest harmonic.

    Returns
    -------
    shape (n_points, n_modes + 1, 3, 3)
        D_n, Hermitian, without damping.
    """
    elastic, inertial = modal_parts(ring, omega, n_modes)
    return elastic + inertial


def columns(*values: float | FloatArray) -> list[FloatArray]:
    """Return the values as columns over operating points, shape (n_points, 1)."""
    arrays = np.broadcast_arrays(*[np.atleast_1d(np.asarray(v, dtype=float)) for v in values])
    return [array[:, None] for array in arrays]


def modal_parts(
    ring: Ring, omega: float | FloatArray, n_modes: int
) -> tuple[ComplexArray, ComplexArray]:
    """Return the non-rotating stiffness and what rotation and further tension add."""
    r, ei, m, pb, ku, kv, rho_i, share, more, w = columns(
        ring.radius,
        ring.bending_stiffness,
        ring.mass,
        ring.inflation,
        ring.radial_stiffness,
        ring.tangential_stiffness,
        ring.rotary_inertia,
        ring.inertia_share,
        ring.tension,
        omega,
    )
    n = np.arange(n_modes + 1.0)[None, :]
    shape = (r.shape[0], n_modes + 1, 3, 3)
    elastic = np.zeros(shape, dtype=complex)
    tension = pb / r  # N / R^2 without rotation
    elastic[..., 0, 0] = ku + tension * n**2 - pb / r
    elastic[..., 1, 1] = kv + tension - pb / r
    elastic[..., 0, 1] = 1j * n * (tension - pb / r)
    elastic[..., 1, 0] = -elastic[..., 0, 1]
    elastic[..., 2, 2] = ei * n**2 / r**2

    rotation = share * m * w**2
    inertial = np.zeros(shape, dtype=complex)
    # centrifugal tension, then inertia: -(n^2 + 1) with Coriolis 2 i n
    inertial[..., 0, 0] = rotation * (n**2 - (n**2 + 1.0))
    inertial[..., 1, 1] = rotation * (1.0 - (n**2 + 1.0))
    inertial[..., 0, 1] = rotation * (1j * n - 2j * n)
    inertial[..., 1, 0] = -inertial[..., 0, 1]
    inertial[..., 2, 2] = -rho_i * (n * w) ** 2
    pull = more / r**2
    inertial[..., 0, 0] += pull * n**2
    inertial[..., 1, 1] += pull
    inertial[..., 0, 1] += pull * 1j * n
    inertial[..., 1, 0] -= pull * 1j * n
    return elastic, inertial


def modal_damping_time(ring: Ring, n_modes: int) -> FloatArray:
    """Return c_n / k_n = 2 lambda sqrt(m_n / k_n) of Eq. (107), [s], shape (n_points, n_modes + 1).

    m_n and k_n are those of the inextensible Bernoulli-Euler ring, Eq. (85), without rotation; a
    harmonic without stiffness (k_v = 0, n = 0) has none.
    """
    m, lam, ku = columns(ring.mass, ring.damping, ring.radial_stiffness)
    k = plain_stiffness(ring, n_modes)
    k = np.where(k < FREE * ku, np.inf, k)
    n = np.arange(n_modes + 1.0)[None, :]
    time: FloatArray = 2.0 * lam * np.sqrt(m * (1.0 + n**2) / k)
    return time


def dashpots(ring: Ring) -> tuple[FloatArray, FloatArray]:
    """Return c_u and c_v of the sidewall's dashpots, [N s/m^2], shape (n_points, 1).

    c = 2 lambda sqrt(k rho A) beside each spring, whatever the harmonic.
    """
    m, lam, ku, kv = columns(
        ring.mass, ring.dashpots, ring.radial_stiffness, ring.tangential_stiffness
    )
    return 2.0 * lam * np.sqrt(ku * m), 2.0 * lam * np.sqrt(kv * m)


def plain_stiffness(ring: Ring, n_modes: int) -> FloatArray:
    """Return k_n of Eq. (85) without rotation, [N/m^2], shape (n_points, n_modes + 1)."""
    r, ei, pb, ku, kv = columns(
        ring.radius,
        ring.bending_stiffness,
        ring.inflation,
        ring.radial_stiffness,
        ring.tangential_stiffness,
    )
    n = np.arange(n_modes + 1.0)[None, :]
    k: FloatArray = (
        (ei / r**4 * n**2 + pb / r) * (1.0 - n**2) ** 2 - pb / r * (1.0 - n**2) + kv + ku * n**2
    )
    return k
