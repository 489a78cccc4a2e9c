"""The rolling ring on the road as reports show it: shape, pressure, shear, strain and strain rate.

Signs: wheel angle 0 below the axle, entry (leading edge) < 0 < exit; u outward, v and shear along
+phi (toward the exit at the road), pressure on the tire inward positive, strain positive in
tension.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import FIELDS, Tire
from tirelib.core.threads import one_thread
from tirelib.core.units import from_si
from tirelib.measured.features.peaks import peak
from tirelib.physics.contact import radial, shear
from tirelib.physics.contact.free_boundary import ComplianceAt
from tirelib.physics.contact.radial import RadialContact
from tirelib.physics.contact.shear import ShearContact
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import ComplexArray, Ring
from tirelib.physics.strain.innerliner import strain_harmonics
from tirelib.report.simulation_series import (
    FINE_ANGLES_PER_ANGLE,
    N_SERIES,
    Peaks,
    find_peaks,
    fine_grid,
    long_series,
    modes,
    nodes,
    on_grid,
)

CONTACTS = ("radial", "shear")
N_SHEAR_NODES = 80
N_ANGLES = 1441
"""A quarter of a degree."""
PHI = np.linspace(-np.pi, np.pi, N_ANGLES)
"""Angles of the curves, [rad]."""
LARGEST_BELT_SPEED = 150.0
"""Turn rate times ring radius up to which a tire is rolled, [m/s], 540 km/h: tires are rated to 300
km/h and, as (Y), beyond (UN Regulation 30). Half would refuse the symbols W and Y, double would let
a turn rate pass that is a speed in km/h. The linear ring has no limit of its own."""
MICRO = 1e6


@dataclass(frozen=True, slots=True)
class Simulation:
    """The tire on the road at one or more operating points.

    Attributes
    ----------
    contact : str
        radial: tread springs along the radius only; shear: tread pressed and sheared, free rolling
        of Eq. (103), (104).
    inflation, turn_rate, load, deflection : shape (n_points,), [Pa], [rad/s], [N], [m]
    edges : shape (n_points, 2), [rad]
    middle_pressure, pressure_centre : shape (n_points,), [N/m], [m]
        Pressure at the middle of the contact; R int q sin / int q cos, negative toward the entry.
    phi : shape (n_phi,), [rad]
        From -pi to pi.
    u, v : shape (n_points, n_phi), [m]
    pressure : shape (n_points, n_phi), [N/m]
        Inward, along the wheel's radius (radial) or the deformed belt's normal (shear).
    normal, shear : shape (n_points, n_phi), [N/m]
        Traction of the road on the tire along the road's normal, and along the road toward the
        exit, per length of belt.
    strain, rate : shape (n_points, n_phi), [-], [1/rad]
        At the innerliner; the rate per angle (times the turn rate it is per second).
    effective_radius, torque, sliding_onset : shape (n_points,) or None, [m], [N m], [rad]
        R_e, moment of the road about the axle along +phi, and where sliding begins (NaN: nowhere).
        The radial contact knows none of them.
    fine_peaks : Peaks or None
        Extremes between the angles of `phi`, where they are known: the strain rate has a kink where
        the tread begins to slide.
    gage : shape (n_points, n_phi) or None, [-]
        Gage signal of a model file: the waveform as the gage and its filter give it, which
        `compare` uses.
    """

    tire: Tire
    contact: str
    inflation: FloatArray
    turn_rate: FloatArray
    load: FloatArray
    deflection: FloatArray
    edges: FloatArray
    middle_pressure: FloatArray
    pressure_centre: FloatArray
    phi: FloatArray
    u: FloatArray
    v: FloatArray
    pressure: FloatArray
    normal: FloatArray
    shear: FloatArray
    strain: FloatArray
    rate: FloatArray
    effective_radius: FloatArray | None = None
    torque: FloatArray | None = None
    sliding_onset: FloatArray | None = None
    fine_peaks: Peaks | None = None
    gage: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.load.size)

    @property
    def contact_angle(self) -> FloatArray:
        """Trailing minus leading edge, [rad], shape (n_points,)."""
        angle: FloatArray = self.edges[:, 1] - self.edges[:, 0]
        return angle

    @property
    def contact_length(self) -> FloatArray:
        """Contact angle times the ring's radius: length of belt over the contact, [m]."""
        return self.contact_angle * self.tire.ring_radius

    @property
    def largest_pressure(self) -> FloatArray:
        """Largest pressure, by a parabola through three angles, [N/m], shape (n_points,)."""
        turn = np.ones(self.phi.size, dtype=np.bool_)
        return peak(self.pressure, turn, float(self.phi[0]), 1.0)[1]

    @property
    def peaks(self) -> Peaks:
        """Extremes of strain and strain rate."""
        if self.fine_peaks is not None:
            return self.fine_peaks
        return find_peaks(self.phi, self.strain, self.rate, self.edges)

    def belt(self) -> tuple[FloatArray, FloatArray]:
        """Return x (forward) and z (up) of the belt from the axle, shape (n_points, n_phi), [m]."""
        sin, cos, r = np.sin(self.phi), np.cos(self.phi), self.tire.ring_radius + self.u
        x: FloatArray = -r * sin - self.v * cos
        z: FloatArray = -r * cos + self.v * sin
        return x, z


@one_thread()
def simulate(
    tire: Tire,
    *,
    load: float | Sequence[float] | FloatArray | None = None,
    deflection: float | Sequence[float] | FloatArray | None = None,
    inflation: float | Sequence[float] | FloatArray | None = None,
    turn_rate: float | Sequence[float] | FloatArray = 0.0,
    contact: str = "radial",
) -> Simulation:
    """Press the rolling tire onto the road, at one or many operating points.

    Parameters
    ----------
    load, deflection : scalar or shape (n_points,), [N], [m]
        One of the two.
    inflation : scalar or shape (n_points,), [Pa]
        The tire's own by default.
    turn_rate : scalar or shape (n_points,), [rad/s]
    contact : str
        radial or shear.

    Raises
    ------
    ParameterError
        If not exactly one of load and deflection is given, numbers of points differ, a value is
        outside the model's range, or the tread is pressed through, Eq. (52).
    ConvergenceError
        If the contact does not settle.
    """
    if (load is None) == (deflection is None):
        given = "neither load nor deflection" if load is None else "both load and deflection"
        raise ParameterError(
            f"simulation: {given}; give exactly one, because the other one follows from the model"
        )
    if contact not in CONTACTS:
        raise ParameterError(
            f"simulation: contact {contact!r} is unknown; allowed are {', '.join(CONTACTS)}"
        )
    pressed = load if load is not None else deflection
    own = tire.pressure if inflation is None else inflation
    target, p, omega = points_of(pressed, own, turn_rate)
    check_range("inflation pressure", p, FIELDS["pressure"].highest, "bar", "pressure")
    check_turn_rate(tire, omega)
    n_modes, tread = modes(tire, p), Tread.of(tire)
    at = _ring_at(tire, p, omega, n_modes)
    if contact == "shear":
        press_sheared = shear.load if load is not None else shear.press
        sheared = press_sheared(at, tread, shear.Shear.of(tire), target, n_nodes=N_SHEAR_NODES)
        _check_tread(tire, sheared.load, sheared.compression)
        return _sheared(tire, sheared, p, omega)
    press_radially = radial.load if load is not None else radial.press
    pressed_radially = press_radially(at, tread, target, n_nodes=nodes(n_modes))
    _check_tread(tire, pressed_radially.load, pressed_radially.delta)
    return _radial(tire, pressed_radially, p, omega)


def points_of(*given: Any) -> tuple[FloatArray, ...]:
    """Return the values of every operating point, one shape."""
    arrays = [np.atleast_1d(np.asarray(value, dtype=float)) for value in given]
    count = max(array.size for array in arrays)
    for array in arrays:
        if array.ndim > 1 or array.size not in (1, count):
            raise ParameterError(
                f"simulation: {array.size} values where the longest list has {count}; give one "
                "value, or as many as the longest list"
            )
    return tuple(np.broadcast_to(array, (count,)).copy() for array in arrays)


def check_turn_rate(tire: Tire, turn_rate: FloatArray) -> None:
    """Refuse turn rates, [rad/s], with which no tire's belt runs.

    Raises
    ------
    ParameterError
    """
    check_range(
        "turn rate",
        turn_rate,
        LARGEST_BELT_SPEED / tire.ring_radius,
        "rad/s",
        "angular_speed",
        f"no tire's belt runs faster than {from_si(LARGEST_BELT_SPEED, 'km/h', 'speed'):.0f} km/h; "
        "check value and unit",
    )


def check_range(
    what: str,
    value: FloatArray,
    highest: float,
    unit: str,
    dimension: str,
    reason: str = "check value and unit",
) -> None:
    """Refuse values below 0 or above the highest, and what is no number.

    Raises
    ------
    ParameterError
    """
    good = (value >= 0.0) & (value <= highest)  # NaN is not
    if not good.all():
        most, found = (from_si(x, unit, dimension) for x in (highest, float(value[~good][0])))
        raise ParameterError(
            f"simulation: {what} = {found:g} {unit}; the model holds from 0 to {most:g} {unit}; "
            f"{reason}"
        )


def _ring_at(
    tire: Tire, p: FloatArray, omega: FloatArray, n_modes: int
) -> Compliance | ComplianceAt:
    """Return the ring's compliance, as a function of deflection where the sidewall softens."""

    def at(deflection: FloatArray) -> Compliance:
        return compliance(Ring.of(tire, p, deflection), omega, n_modes)

    if tire.radial_deflection_rate:
        return at
    return compliance(Ring.of(tire, p), omega, n_modes)


def _check_tread(tire: Tire, load: FloatArray, compression: FloatArray) -> None:
    """Refuse a tread without thickness left, Eq. (52)."""
    deepest = compression.max(axis=1)
    if (deepest >= tire.tread_thickness).any():
        point = int(np.argmax(deepest))
        raise ParameterError(
            f"simulation: point {point} at Fz = {load[point]:.0f} N presses the tread by "
            f"{1e3 * deepest[point]:.2f} mm; its thickness is {1e3 * tire.tread_thickness:g} mm, "
            "Eq. (52); lower the load or check the tread's stiffness"
        )


def _radial(tire: Tire, found: RadialContact, p: FloatArray, omega: FloatArray) -> Simulation:
    """Evaluate a radial contact on the grid of angles."""
    q = found.pressure_at(PHI)
    middle = found.pressure_at(found.edges.mean(axis=1)[:, None])[:, 0]
    tractions = middle, q, q * np.cos(PHI), -q * np.sin(PHI)
    return _simulation(tire, found, p, omega, tractions, found.displacement)


def _sheared(tire: Tire, found: ShearContact, p: FloatArray, omega: FloatArray) -> Simulation:
    """Evaluate a contact with tread shear on the grid of angles."""
    middle = _tractions(found, found.edges.mean(axis=1)[:, None])[0][:, 0]
    ring = compliance(Ring.of(tire, p, found.deflection), omega, N_SERIES)
    belt = long_series(found, ring, N_ANGLES)
    done = _simulation(tire, found, p, omega, (middle, *_tractions(found, PHI)), belt)
    return replace(
        done,
        effective_radius=found.effective_radius,
        torque=found.torque,
        sliding_onset=found.sliding_onset,
    )


def _simulation(
    tire: Tire,
    found: RadialContact | ShearContact,
    p: FloatArray,
    omega: FloatArray,
    tractions: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    displacement: ComplexArray,
) -> Simulation:
    """Return curves from tractions (pressure in the middle, pressure, normal, shear) and belt."""
    middle, pressure, normal, along = tractions
    wave = strain_harmonics(displacement, tire.ring_radius, tire.offset_at(p))
    slope = wave * 1j * np.arange(wave.shape[-1])
    waves = (displacement[..., 0], displacement[..., 1], wave, slope)
    fine = [on_grid(x, FINE_ANGLES_PER_ANGLE * (N_ANGLES - 1)) for x in waves]
    u, v, strain, rate = (x[:, ::FINE_ANGLES_PER_ANGLE].copy() for x in fine)
    return Simulation(
        tire,
        "radial" if isinstance(found, RadialContact) else "shear",
        p,
        omega,
        found.load,
        found.deflection,
        found.edges,
        middle,
        found.pressure_centre,
        PHI,
        u,
        v,
        pressure,
        normal,
        along,
        strain,
        rate,
        fine_peaks=find_peaks(fine_grid(N_ANGLES), fine[2], fine[3], found.edges),
    )


def _tractions(found: ShearContact, phi: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pressure, and traction along the road's normal and along the road, zero outside."""
    tread, inside = found.elements_at(phi), found.inside(phi)
    sin, cos = np.sin(phi), np.cos(phi)
    outward, along = tread.loads[..., 0], tread.loads[..., 1]
    return (
        np.where(inside, -tread.normal, 0.0),
        np.where(inside, along * sin - outward * cos, 0.0),
        np.where(inside, along * cos + outward * sin, 0.0),
    )
