"""State of a model at every operating point, on the way from tire to waveform.

An effect takes a state and a strength and returns a changed state (`State.but`); it never changes
its argument. All arrays have one row per operating point, SI, ISO signs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import offset_at
from tirelib.physics.contact.free_boundary import Start
from tirelib.physics.contact.radial import RadialContact
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.ring import ComplexArray, Ring


@dataclass(frozen=True, slots=True)
class Operating:
    """Conditions of operating points, arrays of shape (n_points,); NaN where unknown.

    Attributes
    ----------
    load : [N]; pressure : [Pa]; omega : [rad/s]; speed : [m/s]
    camber, slip_angle : [rad]; slip_ratio : [-]
    side_force, drive_force : [N]
        Fy and Fx of the tire.
    order : [-]
        Place in the campaign, 0 first to 1 last.
    temperature : [K]
    """

    load: FloatArray
    pressure: FloatArray
    omega: FloatArray
    speed: FloatArray
    camber: FloatArray
    slip_angle: FloatArray
    slip_ratio: FloatArray
    side_force: FloatArray
    drive_force: FloatArray
    order: FloatArray
    temperature: FloatArray

    def __len__(self) -> int:
        return int(self.load.shape[0])

    def tiled(self, times: int) -> "Operating":
        """Return the points repeated one after the other."""
        return Operating(*[np.tile(getattr(self, name), times) for name in self.__slots__])

    def followed_by(self, more: "Operating") -> "Operating":
        """Return these points and then others."""
        pairs = ((getattr(self, name), getattr(more, name)) for name in self.__slots__)
        return Operating(*[np.concatenate(pair) for pair in pairs])

    def take(self, index: Any) -> "Operating":
        """Return some of the points."""
        return Operating(*[getattr(self, name)[index] for name in self.__slots__])

    def nearest(self, others: "Operating") -> IntArray:
        """Return which of these points is nearest to each of others, by load and pressure."""
        load, pressure = (
            getattr(others, name)[:, None] / getattr(self, name) for name in ("load", "pressure")
        )
        return np.asarray(np.argmin(np.log(load) ** 2 + np.log(pressure) ** 2, axis=1))


READ = frozenset(
    {
        *("pressure", "ring_radius", "free_radius", "belt_width", "tread_thickness"),
        *("innerliner_offset", "bending_stiffness", "mass", "radial_stiffness"),
        *("radial_pressure_slope", "tangential_stiffness", "tangential_pressure_slope", "damping"),
        *("extension_stiffness", "shear_stiffness", "rotary_inertia", "tread_stiffness"),
        *("tread_hardening", "offset_pressure_slope"),
    }
)
"""Values of a tire that a state reads: the linear ring and its contact know no others."""


LATER: Any = None
"""What a field holds until the chain has come to its stage."""


@dataclass(frozen=True, slots=True)
class State:
    """Operating points with the model's constants there, and what has been computed so far.

    Attributes
    ----------
    conditions : Operating
    radius, free_radius, width, thickness, offset : shape (n_points,), [m]
        Ring radius R, free radius R0, belt width b, tread thickness h0, gage offset y < 0.
    EI, mass, tension_pressure, k_u, k_v, softening, damping, EA, GA, rotary_inertia, inertia_share,
    tension, dashpots
        Parameters of the ring (`tirelib.physics.ring.ring.Ring`); tension_pressure is p of the
        tension p b R, and GA is the tire's less that tension.
    k_t, hardening
        Parameters of the tread (`tirelib.physics.contact.tread.Tread`).
    lateral : float, [m]
        Position of the gage (ISO, left positive).
    deflection : shape (n_points,), [m]
        d0 that the constants follow; at the contact stage and later, that of the solution.
    start : Start or None
        Solution of a contact nearby; it only saves time.
    contact : RadialContact
        From the contact stage on, as the next three; `LATER` before.
    belt : shape (n_points, n_modes + 1, 3)
        Harmonics of u, v [m] and beta [rad], from the contact stage on.
    strain : shape (n_points, n_modes + 1)
        Harmonics of the innerliner strain, from the strain stage on.
    phi : shape (n_phi,), [rad]
    waveform : shape (n_points, n_phi)
        Filtered strain over wheel angle, at the gage stage.
    """

    conditions: Operating
    radius: FloatArray
    free_radius: FloatArray
    width: FloatArray
    thickness: FloatArray
    offset: FloatArray
    EI: FloatArray
    mass: FloatArray
    tension_pressure: FloatArray
    k_u: FloatArray
    k_v: FloatArray
    softening: FloatArray
    damping: FloatArray
    EA: FloatArray
    GA: FloatArray
    rotary_inertia: FloatArray
    inertia_share: FloatArray
    tension: FloatArray
    dashpots: FloatArray
    k_t: FloatArray
    hardening: FloatArray
    phi: FloatArray
    deflection: FloatArray
    lateral: float = 0.0
    start: Start | None = None
    contact: RadialContact = LATER
    belt: ComplexArray = LATER
    strain: ComplexArray = LATER
    waveform: FloatArray = LATER

    @classmethod
    def of(
        cls, values: Mapping[str, float | FloatArray], conditions: Operating, phi: FloatArray
    ) -> "State":
        """Return the state of a tire's values (names of `Tire`; arrays allowed) at conditions."""
        n = len(conditions)

        def column(name: str) -> FloatArray:
            out = np.full(n, values[name], dtype=float)
            out.setflags(write=False)  # no law changes its argument
            return out

        above = conditions.pressure - column("pressure")
        state = cls(
            conditions=conditions,
            radius=column("ring_radius"),
            free_radius=column("free_radius"),
            width=column("belt_width"),
            thickness=column("tread_thickness"),
            offset=offset_at(
                column("innerliner_offset"),
                column("offset_pressure_slope"),
                conditions.pressure,
                column("pressure"),
            ),
            EI=column("bending_stiffness"),
            mass=column("mass"),
            tension_pressure=conditions.pressure,
            k_u=column("radial_stiffness") + column("radial_pressure_slope") * above,
            k_v=column("tangential_stiffness") + column("tangential_pressure_slope") * above,
            softening=np.zeros(n),
            damping=column("damping"),
            EA=column("extension_stiffness"),
            GA=column("shear_stiffness"),
            rotary_inertia=column("rotary_inertia"),
            inertia_share=np.ones(n),
            tension=np.zeros(n),
            dashpots=np.zeros(n),
            k_t=column("tread_stiffness"),
            hardening=column("tread_hardening"),
            phi=phi,
            deflection=np.full(n, np.nan),
        )
        # the tension acts along the sections' normal and takes its own size from their stiffness
        return state.but(GA=state.GA - state.belt_tension)

    def but(self, **changes: Any) -> "State":
        """Return the state with some fields replaced."""
        held = [*_HELD(self)]
        for name, value in changes.items():
            if name not in _PLACE:
                raise TypeError(f"a state has no field {name!r}; it has {', '.join(_PLACE)}")
            held[_PLACE[name]] = value
        return State(*held)

    @property
    def wave(self) -> FloatArray:
        """The waveform of a state that the chain has brought to the gage stage.

        Raises
        ------
        ParameterError
            If it has not.
        """
        if self.waveform is LATER:
            raise ParameterError(
                "state: it holds no waveform yet; solve it with `tirelib.model.chain.waveform`"
            )
        return self.waveform

    @property
    def belt_tension(self) -> FloatArray:
        """Tension p b R + rho A R^2 Omega^2 of the whole belt and what effects add, (n,), [N]."""
        spin = self.mass * (self.radius * np.asarray(self.conditions.omega)) ** 2
        blown = self.tension_pressure * self.width * self.radius
        return blown + self.inertia_share * spin + self.tension

    @property
    def ring(self) -> Ring:
        """The ring of every point."""
        return Ring(
            radius=self.radius,
            bending_stiffness=self.EI,
            mass=self.mass,
            inflation=self.tension_pressure * self.width,
            radial_stiffness=self.k_u * self._secant,
            tangential_stiffness=self.k_v,
            damping=self.damping,
            dashpots=self.dashpots,
            extension_stiffness=self.EA,
            shear_stiffness=self.GA,
            rotary_inertia=self.rotary_inertia,
            inertia_share=self.inertia_share,
            tension=self.tension,
        )

    @property
    def _secant(self) -> FloatArray:
        """The softening sidewall's secant over its tangent at rest: the linear ring's share."""
        fall = self.softening * self.deflection
        safe = np.where(fall == 0.0, 1.0, fall)
        return np.where(self.softening == 0.0, 1.0, -np.expm1(-fall) / safe)

    @property
    def tread(self) -> Tread:
        """The tread of every point."""
        return Tread(self.free_radius, self.k_t, self.thickness, self.hardening)


_PLACE = {field.name: place for place, field in enumerate(fields(State))}
_HELD = attrgetter(*_PLACE)
CONSTANTS = tuple(
    field.name
    for field in fields(State)
    if field.name
    not in (
        "conditions",
        "phi",
        "deflection",
        "start",
        "contact",
        "belt",
        "strain",
        "waveform",
    )
)
"""Fields of a state that ring and tread are made of."""
