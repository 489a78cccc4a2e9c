"""Family of the numerical rig: `tirelib.rig` with every constant redrawn by up to a half."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from structure.family import PHI, POINTS, Array, Frame, Hidden, Setting
from structure.gages import GAGES
from tirelib.campaign import TireGeometry
from tirelib.rig.hidden import HIDDEN
from tirelib.rig.laws import SectionInertia
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import Trace, edges, trace
from tirelib.rig.shown import Shown as Seen
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import Condition, RigTire

MESH = (0.015, 0.15)
"""Coarser than the rig's own: the filtered waveforms differ by less than half a microstrain."""
BAR = 1e5


def _shown(name: str, frame: Frame, tire: Any, angle: float, strength: float) -> Frame:
    """Let the rig's law of a faulty gage act; of the tire it needs the ring's radius."""
    s = frame.setting
    seen = Seen(
        tire,
        Condition(s.load, s.pressure, s.speed),
        frame.omega,
        Trace(PHI, frame.strain, np.zeros_like(frame.strain), frame.by_load),
        frame.edges,
        frame.stiffness,
        s.place,
        angle,
    )
    after = HIDDEN[name].trace(seen, strength)
    return replace(frame, strain=after.strain, by_load=after.by_load)


def _law(name: str) -> Any:
    return lambda frame, tire, angle, strength: _shown(name, frame, tire, angle, strength)


def shown_by_gages() -> dict[str, Hidden]:
    """Return the rig's laws of what gages show, which serve a ring as well."""
    return {
        e.name: Hidden(e.name, e.visible, e.largest, e.known, e.signed, _law(e.name))
        for e in HIDDEN.values()
        if e.on_trace is not None
    }


class Rig:
    """Tires of the numerical rig, with friction on every second one."""

    name, number = "rig", 1
    hidden: Mapping[str, Hidden] = {
        **{
            e.name: Hidden(e.name, e.visible, e.largest, e.known, e.signed)
            for e in HIDDEN.values()
            if e.on_tire is not None
        },
        **shown_by_gages(),
        **GAGES,
    }

    def draw(self, seed: int, kind: str) -> RigTire:
        """Return the plain tire of a seed."""
        rng = np.random.default_rng([seed, 31])
        base = RigTire()

        def times(value: float, factor: float = 1.5) -> float:
            return value * float(factor ** rng.uniform(-1.0, 1.0))

        radial, tangential, edge = times(1.0), times(1.0), float(rng.uniform(0.2, 0.34))
        # the order of the draws is part of a seed's meaning
        tire = replace(
            base,
            name=f"rig {seed}",
            ring_radius=base.ring_radius * float(rng.uniform(0.94, 1.06)),
            belt_width=base.belt_width * float(rng.uniform(0.88, 1.12)),
            innerliner_offset=times(base.innerliner_offset),
            tread_thickness=times(base.tread_thickness, 1.3),
            crown_curvature=float(rng.uniform(0.0, 1.2)),
            extension=times(base.extension),
            shear=times(base.shear),
            bending=times(base.bending),
            mass=times(base.mass),
            sidewall_radial=base.sidewall_radial * times(radial, 1.2),
            sidewall_radial_offset=base.sidewall_radial_offset * times(radial, 1.2),
            sidewall_tangential=base.sidewall_tangential * times(tangential, 1.2),
            sidewall_tangential_offset=base.sidewall_tangential_offset * times(tangential, 1.2),
            sidewall_share=(edge, *[(1.0 - 2.0 * edge) / 3.0] * 3, edge),
            transverse_bending=times(base.transverse_bending),
            belt_shear_coupling=times(base.belt_shear_coupling),
            tread_normal=times(base.tread_normal),
            tread_hardening=float(rng.uniform(0.0, 2.0)),
            tread_shear_x=times(base.tread_shear_x),
            friction=float(rng.uniform(0.4, 1.1)),
            sidewall_damping=0.0,
            belt_laws=(SectionInertia(float(rng.uniform(1e-5, 1e-4))),),
        )
        smooth = seed % 2 == 0 or "tread_friction" in kind
        bare = seed % 4 >= 2 or "rotary_inertia" in kind
        return replace(
            tire,
            friction=0.0 if smooth else tire.friction,
            belt_laws=() if bare else tire.belt_laws,
        )

    def geometry(self, tire: RigTire) -> TireGeometry:
        """Return what a tape measure gives."""
        return TireGeometry(
            name=tire.name,
            free_radius=tire.free_radius,
            ring_radius=tire.ring_radius,
            tread_thickness=tire.tread_thickness,
            belt_width=tire.belt_width,
            innerliner_offset=tire.innerliner_offset,
        )

    def numbers(self, tire: RigTire) -> dict[str, float]:
        """Return a ring's constants; k_t is the secant at 2 bar."""
        hard = tire.tread_hardening / tire.tread_thickness
        soft = 2.0 * BAR / tire.tread_normal
        deep = soft if hard == 0.0 else (np.sqrt(1.0 + 4.0 * hard * soft) - 1.0) / (2.0 * hard)
        inertias = [law.strength for law in tire.belt_laws if isinstance(law, SectionInertia)]
        turned = sum(inertias, 0.0)
        return {
            "EI": tire.bending,
            "EA": tire.extension,
            "GA": tire.shear,
            "k_u": tire.radial_stiffness(2.0 * BAR),
            "k_u_slope": tire.sidewall_radial,
            "k_v": tire.tangential_stiffness(2.0 * BAR),
            "k_v_slope": tire.sidewall_tangential,
            "k_t": 2.0 * BAR * tire.belt_width / float(deep),
            "k_t_soft": tire.tread_normal * tire.belt_width,
            "k_s": tire.tread_shear_x * tire.belt_width * (tire.friction > 0.0),
            "hardening": tire.tread_hardening,
            "mass": tire.mass,
            "rotary_inertia": turned,
            "innerliner_offset": tire.innerliner_offset,
            "friction": tire.friction,
            "crown": tire.crown_curvature,
        }

    def frames(
        self,
        tire: RigTire,
        settings: Sequence[Setting],
        planted: Mapping[str, float],
        angle: float,
    ) -> list[Frame]:
        """Solve runs from light to heavy, each from the state nearest to it."""
        grid, states = mesh(*MESH), {}
        for run in sorted(range(len(settings)), key=lambda k: settings[k].load):
            s = settings[run]
            changed = tire
            cond = Condition(s.load, s.pressure, s.speed)
            for name, strength in planted.items():
                changed = HIDDEN[name].tire(changed, cond, s.place, strength)
            near = min(states.values(), key=lambda x: _apart(x.condition, cond), default=None)
            start = None if near is None else _toward(near, cond, changed)
            states[run] = solve(changed, cond, start, grid)
        return [_frame(states[run], settings[run]) for run in range(len(settings))]


def _apart(a: Condition, b: Condition) -> float:
    return float(
        abs(np.log(a.load / b.load))
        + 2.0 * abs(np.log(a.pressure / b.pressure))
        + abs(a.speed - b.speed) / 40.0
    )


def _toward(state: RigState, cond: Condition, tire: RigTire) -> RigState:
    """Extrapolate a state to another load, on a tire whose tread may be thinner."""
    more = cond.load - state.condition.load
    lower = tire.free_radius - state.tire.free_radius
    return replace(
        state,
        control=state.control + more * state.by_load,
        height=state.height - more / state.stiffness + lower,
    )


def _frame(state: RigState, setting: Setting) -> Frame:
    seen = trace(state, POINTS)
    lead: Array = edges(state)[0]
    return Frame(
        setting, state.omega, state.height, state.stiffness, lead, seen.strain, seen.by_load
    )
