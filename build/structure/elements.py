"""Family of the rolling continuum: finite elements (`continuum`), as widely as it draws them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, replace
from typing import Any

import numpy as np
from continuum.campaign import LOADS, PRESSURES, SPEEDS, ring_numbers
from continuum.effects import EFFECTS, Run
from continuum.grid import grid
from continuum.observe import Trace, trace
from continuum.solve import Model, State, model, solve
from continuum.tire import Condition, Tire, draw

from structure.family import PHI, POINTS, Array, Frame, Hidden, Setting
from structure.gages import GAGES
from tirelib.campaign import TireGeometry

CREEP = 0.008
"""Slip at which friction has 71 % of its full value; half of it leaves a third unsolved."""


def _law(name: str) -> Any:
    def shown(frame: Frame, tire: Tire, angle: float, strength: float) -> Frame:
        s = frame.setting
        run = Run(
            Condition(s.load, s.pressure, s.speed), s.place, angle, frame.omega, frame.stiffness
        )
        seen = Trace(PHI, frame.strain, frame.by_load, frame.edges)
        after = EFFECTS[name].shown(seen, tire, run, strength)
        return replace(frame, strain=after.strain, by_load=after.by_load)

    return shown


_BLANK = EFFECTS["temperature"].shown
"""What gages show of effects that act on the tire: the tire's own strain."""


class Elements:
    """Tires of finite elements, with friction on every second one."""

    name, number = "continuum", 2
    hidden: Mapping[str, Hidden] = {
        **{
            e.name: Hidden(
                e.name,
                e.visible,
                e.largest,
                e.known,
                shown=None if e.shown is _BLANK else _law(e.name),
            )
            for e in EFFECTS.values()
        },
        **GAGES,
    }

    def draw(self, seed: int, kind: str) -> Tire:
        """Return the plain tire of a seed."""
        tire = draw(seed)
        grip = float(np.random.default_rng([seed, 32]).uniform(0.4, 1.1))
        smooth = seed % 2 == 0 or "tread_friction" in kind
        return replace(tire, friction=0.0 if smooth else grip, creep=CREEP)

    def geometry(self, tire: Tire) -> TireGeometry:
        """Return what a tape measure gives."""
        return TireGeometry(
            name=tire.name,
            free_radius=tire.free_radius,
            ring_radius=tire.ring_radius,
            tread_thickness=tire.tread_thickness,
            belt_width=tire.belt_width,
            innerliner_offset=tire.innerliner_offset,
        )

    def numbers(self, tire: Tire) -> dict[str, float]:
        """Return a ring's constants: laminate formulas of the section, and the sidewall's law."""
        return ring_numbers(tire) | {"friction": tire.friction, "crown": tire.crown_curvature}

    def frames(
        self, tire: Tire, settings: Sequence[Setting], planted: Mapping[str, float], angle: float
    ) -> list[Frame]:
        """Solve runs, each from a state of its nominal load that all runs share."""
        base = model(tire)

        def solved(s: Setting, start: State | None) -> State:
            return solve(_changed(base, s, planted, angle), _condition(s), start)

        starts: dict[float, tuple[Setting, State]] = {}
        last: State | None = None
        for load in sorted({_nominal(s.load) for s in settings}):
            middle = Setting(load, PRESSURES[1], SPEEDS[1], 0.5)
            last = solved(middle, last)
            starts[load] = middle, last
        return [_frame(_reached(s, *starts[_nominal(s.load)], solved), s) for s in settings]


def _reached(
    s: Setting,
    near: Setting,
    start: State,
    solved: Callable[[Setting, State | None], State],
    halvings: int = 2,
) -> State:
    """Return the state of a run from a start, over states between where Newton's method fails."""
    try:
        return solved(s, start)
    except ArithmeticError:
        if halvings == 0:
            raise
    between = Setting(*(0.5 * (a + b) for a, b in zip(astuple(s), astuple(near), strict=True)))
    half = _reached(between, near, start, solved, halvings - 1)
    return _reached(s, between, half, solved, halvings - 1)


def _nominal(load: float) -> float:
    return min(LOADS, key=lambda each: abs(each - load))


def _condition(s: Setting) -> Condition:
    return Condition(s.load, s.pressure, s.speed)


def _changed(base: Model, s: Setting, planted: Mapping[str, float], angle: float) -> Model:
    tire, law = base.tire, base.law
    run = Run(_condition(s), s.place, angle)
    for name, strength in planted.items():
        tire, law = EFFECTS[name].tire(tire, run, strength), EFFECTS[name].law(law, run, strength)
    same = all(np.array_equal(tire.radii(i), base.tire.radii(i)) for i in range(3))
    return replace(base, tire=tire, mesh=base.mesh if same else grid(tire, base.fine), law=law)


def _frame(state: State, setting: Setting) -> Frame:
    seen = trace(state)

    def thinned(values: Array) -> Array:
        """Return values on `PHI`, by their harmonics."""
        spectrum = np.fft.rfft(values, axis=0)[: POINTS // 2]
        return np.asarray(np.fft.irfft(spectrum, POINTS, axis=0) * (POINTS / len(values)))

    return Frame(
        setting,
        state.omega,
        state.height,
        state.stiffness,
        seen.edges,
        thinned(seen.strain),
        thinned(seen.by_load),
    )
