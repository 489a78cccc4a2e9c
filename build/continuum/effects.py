"""Effects to hide in a campaign, each by a law of its own.

A law changes the tire or the sidewall's force of a run, or what the gages show. Where the library
has an effect of the name, its law is another one: the finite elements' own (an arch that softens,
Coulomb friction, a thinner tread), a standard linear solid, saturation, roots instead of powers.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuum.observe import Trace
from continuum.polar import Array
from continuum.sidewall import SidewallLaw, at
from continuum.tire import LATERAL, Condition, Tire


@dataclass(frozen=True)
class Run:
    """Where an effect acts.

    `order` is the place in the campaign from 0 to 1, `angle` a mark on the tire [rad]; `omega`
    [rad/s] and the vertical `stiffness` [N/m] are known once the run is solved.
    """

    cond: Condition
    order: float
    angle: float
    omega: float = 0.0
    stiffness: float = 0.0


def _same_tire(tire: Tire, run: Run, s: float) -> Tire:
    return tire


def _same_law(law: SidewallLaw, run: Run, s: float) -> SidewallLaw:
    return law


def _same_trace(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    return seen


@dataclass(frozen=True)
class Effect:
    """An effect: its law in words, a strength that shows clearly, the largest, and their unit.

    `known` says whether the library's catalogue has an effect of this name.
    """

    name: str
    words: str
    visible: float
    largest: float
    unit: str
    known: bool = True
    tire: Callable[[Tire, Run, float], Tire] = _same_tire
    law: Callable[[SidewallLaw, Run, float], SidewallLaw] = _same_law
    shown: Callable[[Trace, Tire, Run, float], Trace] = _same_trace


def _rubber(tire: Tire, factor: float) -> Tire:
    return replace(
        tire,
        tread_upright=tire.tread_upright * factor,
        tread_shear=tire.tread_shear * factor,
        tread_along=tire.tread_along * factor,
    )


def _rubber_walls(law: SidewallLaw, factor: float) -> SidewallLaw:
    """Scale what the sidewalls owe to rubber, not to pressure."""
    rubber = np.array([factor, 1.0])
    return replace(law, radial=law.radial * rubber, tangential=law.tangential * rubber)


def _zener(run: Run, s: float) -> float:
    x = (run.cond.speed / 20.0) ** 2
    return 1.0 + s * x / (1.0 + x)


def _warm(run: Run, s: float) -> float:
    return 1.0 - s * float(np.sqrt(run.order))


def _buckled(law: SidewallLaw, run: Run, s: float) -> SidewallLaw:
    p = run.cond.pressure
    x = (p / 2.1e5 - 1.0) ** 2
    factor = 1.0 - s * x / (x + 0.15**2)
    return replace(law, radial=np.array([at(law.radial, p) * factor, 0.0]))


def _grooves(tire: Tire, run: Run, s: float) -> Tire:
    closed = float(np.tanh((run.cond.load - 4500.0) / 2500.0))
    return replace(tire, tread_upright=tire.tread_upright * (1.0 + s * closed))


def _filtered(seen: Trace, gain: NDArray[Any]) -> Trace:
    def turned(values: Array) -> Array:
        spectrum = np.fft.rfft(values, axis=0) * gain[:, None]
        return np.asarray(np.fft.irfft(spectrum, len(values), axis=0))

    return replace(seen, strain=turned(seen.strain), by_load=turned(seen.by_load))


def _orders(seen: Trace) -> Array:
    return np.arange(len(seen.phi) // 2 + 1, dtype=np.float64)


def _scaled(seen: Trace, gain: Array | float) -> Trace:
    return replace(seen, strain=seen.strain * gain, by_load=seen.by_load * gain)


def _bonded(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    return _filtered(seen, np.exp(-((_orders(seen) * s / tire.ring_radius) ** 2) / 24.0))


def _poles(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    return _filtered(seen, (1.0 + 1j * _orders(seen) * run.omega * s) ** -2.0)


def _yields(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    size = s * np.abs(seen.strain) / 5e-3
    safe = np.where(size > 0.0, size, 1.0)
    shown = seen.strain * np.where(size > 0.0, np.log1p(size) / safe, 1.0)
    return replace(seen, strain=shown, by_load=seen.by_load / (1.0 + size))


def _turned(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    step = s / (seen.phi[1] - seen.phi[0])
    whole, part = int(np.floor(step)), step - np.floor(step)

    def read(values: Array) -> Array:
        first = np.roll(values, -whole, axis=0)
        return np.asarray((1.0 - part) * first + part * np.roll(first, -1, axis=0))

    return replace(seen, strain=read(seen.strain), by_load=read(seen.by_load))


def _splice(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    wave = s * np.cos(seen.phi - run.angle) ** 3
    return replace(seen, strain=seen.strain + wave[:, None])


def _oval(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    swing = s * run.stiffness * np.cos(2.0 * (seen.phi - run.angle))
    return replace(seen, strain=seen.strain + seen.by_load * swing[:, None])


def _warmer_side(seen: Trace, tire: Tire, run: Run, s: float) -> Trace:
    return _scaled(seen, 1.0 - s * run.order * LATERAL / 0.06)


def _swollen(tire: Tire, run: Run, s: float) -> Tire:
    return replace(tire, innerliner_offset=tire.innerliner_offset * (1.0 + s * run.order))


_ALL = (
    Effect(
        "sidewall_load",
        "share of the arch's own nonlinear force over deflection",
        0.4,
        1.0,
        "1",
        tire=lambda t, r, s: replace(t, softening=s),
    ),
    Effect(
        "sidewall_pressure",
        "radial stiffness 1 - s x^2 / (x^2 + .15^2), x = p / 2.1 bar - 1",
        0.1,
        0.4,
        "1",
        law=_buckled,
    ),
    Effect(
        "sidewall_damping",
        "force k (w + s dw/dt): one relaxation time",
        3e-4,
        2e-3,
        "s",
        tire=lambda t, r, s: replace(t, damping=s),
    ),
    Effect(
        "temperature",
        "rubber of tread and sidewalls, not their tension, 1 - s sqrt(order)",
        0.2,
        0.6,
        "1",
        tire=lambda t, r, s: _rubber(t, _warm(r, s)),
        law=lambda w, r, s: _rubber_walls(w, _warm(r, s)),
    ),
    Effect(
        "dynamic_stiffening",
        "rubber 1 + s x / (1 + x), x = (v / 20 m/s)^2",
        0.3,
        1.5,
        "1",
        tire=lambda t, r, s: _rubber(t, _zener(r, s)),
        law=lambda w, r, s: _rubber_walls(w, _zener(r, s)),
    ),
    Effect(
        "tread_friction",
        "Coulomb friction of the rolling tread",
        0.5,
        1.2,
        "1",
        tire=lambda t, r, s: replace(t, friction=s),
    ),
    Effect(
        "tread_load",
        "tread modulus 1 + s tanh((Fz - 4500 N) / 2500 N)",
        0.2,
        0.6,
        "1",
        tire=_grooves,
    ),
    Effect(
        "tread_wear",
        "thinner tread of the same rubber, thickness 1 - s order",
        0.3,
        0.6,
        "1",
        tire=lambda t, r, s: replace(t, tread_thickness=t.tread_thickness * (1 - s * r.order)),
    ),
    Effect(
        "roughness",
        "asperities of exponential height: q = k s ln(1 + exp(depth / s))",
        2e-4,
        1e-3,
        "m",
        tire=lambda t, r, s: replace(t, roughness=s),
    ),
    Effect(
        "hydroplaning",
        "water pressed out of the gap ahead, s rho v^2 / 2 at 1 mm",
        0.15,
        0.3,
        "1",
        tire=lambda t, r, s: replace(t, water=s * 500.0 * r.cond.speed**2),
    ),
    Effect("nonuniformity", "splice: s cos^3 of the angle from it", 1e-4, 1e-3, "1", shown=_splice),
    Effect(
        "gage_length",
        "Gaussian window of standard deviation s / sqrt(12)",
        0.02,
        0.06,
        "m",
        shown=_bonded,
    ),
    Effect("low_pass", "two equal poles at 1 / s", 2e-4, 1e-3, "s", shown=_poles),
    Effect(
        "gage_saturation",
        "ln(1 + x) / x of the strain, x = s |eps| / 5000 microstrain",
        0.03,
        1.0,
        "1",
        shown=_yields,
    ),
    Effect(
        "gage_drift",
        "gain 1 - s sqrt(order)",
        0.05,
        0.5,
        "1",
        shown=lambda t, _, r, s: _scaled(t, 1.0 - s * float(np.sqrt(r.order))),
    ),
    Effect(
        "gain_load",
        "gain 1 - s tanh(Fz / 6 kN): glue gives way",
        0.1,
        0.6,
        "1",
        shown=lambda t, _, r, s: _scaled(t, 1.0 - s * float(np.tanh(r.cond.load / 6e3))),
    ),
    Effect(
        "gain_pressure",
        "gain 1 + s ln(p / 2 bar)",
        0.1,
        0.25,
        "1",
        shown=lambda t, _, r, s: _scaled(t, 1.0 + s * float(np.log(r.cond.pressure / 2e5))),
    ),
    Effect(
        "gain_speed",
        "gain 1 - s sqrt(v / 40 m/s): heat",
        0.1,
        0.5,
        "1",
        shown=lambda t, _, r, s: _scaled(t, 1.0 - s * float(np.sqrt(r.cond.speed / 40.0))),
    ),
    Effect("angle_zero", "angle read s too late", 0.01, 0.05, "rad", shown=_turned),
    Effect(
        "oval_rim",
        "rim oval by s: the load swings twice a turn",
        2e-4,
        2e-3,
        "m",
        False,
        shown=_oval,
    ),
    Effect(
        "warm_side",
        "gain falls with order and from one side to the other",
        0.05,
        0.5,
        "1",
        False,
        shown=_warmer_side,
    ),
    Effect(
        "swelling_liner",
        "liner thicker by s order: gages move from the belt",
        0.1,
        0.5,
        "1",
        False,
        tire=_swollen,
    ),
    Effect(
        "picked_up_mass",
        "tread heavier by s order",
        0.5,
        2.0,
        "1",
        False,
        tire=lambda t, r, s: replace(t, tread_density=t.tread_density * (1 + s * r.order)),
    ),
)

EFFECTS: Mapping[str, Effect] = MappingProxyType({e.name: e for e in _ALL})
"""Every effect by name."""
