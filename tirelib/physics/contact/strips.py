"""Contact of the whole width: one radial contact per strip, one strip per gage.

The belt is cut into strips along the wheel's circumference. Each carries its share of the belt's
width (bending stiffness, mass, inflation, tread) and of the sidewalls, and has its own deflection
from crown and camber (`tirelib.physics.contact.load_transfer`). All stand on one axle: the
deflection d0 at the equator follows from the given load by Newton's method, all operating points
and strips at once.

Road forces in the road's plane are given, not computed here:

- Fx > 0 (drive) pulls the belt forward, against +phi: q_v = -f_x, and, acting at the tread's
  surface a lever h = R0 - R outside the neutral line, q_beta = h q_v;
- Fy > 0 pushes the belt to the left: lateral bending (`tirelib.physics.ring.lateral`). Its sidewall
  reaction rolls the belt, and the belt's shear pulls the strips along their length, which rolls it
  where it curves.

Both are distributed as the pressure is (default), or as given over the patch. Strips know of each
other through the axle, the common lateral displacement, the belt's shear (a shift linear over the
width) and the roll load. Left out: bending across the belt, and the lateral shift of the strips on
a cambered road.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import Tire
from tirelib.physics.contact.fourier import evaluate, load_harmonics
from tirelib.physics.contact.layout import (
    Layout,
    RoadForces,
    StripContact,
    join_points,
    take_points,
)
from tirelib.physics.contact.load_transfer import roll_load, strip_deflection
from tirelib.physics.contact.mixing import Mixer
from tirelib.physics.contact.patch import Nodes, PatchEquation
from tirelib.physics.contact.radial import RadialContact, load, press
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.lateral import LateralBelt, LateralDeflection, bend_belt
from tirelib.physics.ring.ring import ComplexArray, Ring

__all__ = ["Layout", "RoadForces", "StripContact", "press_strips"]

MAX_ITERATIONS = 40
TOLERANCE = 1e-6
"""Residual of the load, relative; of the other line loads' harmonics, relative to load over
radius."""
SHARED = MappingProxyType(
    dict.fromkeys(
        (
            "bending_stiffness",
            "mass",
            "inflation",
            "tension",
            "extension_stiffness",
            "shear_stiffness",
            "rotary_inertia",
        ),
        "width",
    )
    | dict.fromkeys(("radial_stiffness", "tangential_stiffness"), "sidewall")
)
"""Constants of the ring that a strip has its share of; the others are the same for all."""
PROBE = np.linspace(-0.5, 0.5, 101)
"""Angles at which a strip is checked for contact with the road, [rad]."""


def press_strips(
    tire: Tire,
    vertical_load: float | FloatArray,
    *,
    pressure: float | FloatArray | None = None,
    omega: float | FloatArray = 0.0,
    camber: float | FloatArray = 0.0,
    forces: RoadForces | None = None,
    layout: Layout | None = None,
    lateral_shear: float | None = None,
    n_modes: int = 60,
    n_nodes: int = 24,
) -> StripContact:
    """Return the contact of all strips at given loads.

    Parameters
    ----------
    tire : Tire
    vertical_load : float or shape (n_points,), [N]
    pressure : [Pa]
        Inflation, gauge; the tire's own if None.
    omega, camber : [rad/s], [rad]
    forces : RoadForces, optional
    layout : Layout, optional
        Five equal strips if None.
    lateral_shear : [N], optional
        Shear stiffness of the belt in its own plane, instead of the tire's; infinite for Fiala's
        beam.
    n_modes, n_nodes : int

    Raises
    ------
    ParameterError
        If a number is not allowed, or a strip hangs above the road and is yet pushed onto it.
    ConvergenceError
        If load or road forces do not settle; carries the last contact.
    """
    layout = layout or Layout.even()
    none = np.zeros(1)
    forces = forces or RoadForces(none, none)
    given = np.broadcast_arrays(
        np.atleast_1d(np.asarray(vertical_load, dtype=float)),
        np.asarray(tire.pressure if pressure is None else pressure, dtype=float),
        np.asarray(omega, dtype=float),
        np.asarray(camber, dtype=float),
        np.asarray(forces.longitudinal, dtype=float),
        np.asarray(forces.lateral, dtype=float),
    )
    if given[0].ndim != 1:
        raise ParameterError(
            f"strips: the operating points have shape {given[0].shape}; (n_points,) is needed"
        )
    target, p, w, tilt = (np.array(value) for value in given[:4])
    forces = replace(forces, longitudinal=given[4], lateral=given[5])
    whole = compliance(Ring.of(tire, p), w, n_modes).spread(target.size)
    d0 = load(whole, Tread.of(tire), target, n_nodes=n_nodes).deflection
    d0 = d0 + 0.5 * tire.crown_curvature * float(layout.width_share @ layout.lateral**2)
    shear = tire.lateral_shear if lateral_shear is None else lateral_shear
    problem = _Problem(tire, layout, p, w, tilt, forces, shear, n_modes, n_nodes)
    return _settle(problem, target, d0)


@dataclass(frozen=True)
class _Problem:
    """Everything that does not change while the axle settles."""

    tire: Tire
    layout: Layout
    pressure: FloatArray
    omega: FloatArray
    camber: FloatArray
    forces: RoadForces
    lateral_shear: float
    n_modes: int
    n_nodes: int

    def take(self, rows: IntArray) -> "_Problem":
        """Return the problem of some points."""
        old = self.forces
        shapes = [
            shape[rows] if shape is not None and shape.ndim == 2 else shape
            for shape in (old.longitudinal_shape, old.lateral_shape)
        ]
        forces = RoadForces(old.longitudinal[rows], old.lateral[rows], *shapes)
        return replace(
            self,
            pressure=self.pressure[rows],
            omega=self.omega[rows],
            camber=self.camber[rows],
            forces=forces,
        )

    @property
    def belt(self) -> LateralBelt:
        """The lateral beam of the whole belt."""
        return LateralBelt.of(self.tire, self.pressure, self.lateral_shear)

    def tread(self) -> Tread:
        """Return the tread of every strip, strips of a point side by side."""
        y, share, n = self.layout.lateral, self.layout.width_share, self.pressure.size
        whole = Tread.of(self.tire)
        free = float(np.asarray(whole.free_radius)) - 0.5 * self.tire.crown_curvature * y**2
        return replace(
            whole,
            free_radius=np.tile(free, n),
            normal_stiffness=np.tile(float(np.asarray(whole.normal_stiffness)) * share, n),
        ).spread(n * y.size)

    def rings(self, deflection: FloatArray) -> Compliance:
        """Return the compliance of every strip at the strips' deflections, flat."""
        strips, n = len(self.layout), self.pressure.size
        ring = Ring.of(self.tire, np.repeat(self.pressure, strips), deflection)
        share = {
            "width": np.tile(self.layout.width_share, n),
            "sidewall": np.tile(self.layout.sidewall_share, n),
        }
        ring = replace(
            ring,
            **{name: getattr(ring, name) * share[part] for name, part in SHARED.items()},
        )
        return compliance(ring, np.repeat(self.omega, strips), self.n_modes).spread(n * strips)


def _settle(problem: _Problem, target: FloatArray, d0: FloatArray) -> StripContact:
    """Find the axle's height and the line loads of all points; settled points are put aside."""
    done: list[StripContact] = []
    order: list[IntArray] = []
    rows = np.arange(target.size)
    state = _State.at_rest(problem, d0)
    for iteration in range(1, MAX_ITERATIONS + 1):
        contact, following, wrong, moved = _advance(problem, state, target, iteration)
        still = (np.abs(wrong) > TOLERANCE * target) | (moved > TOLERANCE)
        ready, keep = np.flatnonzero(~still), np.flatnonzero(still)
        if ready.size:
            done.append(take_points(contact, ready))
            order.append(rows[ready])
        if not keep.size:
            return join_points(done, np.concatenate(order), iteration)
        rows, target = rows[keep], target[keep]
        problem, state = problem.take(keep), following.take(keep, len(problem.layout))
    raise ConvergenceError(
        f"strips: {rows.size} points, the first number {rows[0]}, do not settle in "
        f"{MAX_ITERATIONS} iterations: loads are off by up to {np.abs(wrong).max():.2e} N, line "
        f"loads change by {moved.max():.1e} of load over radius; look at the last contact of these "
        "points (attribute iterate), use smaller forces",
        take_points(contact, keep),
        float(np.abs(wrong).max()),
    )


@dataclass(frozen=True)
class _State:
    """Unknowns on their way: axle height, line loads on the strips, shear moment."""

    d0: FloatArray
    extra: ComplexArray
    moment: ComplexArray
    mixer: Mixer

    @classmethod
    def at_rest(cls, problem: _Problem, d0: FloatArray) -> "_State":
        n, modes = d0.size, problem.n_modes + 1
        extra = np.zeros((n * len(problem.layout), modes, 3), dtype=complex)
        return cls(d0, extra, np.zeros((n, modes), dtype=complex), Mixer())

    def take(self, rows: IntArray, strips: int) -> "_State":
        flat = (rows[:, None] * strips + np.arange(strips)).ravel()
        return _State(self.d0[rows], self.extra[flat], self.moment[rows], self.mixer.take(rows))


def _advance(
    problem: _Problem, state: _State, target: FloatArray, iteration: int
) -> tuple[StripContact, _State, FloatArray, FloatArray]:
    """Press once; return the contact, the next state, and what is left of load and line loads."""
    n, strips = target.size, len(problem.layout)
    tire = problem.tire
    d = strip_deflection(
        state.d0, problem.layout.lateral, problem.camber, tire.crown_curvature
    ).ravel()
    # a strip above the road has no deflection to soften its sidewall
    rings, tread = problem.rings(np.maximum(d, 0.0)), problem.tread()
    on = _touching(rings, tread, d, state.extra)
    part = press(
        rings.take(on), tread.take(on), d[on], extra=state.extra[on], n_nodes=problem.n_nodes
    )
    contact = _gather(problem, part, on, rings, state, d, iteration)
    contact = replace(contact, bending=_bend(problem, contact, rings, state.moment))
    moment = state.mixer.next(state.moment, contact.bending.moment)
    extra = _line_loads(problem, contact, moment)
    moved = np.abs(extra - state.extra).reshape(n, -1).max(axis=1) * contact.radius / target
    wrong = target - contact.load.sum(axis=1)
    slope = np.zeros(n * strips)
    slope[on] = _stiffness(part, problem.n_nodes)
    d0 = state.d0 + wrong / slope.reshape(n, strips).sum(axis=1)
    return contact, _State(d0, extra, moment, state.mixer), wrong, moved


def _touching(
    rings: Compliance, tread: Tread, deflection: FloatArray, extra: ComplexArray
) -> IntArray:
    """Return the strips that touch the road."""
    pushed = evaluate((rings.matrix[..., 0, :] * extra).sum(axis=-1), PROBE)
    free = np.asarray(tread.free_radius)[:, None]
    deepest = (deflection[:, None] - free * (1.0 - np.cos(PROBE)) + pushed).max(axis=1)
    hanging = (deepest > 0.0) & (deflection <= 0.0)
    if hanging.any():
        strip = int(np.flatnonzero(hanging)[0])
        raise ParameterError(
            f"strips: strip number {strip} (points times strips) hangs "
            f"{-1e3 * deflection[strip]:.2f} mm above the road and the roll load pushes it on; "
            "lower camber or side force, or raise the load"
        )
    return np.flatnonzero(deepest > 0.0)


def _stiffness(part: RadialContact, n_nodes: int) -> FloatArray:
    """Return d load / d d0; the edges' shifts do not count, the pressure vanishes there."""
    step = PatchEquation.of(
        part.compliance, part.tread, Nodes.of(n_nodes), part.edges, part.delta, part.extra
    )
    arm = part.compliance.radius[:, None] * part.weights * np.cos(part.phi)
    out: FloatArray = np.sum(arm * step.tangent * step.lift, axis=1)
    return out


def _gather(
    problem: _Problem,
    part: RadialContact,
    on: IntArray,
    rings: Compliance,
    state: _State,
    d: FloatArray,
    iteration: int,
) -> StripContact:
    """Put the strips that touch among those that do not."""
    n, strips = state.d0.size, len(problem.layout)
    size = n * strips
    edges, force = np.full((size, 2), np.nan), np.zeros(size)
    phi, weights, q = (np.zeros((size, problem.n_nodes)) for _ in range(3))
    shape = (rings.matrix @ state.extra[..., None])[..., 0]
    edges[on], force[on] = part.edges, part.load
    phi[on], weights[on], q[on] = part.phi, part.weights, part.pressure
    shape[on] = part.displacement
    silent = np.zeros((n, problem.n_modes + 1), dtype=complex)
    return StripContact(
        layout=problem.layout,
        deflection=state.d0,
        camber=problem.camber,
        pressure=problem.pressure,
        omega=problem.omega,
        radius=np.broadcast_to(rings.radius, (size,)).reshape(n, strips)[:, 0],
        free_radius=np.asarray(problem.tread().free_radius)[:strips],
        strip_deflection=d.reshape(n, strips),
        edges=edges.reshape(n, strips, 2),
        load=force.reshape(n, strips),
        phi=phi.reshape(n, strips, -1),
        weights=weights.reshape(n, strips, -1),
        line_pressure=q.reshape(n, strips, -1),
        displacement=shape.reshape(n, strips, -1, 3),
        bending=LateralDeflection(silent, silent, silent, silent),
        iterations=iteration,
    )


def _bend(
    problem: _Problem, contact: StripContact, rings: Compliance, moment: ComplexArray
) -> LateralDeflection:
    """Return the lateral bending, with what the strips do under the shear moment in it.

    `moment` is the one that the contact's displacement holds already.
    """
    n, strips = len(contact), len(problem.layout)
    across = _distribute(contact, problem.forces.lateral, problem.forces.lateral_shape)
    force = load_harmonics(
        contact.phi.reshape(n * strips, -1),
        (contact.weights * across).reshape(n * strips, -1),
        problem.n_modes,
    )
    arm = problem.layout.arm
    yaw = np.einsum("i,pin->pn", arm**2, rings.matrix[..., 1, 1].reshape(n, strips, -1))
    shift = np.einsum("i,pin->pn", arm, contact.displacement[..., 1])
    return bend_belt(
        problem.belt,
        force.reshape(n, strips, -1).sum(axis=1),
        problem.omega,
        yaw_compliance=yaw,
        free_yaw=shift + yaw * moment,
    )


def _line_loads(problem: _Problem, contact: StripContact, moment: ComplexArray) -> ComplexArray:
    """Return the loads of the road on the strips' belts besides the pressure, as a flat array."""
    n, strips, modes = len(contact), len(problem.layout), problem.n_modes
    along = _distribute(contact, problem.forces.longitudinal, problem.forces.longitudinal_shape)
    drive = load_harmonics(
        contact.phi.reshape(n * strips, -1),
        (contact.weights * along).reshape(n * strips, -1),
        modes,
    ).reshape(n, strips, -1)
    y, arm = problem.layout.lateral, problem.layout.arm
    roll = roll_load(contact.bending.reaction, y, problem.tire.roll_lever)
    shear = moment[:, None, :] * arm[:, None]
    lever = (contact.free_radius - problem.tire.ring_radius)[:, None]
    out: ComplexArray = np.stack([roll, -drive - shear, -lever * drive], axis=-1)
    return out.reshape(n * strips, modes + 1, 3)


def _distribute(contact: StripContact, force: FloatArray, shape: FloatArray | None) -> FloatArray:
    """Return a force as line load at the nodes, (n_points, n_strips, n_nodes), [N/m].

    Every strip takes part by its load.
    """
    if shape is None:
        weight = contact.line_pressure
    else:
        xi = 0.5 * (1.0 + Nodes.of(contact.phi.shape[-1]).xi)
        rows = np.atleast_2d(shape)
        at = xi * (rows.shape[1] - 1)
        left = np.minimum(at.astype(int), rows.shape[1] - 2)
        value = rows[:, left] + (rows[:, left + 1] - rows[:, left]) * (at - left)
        mean = value @ Nodes.of(xi.size).weights / 2.0
        span = np.nan_to_num(contact.edges[..., 1] - contact.edges[..., 0], nan=1.0)
        weight = (value / mean[:, None])[:, None, :] * (contact.load / span)[..., None]
    total = contact.radius * np.sum(weight * contact.weights, axis=(1, 2))
    out: FloatArray = weight * (force / total)[:, None, None]
    return out
