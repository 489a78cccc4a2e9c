"""Family of rings: the library's own rolling ring with all that its base leaves out.

Crown, friction other than one and the section's pull on the belt. Every constant is redrawn by up
to a half. Sidewalls neither soften nor damp: effects that the catalogue names are hidden on purpose
only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from structure.family import PHI, POINTS, Array, Frame, Hidden, Setting
from structure.gages import GAGES
from structure.rig import shown_by_gages
from tirelib.campaign import TireGeometry
from tirelib.physics.rolling.constants import Constants
from tirelib.physics.rolling.gage import Gage
from tirelib.physics.rolling.solve import solve

BAR = 1e5
NUDGE = 10.0
"""Load by which slopes are taken [N]."""
WAYS = 3
"""Times that turn rate and sidewall follow the solution; they move by less than 1e-5 after it."""


@dataclass(frozen=True)
class RingTire:
    """Constants of a ring, SI; k_u = slope p + offset, k_v alike.

    `pull` is the share of p b R that the section takes off the belt's tension, `softening` the
    share of k_u that is lost where the tire is deflected by 20 mm.
    """

    name: str
    ring_radius: float
    belt_width: float
    tread_thickness: float
    innerliner_offset: float
    EA: float
    GA: float
    EI: float
    mass: float
    rotary_inertia: float
    radial: float
    radial_offset: float
    tangential: float
    tangential_offset: float
    k_t: float
    hardening: float
    k_s: float
    friction: float
    crown: float
    half_width: float
    creep: float
    pull: float

    @property
    def free_radius(self) -> float:
        """Radius of the tread's crown [m]."""
        return self.ring_radius + 0.0015 + self.tread_thickness


class Ring:
    """Rings with more than the base has."""

    name, number = "ring", 3
    hidden: Mapping[str, Hidden] = {**shown_by_gages(), **GAGES}

    def draw(self, seed: int, kind: str) -> RingTire:
        """Return the plain tire of a seed."""
        rng = np.random.default_rng([seed, 33])

        def times(value: float, factor: float = 1.5) -> float:
            return value * float(factor ** rng.uniform(-1.0, 1.0))

        radial, tangential = times(1.0), times(1.0)
        width, k_t = 0.168 * float(rng.uniform(0.88, 1.12)), times(5.5e7)
        # the order of the draws is part of a seed's meaning
        return RingTire(
            name=f"ring {seed}",
            ring_radius=0.303 * float(rng.uniform(0.94, 1.06)),
            belt_width=width,
            tread_thickness=times(0.0115, 1.3),
            innerliner_offset=times(-0.003),
            EA=times(4.6e6),
            GA=times(7.0e4),
            EI=times(2.4),
            mass=times(3.5),
            rotary_inertia=float(rng.uniform(1e-5, 1e-4)),
            radial=1.1 * times(radial, 1.2),
            radial_offset=2.3e5 * times(radial, 1.2),
            tangential=0.35 * times(tangential, 1.2),
            tangential_offset=1.1e5 * times(tangential, 1.2),
            k_t=k_t,
            hardening=float(rng.uniform(0.0, 2.0)),
            k_s=k_t * float(rng.uniform(0.1, 0.5)),
            friction=float(rng.uniform(0.3, 1.2)),
            crown=float(rng.uniform(0.0, 1.2)),
            half_width=0.5 * width * float(rng.uniform(0.85, 1.0)),
            creep=float(rng.uniform(0.0, 0.01)),
            pull=float(rng.uniform(0.0, 0.07)),
        )

    def geometry(self, tire: RingTire) -> TireGeometry:
        """Return what a tape measure gives."""
        return TireGeometry(
            name=tire.name,
            free_radius=tire.free_radius,
            ring_radius=tire.ring_radius,
            tread_thickness=tire.tread_thickness,
            belt_width=tire.belt_width,
            innerliner_offset=tire.innerliner_offset,
        )

    def numbers(self, tire: RingTire) -> dict[str, float]:
        """Return the constants; k_t is the secant at 2 bar, the crown left out."""
        hard = tire.hardening / tire.tread_thickness
        soft = 2.0 * BAR * tire.belt_width / tire.k_t
        deep = soft if hard == 0.0 else (np.sqrt(1.0 + 4.0 * hard * soft) - 1.0) / (2.0 * hard)
        return {
            "EI": tire.EI,
            "EA": tire.EA,
            "GA": tire.GA,
            "k_u": 2.0 * BAR * tire.radial + tire.radial_offset,
            "k_u_slope": tire.radial,
            "k_v": 2.0 * BAR * tire.tangential + tire.tangential_offset,
            "k_v_slope": tire.tangential,
            "k_t": 2.0 * BAR * tire.belt_width / float(deep),
            "k_t_soft": tire.k_t,
            "k_s": tire.k_s,
            "hardening": tire.hardening,
            "mass": tire.mass,
            "rotary_inertia": tire.rotary_inertia,
            "innerliner_offset": tire.innerliner_offset,
            "friction": tire.friction,
            "crown": tire.crown,
        }

    def frames(
        self,
        tire: RingTire,
        settings: Sequence[Setting],
        planted: Mapping[str, float],
        angle: float,
    ) -> list[Frame]:
        """Solve all runs at once; a ring has no effects that act on the tire."""
        load = np.array([s.load for s in settings])
        speed = np.array([s.speed for s in settings])
        omega = speed / (0.97 * tire.free_radius)
        found = solve(_constants(tire, settings, load, omega))
        for _ in range(WAYS - 1):
            omega = speed / found.rolling_radius
            found = solve(_constants(tire, settings, load, omega), start=found)
        omega = speed / found.rolling_radius
        more = solve(_constants(tire, settings, load + NUDGE, omega), start=found)
        zero = np.zeros(load.size)
        gage = Gage(np.full(load.size, tire.innerliner_offset), zero, zero)
        strain = found.strain(gage, POINTS)
        by_load = (more.strain(gage, POINTS) - strain) / NUDGE
        stiffness = NUDGE / (more.deflection - found.deflection)
        delta = found.on_turn(POINTS).delta
        return [
            Frame(
                s,
                float(omega[run]),
                float(tire.free_radius - found.deflection[run]),
                float(stiffness[run]),
                np.tile(_edges(delta[run]), (5, 1)),
                np.repeat(strain[run][:, None], 5, axis=1),
                np.repeat(by_load[run][:, None], 5, axis=1),
            )
            for run, s in enumerate(settings)
        ]


def _constants(tire: RingTire, settings: Sequence[Setting], load: Array, omega: Array) -> Constants:
    pressure = np.array([s.pressure for s in settings])
    inflation = pressure * tire.belt_width
    return Constants.of(
        radius=tire.ring_radius,
        free_radius=tire.free_radius,
        EA=tire.EA,
        GA=tire.GA,
        EI=tire.EI,
        mass=tire.mass,
        rotary_inertia=tire.rotary_inertia,
        inflation=inflation,
        tension=-tire.pull * inflation * tire.ring_radius,
        k_u=tire.radial * pressure + tire.radial_offset,
        k_v=tire.tangential * pressure + tire.tangential_offset,
        softening=0.0,
        dashpots=0.0,
        k_t=tire.k_t,
        hardening=tire.hardening,
        thickness=tire.tread_thickness,
        crown=tire.crown,
        half_width=tire.half_width,
        k_s=tire.k_s,
        poisson=0.0,
        friction=tire.friction,
        creep=tire.creep,
        omega=omega,
        load=load,
        torque=0.0,
    )


def _edges(delta: Array) -> Array:
    """Return the contact's edges from the overlaps over the turn [rad]."""
    inside = np.flatnonzero(delta > 0.0)
    a, b = inside[0], inside[-1]
    return np.array(
        [
            np.interp(0.0, delta[a - 1 : a + 1], PHI[a - 1 : a + 1]),
            np.interp(0.0, -delta[b : b + 2], PHI[b : b + 2]),
        ]
    )
