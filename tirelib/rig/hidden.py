"""Hidden effects of the rig: what a benchmark plants and a diagnosis has to find.

Every law is another one than the library's catalogue has for the effect of that name (power laws,
saturation, memory, steps instead of exponentials, viscous terms and smooth slopes), and some
effects are in no catalogue. At strength zero the rig is what it is without.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from tirelib.core.errors import ParameterError
from tirelib.rig import shown
from tirelib.rig.hidden_effect import MICROSTRAIN, SQUARE_MM, Hidden, Stated
from tirelib.rig.laws import (
    LossModulus,
    RearSliding,
    RegularCoulomb,
    SectionInertia,
    SidewallPull,
    StorageModulus,
    WaterWedge,
)
from tirelib.rig.tire import Condition, RigTire


def _sidewall(tire: RigTire, radial: float, tangential: float) -> RigTire:
    return replace(
        tire,
        sidewall_radial=tire.sidewall_radial * radial,
        sidewall_radial_offset=tire.sidewall_radial_offset * radial,
        sidewall_tangential=tire.sidewall_tangential * tangential,
        sidewall_tangential_offset=tire.sidewall_tangential_offset * tangential,
    )


def _set(tire: RigTire, cond: Condition, place: float, s: float, *, name: str) -> RigTire:
    changed: dict[str, Any] = {name: s}
    return replace(tire, **changed)


def _law(
    tire: RigTire, cond: Condition, place: float, s: float, *, of: str, law: Callable[[float], Any]
) -> RigTire:
    more: dict[str, Any] = {of: (*getattr(tire, of), law(s))}
    return replace(tire, **more)


def _buckled_when_slack(tire: RigTire, cond: Condition, place: float, s: float) -> RigTire:
    slack = max(0.0, 1.0 - cond.pressure / 2.1e5)
    return _sidewall(tire, 1.0 - s * slack, 1.0 - 0.3 * s * slack)


def _warm(tire: RigTire, cond: Condition, place: float, s: float) -> RigTire:
    soft = 1.0 / (1.0 + s * float(1.0 - np.exp(-3.0 * place)))
    return replace(_sidewall(tire, soft, soft), tread_normal=tire.tread_normal * soft**0.8)


def _shear(tire: RigTire, cond: Condition, place: float, s: float) -> RigTire:
    return replace(tire, shear=1.0 / (1.0 / tire.shear + s))


def _storage(tire: RigTire, cond: Condition, place: float, s: float) -> RigTire:
    faster = (cond.speed / 20.0) ** (0.8 * s)
    law = StorageModulus(s)
    return replace(tire, belt_laws=(*tire.belt_laws, law), tread_normal=tire.tread_normal * faster)


def _grooves(tire: RigTire, cond: Condition, place: float, s: float) -> RigTire:
    closed = (cond.load - 4000.0) / (cond.load + 4000.0)
    return replace(tire, tread_normal=tire.tread_normal * (1.0 + 2.0 * s * closed))


def _worn(tire: RigTire, cond: Condition, place: float, s: float) -> RigTire:
    left = 1.0 - s * float(1.0 - np.exp(-2.0 * place))
    return replace(
        tire,
        tread_thickness=tire.tread_thickness * left,
        tread_normal=tire.tread_normal * left**-1.5,
    )


_EFFECTS = (
    # in the catalogue
    Hidden(
        "sidewall_load",
        "local sidewall force saturates: k_u u (1 - s u^2 / (u^2 + L^2))",
        0.3,
        0.9,
        "1",
        on_tire=partial(_set, name="sidewall_softening"),
    ),
    Hidden(
        "sidewall_pressure",
        "sidewall plies buckle below 2.1 bar: a kink over pressure",
        0.8,
        3.0,
        "1",
        signed=True,
        on_tire=_buckled_when_slack,
    ),
    Hidden(
        "sidewall_damping",
        "loss modulus with the root of frequency, no storage part",
        0.15,
        0.8,
        "1",
        on_tire=partial(_law, of="belt_laws", law=LossModulus),
    ),
    Hidden(
        "temperature",
        "warm-up that saturates with the run: 1 / (1 + s (1 - exp(-3 o)))",
        0.3,
        1.5,
        "1",
        on_tire=_warm,
    ),
    Hidden(
        "centrifugal",
        "dead pull of the flung sidewalls, mostly at the belt's edges",
        0.5,
        2.5,
        "1",
        on_tire=partial(_law, of="belt_laws", law=SidewallPull),
    ),
    Hidden(
        "rotary_inertia",
        "inertia of sections that turn by their own angle, not the slope",
        1.5e-4,
        2e-4,
        "kg m",
        on_tire=partial(_law, of="belt_laws", law=SectionInertia),
    ),
    Hidden(
        "belt_shear",
        "sections of the exact beam, 1 / GA + s",
        2e-5,
        2e-4,
        "1/N",
        on_tire=_shear,
        stated=Stated("1/kN", 1e3),
    ),
    Hidden(
        "dynamic_stiffening",
        "storage modulus with a power of frequency, per harmonic",
        0.15,
        0.8,
        "1",
        on_tire=_storage,
    ),
    Hidden(
        "tread_friction",
        "Coulomb friction, regularised by tanh about the contact's middle",
        0.05,
        0.9,
        "1",
        on_tire=partial(_law, of="road_laws", law=RegularCoulomb),
    ),
    Hidden(
        "tread_load",
        "grooves that close: stiffness saturates with load",
        0.3,
        0.9,
        "1",
        signed=True,
        on_tire=_grooves,
    ),
    Hidden(
        "tread_wear",
        "wear that slows down, stiffness with thickness^-1.5",
        0.2,
        0.7,
        "1",
        on_tire=_worn,
    ),
    Hidden(
        "trailing_sliding",
        "sliding behind a hard step, made up for by the sticking part",
        0.1,
        0.8,
        "1",
        on_tire=partial(_law, of="road_laws", law=RearSliding),
    ),
    Hidden(
        "hydroplaning",
        "wedge of water 30 mm ahead of the contact",
        0.15,
        0.6,
        "1",
        on_tire=partial(_law, of="road_laws", law=WaterWedge),
    ),
    Hidden(
        "roughness",
        "asperities of evenly spread height under every bristle",
        4e-4,
        4e-3,
        "m",
        on_tire=partial(_set, name="tread_roughness"),
        stated=SQUARE_MM,
    ),
    Hidden(
        "nonuniformity",
        "stiff sector: a smooth pulse once per turn, and its load",
        60e-6,
        600e-6,
        "1",
        signed=True,
        on_trace=shown.stiff_sector,
        stated=MICROSTRAIN,
    ),
    Hidden(
        "gage_length",
        "bond that carries less towards the ends",
        0.02,
        0.06,
        "m",
        on_trace=shown.bonded_window,
        stated=SQUARE_MM,
    ),
    Hidden(
        "low_pass",
        "amplifier of third order",
        2.5e-4,
        2e-3,
        "s",
        on_trace=shown.third_order_filter,
        stated=Stated("ms", 1e3),
    ),
    Hidden(
        "gage_saturation",
        "glue that yields by a power of strain, more in compression",
        0.03,
        1.0,
        "1",
        on_trace=shown.soft_clip,
    ),
    Hidden(
        "gage_drift",
        "gain that creeps with the logarithm of time",
        0.05,
        0.5,
        "1",
        signed=True,
        on_trace=shown.logarithmic_creep,
    ),
    Hidden(
        "angle_zero",
        "encoder off its mark and off its axle",
        0.01,
        0.08,
        "rad",
        signed=True,
        on_trace=shown.eccentric_encoder,
    ),
    Hidden(
        "gain_load",
        "gages that come loose: gain falls with the load squared",
        0.05,
        0.4,
        "1",
        on_trace=shown.debonded,
    ),
    Hidden(
        "gain_pressure",
        "gain goes with the square root of the pressure",
        0.1,
        0.25,
        "1",
        signed=True,
        on_trace=shown.pressure_sensitive,
    ),
    Hidden(
        "gain_speed",
        "gain falls with the speed squared, as gages grow warm",
        0.05,
        0.4,
        "1",
        on_trace=shown.heated,
    ),
    # in no catalogue
    Hidden(
        "oval_tire",
        "twice per turn",
        60e-6,
        600e-6,
        "1",
        False,
        True,
        on_trace=shown.twice_per_turn,
        stated=MICROSTRAIN,
    ),
    Hidden(
        "acceleration_crosstalk",
        "gages feel the belt's acceleration",
        0.02,
        0.3,
        "1",
        False,
        True,
        on_trace=shown.feels_acceleration,
    ),
    Hidden(
        "standing_wave",
        "wave behind the contact, with the fourth power of speed",
        60e-6,
        1000e-6,
        "1",
        False,
        on_trace=shown.standing_wave,
        stated=MICROSTRAIN,
    ),
    Hidden(
        "flat_spot",
        "flat spot near the gages",
        500.0,
        5000.0,
        "N",
        False,
        True,
        on_trace=shown.flat_spot,
    ),
    Hidden(
        "edge_bump",
        "belt kinks on both sides of the contact",
        60e-6,
        800e-6,
        "1",
        False,
        True,
        on_trace=shown.edge_bump,
        stated=MICROSTRAIN,
    ),
    Hidden(
        "cubic_tread",
        "tread that hardens with the square of compression",
        10.0,
        1500.0,
        "1",
        False,
        on_tire=partial(_set, name="tread_cubic"),
    ),
    Hidden(
        "drum_road",
        "road of a drum",
        0.5,
        4.0,
        "1/m",
        False,
        on_tire=partial(_set, name="road_curvature"),
    ),
)

HIDDEN: Mapping[str, Hidden] = MappingProxyType({effect.name: effect for effect in _EFFECTS})
"""Every hidden effect by name."""


def hidden(name: str) -> Hidden:
    """Return a hidden effect by name.

    Raises
    ------
    ParameterError
        If there is none of this name.
    """
    try:
        return HIDDEN[name]
    except KeyError:
        raise ParameterError(
            f"hidden effect {name!r} is unknown; allowed are {', '.join(HIDDEN)}; choose one of "
            "them"
        ) from None
