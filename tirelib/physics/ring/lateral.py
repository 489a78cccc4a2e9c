r"""Lateral bending of the belt: a beam on the sidewalls' lateral springs (Fiala 1954).

The belt's line moves by w to the left under a lateral line load f (road on tire, left positive).
With the belt tension N, the bending stiffness EI_z in the belt's own plane, the shear stiffness S
and the lateral sidewall stiffness k,

.. math:: EI_z\,\theta'' + S (w' - \theta) = 0, \qquad
          k w - N w'' - S (w'' - \theta') = f

over the arc s = R phi; theta is the rotation of a cross-section. Without shear (S infinite) theta
is w' and this is Fiala's

.. math:: EI_z\,w'''' - N w'' + k w = f.

A fibre at the lateral position y is stretched by -y theta'(s).

The belt is a hoop, not a straight beam: its fibres can also move along their length without
stretching where the belt rolls, u = -v' (34). A belt that shifts fibres by v = y V turns its
cross-sections by -V as well, so the shear angle is w' - theta + V and V yields to the shear moment
M = S (w' - theta + V) like a spring in series,

.. math:: V = V_0 - c_V M, \qquad
          M \left(\frac1S + c_V + \frac1{EI_z \kappa^2}\right) = i\kappa w + V_0, \qquad
          (k + N\kappa^2) w - i\kappa M = f \qquad (\kappa = n / R),

with the strips' compliance c_V and the shift V_0 that the road's pressure causes. This is what
moves load across the patch: where the belt curves, it rolls (u = y R w'' for a stiff belt).
c_V = V_0 = 0 is the straight beam.

Sign (ISO 8855): Fy > 0 pushes the tire to the left, w > 0 where the road acts, so theta' < 0 there
and the left gages (y > 0) are stretched, the right ones compressed. It does not depend on the
direction in which s is counted.

Two solutions that agree as soon as the ring is long against the decay length (a few of
`BeamConstants.decay_length` in half a turn): the Fourier series of the periodic ring, and the
closed form of the infinite beam.

Rotation: the centrifugal share of the tension and the inertia of steady rolling cancel exactly
(rho A Omega^2 w'' on both sides), so N = p b R at every speed; speed acts through damping alone.
"""

from dataclasses import dataclass, fields

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire
from tirelib.physics.ring.ring import ComplexArray, columns

_MAY_BE_ZERO = frozenset({"tension", "mass", "damping"})
_MAY_BE_INFINITE = frozenset({"shear_stiffness"})


@dataclass(frozen=True, slots=True)
class LateralBelt:
    """Constants of the belt's lateral beam, one value per operating point (or one for all).

    Attributes
    ----------
    radius : float or shape (n_points,), [m]
        R, of the neutral line.
    bending_stiffness : [N m^2]
        EI_z, in the belt's own plane.
    tension : [N]
        N = p b R, without its centrifugal share.
    foundation : [N/m^2]
        k, lateral stiffness of the sidewalls per length of circumference.
    shear_stiffness : [N]
        S, of the belt in its own plane; infinite for Fiala's beam.
    mass : [kg/m]
        For the damping only.
    damping : [-]
        lambda of c = 2 lambda sqrt(m k), of the sidewalls' lateral springs.
    """

    radius: float | FloatArray
    bending_stiffness: float | FloatArray
    tension: float | FloatArray
    foundation: float | FloatArray
    shear_stiffness: float | FloatArray = np.inf
    mass: float | FloatArray = 0.0
    damping: float | FloatArray = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = np.asarray(getattr(self, field.name), dtype=float)
            zero, infinite = field.name in _MAY_BE_ZERO, field.name in _MAY_BE_INFINITE
            good = (value >= 0 if zero else value > 0) & (np.isfinite(value) | infinite)
            if np.isnan(value).any() or not good.all():
                raise ParameterError(
                    f"lateral belt: {field.name} = {value[~good].flat[0]:.6g}; a finite number "
                    f"{'>=' if zero else '>'} 0 is needed; check the tire's lateral values"
                )

    @classmethod
    def of(
        cls,
        tire: Tire,
        pressure: float | FloatArray,
        shear_stiffness: float | FloatArray = np.inf,
    ) -> "LateralBelt":
        """Return the lateral beam of a tire at inflation pressures [Pa].

        Raises
        ------
        ParameterError
            If a pressure is negative.
        """
        p = np.asarray(pressure, dtype=float)
        if not (np.isfinite(p) & (p >= 0)).all():
            raise ParameterError(
                f"lateral belt: inflation pressure {np.min(p) / 1e5:g} bar; a finite number >= 0 "
                "is needed, gauge"
            )
        return cls(
            radius=tire.ring_radius,
            bending_stiffness=tire.lateral_bending,
            tension=p * tire.belt_width * tire.ring_radius,
            foundation=tire.lateral_stiffness,
            shear_stiffness=shear_stiffness,
            mass=tire.mass,
            damping=tire.damping,
        )


@dataclass(frozen=True, slots=True)
class LateralDeflection:
    """Harmonics of the belt's lateral displacement, f(phi) = Re sum F_n exp(i n phi).

    Attributes
    ----------
    displacement : shape (n_points, n_modes + 1), [m]
        w, to the left.
    bend : shape (n_points, n_modes + 1), [1/m]
        theta'(s): a fibre at y is stretched by -y times it.
    moment : shape (n_points, n_modes + 1), [N]
        M, shear moment per length: what the belt's shear does to the fibres is the line load
        q_v = -M y / sum y^2 on each strip.
    reaction : shape (n_points, n_modes + 1), [N/m]
        Force of the belt on the sidewalls, to the left: k w with its damping.
    """

    displacement: ComplexArray
    bend: ComplexArray
    moment: ComplexArray
    reaction: ComplexArray

    def strain(self, lateral: FloatArray) -> ComplexArray:
        """Return harmonics of the circumferential strain at lateral positions (n_gages,), [m].

        Shape (n_points, n_gages, n_modes + 1).
        """
        out: ComplexArray = -np.asarray(lateral, dtype=float)[:, None] * self.bend[:, None, :]
        return out


def bend_belt(
    belt: LateralBelt,
    force: ComplexArray,
    omega: float | FloatArray = 0.0,
    *,
    yaw_compliance: float | ComplexArray = 0.0,
    free_yaw: float | ComplexArray = 0.0,
) -> LateralDeflection:
    """Return the periodic belt under a lateral line load.

    Parameters
    ----------
    belt : LateralBelt
    force : shape (n_points, n_modes + 1), [N/m]
        Harmonics of the lateral line load over the wheel angle, road on tire, left positive.
    omega : [rad/s]
        Turn rate, one value or one per point; acts on damping only.
    yaw_compliance : shape (n_points, n_modes + 1) or 0, [1/N]
        c_V, how far the strips' fibres shift, v = -y c_V M, under the shear moment.
    free_yaw : shape (n_points, n_modes + 1) or 0, [rad]
        V_0, the shift dv/dy that has other causes.

    Raises
    ------
    ParameterError
        If the turn rate is not finite, or the load has another shape.
    """
    if force.ndim != 2:
        raise ParameterError(
            f"lateral belt: force has shape {force.shape}; (n_points, n_modes + 1) is needed"
        )
    r, ei, tension, k, shear, m, lam, w = columns(
        belt.radius,
        belt.bending_stiffness,
        belt.tension,
        belt.foundation,
        belt.shear_stiffness,
        belt.mass,
        belt.damping,
        omega,
    )
    if not np.isfinite(w).all():
        raise ParameterError("lateral belt: the turn rate is not a finite number; give it in rad/s")
    n = np.arange(force.shape[1], dtype=float)
    wave = n / r
    # stiffness of the rotation: shear, bending and the strips' shift in series; none for n = 0
    series = ei * wave**2 / (1.0 + ei * wave**2 * (1.0 / shear + yaw_compliance + 0j))
    foundation: ComplexArray = k * (1.0 + 1j * n * w * 2.0 * lam * np.sqrt(m / k))
    total = foundation + tension * wave**2 + wave**2 * series
    displacement: ComplexArray = (force + 1j * wave * series * free_yaw) / total
    moment: ComplexArray = series * (1j * wave * displacement + free_yaw)
    bend: ComplexArray = 1j * moment / (ei * np.where(n == 0, 1.0, wave))
    reaction: ComplexArray = foundation * displacement
    return LateralDeflection(displacement, bend, moment, reaction)


@dataclass(frozen=True, slots=True)
class BeamConstants:
    """Constants of the infinite beam, each of shape (n_points,).

    Attributes
    ----------
    mean, split : [1/m]
        The decay rates are mean +- split; a complex split makes the beam swing back.
    bending : [N m^2]
        EI_z (1 + N / S), what remains of bending beside shear.
    shear_length : [m^2]
        EI_z / S: w is w_E - (EI_z / S) w_E'', with the shear-rigid beam's w_E.
    """

    mean: FloatArray
    split: ComplexArray
    bending: FloatArray
    shear_length: FloatArray

    @classmethod
    def of(cls, belt: LateralBelt) -> "BeamConstants":
        """Map the beam with shear to one without: EI(1 + N/S), N + k EI/S, k give the same bend."""
        ei, tension, k, shear = (
            column[:, 0]
            for column in columns(
                belt.bending_stiffness, belt.tension, belt.foundation, belt.shear_stiffness
            )
        )
        bending = ei * (1.0 + tension / shear)
        pull = (tension + k * ei / shear) / bending
        spring = 2.0 * np.sqrt(k / bending)
        mean = 0.5 * np.sqrt(pull + spring)
        split = 0.5 * np.sqrt((pull - spring).astype(complex))
        return cls(mean, split, bending, ei / shear)

    @property
    def decay_length(self) -> FloatArray:
        """Distance over which the slower wave falls to 1/e, [m]."""
        out: FloatArray = 1.0 / (self.mean - self.split.real)
        return out


def infinite_beam(belt: LateralBelt, distance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return displacement and bend of the endless beam under a unit point load.

    With the decay rates mean +- split, C = cosh(split x) and D = sinh(split x) / split,

        w_E = exp(-mean x) (C + mean D) / (4 EI mean (mean^2 - split^2)),
        w_E'' = -exp(-mean x) (C - mean D) / (4 EI mean).

    Parameters
    ----------
    belt : LateralBelt
        Its radius, mass and damping are not used.
    distance : shape (n_points or 1, n_x), [m]
        From the load.

    Returns
    -------
    displacement : shape (n_points, n_x), [m/N]
        w, along the load.
    bend : shape (n_points, n_x), [1/(m N)]
        theta'.

    Raises
    ------
    ParameterError
        If the distances have another shape.
    """
    if distance.ndim != 2:
        raise ParameterError(
            f"lateral belt: distance has shape {distance.shape}; (n_points, n_x) is needed"
        )
    beam = BeamConstants.of(belt)
    mean, split = beam.mean[:, None], beam.split[:, None]
    x = np.abs(distance)
    # growing and falling halves apart: cosh alone would overflow far away
    slow, fast = np.exp((split - mean) * x), np.exp(-(split + mean) * x)
    cosine = 0.5 * (slow + fast).real
    small = np.abs(split) * x < 1e-4
    safe = np.where(np.abs(split) > 0, split, 1.0)
    series = x * (1.0 + (split * x) ** 2 / 6.0) * np.exp(-mean * x)
    sine = np.where(small, series, 0.5 * (slow - fast) / safe).real
    product = (mean**2 - split**2).real
    unit = 0.25 / (beam.bending[:, None] * mean)
    bend: FloatArray = -unit * (cosine - mean * sine)
    displacement: FloatArray = (
        unit / product * (cosine + mean * sine) - beam.shear_length[:, None] * bend
    )
    return displacement, bend
