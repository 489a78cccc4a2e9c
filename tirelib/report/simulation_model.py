"""A model file on the road: the solve that `compare` and `diagnose` use, effects included.

Belt, pressure and strain are those of the rolling ring, with what effects and damping add through
the linear one (`tirelib.model.solution`); the shear is that of the rolling ring.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import FIELDS, Tire
from tirelib.core.threads import one_thread
from tirelib.effects.state import Operating, State
from tirelib.inference.compare.model import TireModel
from tirelib.inference.identify.random_effects import angle_slope
from tirelib.measured.signal import LowPass
from tirelib.model.base import predict
from tirelib.model.solution import Solution, solved
from tirelib.physics.contact.fourier import evaluate
from tirelib.report.simulation import PHI, Simulation, check_range, check_turn_rate, points_of

TURN = PHI[:-1]
"""Angles of the curves, the last of which is the first; every fourth is one of `GRID`."""
TRIAL = 0.02
"""Relative step of the load by which the slope of the deflection is found."""
DEFLECTION_SETTLED, MOST_SOLVES = 1e-8, 30
"""Difference from the deflection that was asked for [m], and the solves until then."""


@one_thread()
def simulate_file(
    model: TireModel,
    tire: Tire,
    *,
    load: FloatArray | None = None,
    deflection: FloatArray | None = None,
    inflation: FloatArray | None = None,
    turn_rate: FloatArray | None = None,
    camber: FloatArray | None = None,
    temperature: FloatArray | None = None,
) -> Simulation:
    """Press a model with its effects onto the road, at one or many operating points.

    Parameters
    ----------
    tire : Tire
        The model's, with the damping that is to be simulated.
    load, deflection : shape (n_points,), [N], [m]
        One of the two.
    inflation, turn_rate, camber, temperature : shape (n_points,), [Pa], [rad/s], [rad], [K]
        By default the tire's own, 0, 0 and unknown; a scalar holds for all points.

    Raises
    ------
    ParameterError
        If numbers of points differ, a value is outside the model's range, or an effect needs a
        condition that is unknown.
    ConvergenceError
        If the contact does not settle, or no load gives the deflection.
    """
    target, p, omega, lean, warm = points_of(
        load if load is not None else deflection,
        tire.pressure if inflation is None else inflation,
        0.0 if turn_rate is None else turn_rate,
        0.0 if camber is None else camber,
        np.nan if temperature is None else temperature,
    )
    check_range("inflation pressure", p, FIELDS["pressure"].highest, "bar", "pressure")
    check_turn_rate(tire, omega)
    wants = [u.effect.name for u in model.used if u.effect.varies_with == ("temperature",)]
    if wants and not np.isfinite(warm).all():
        raise ParameterError(
            f"simulate: the model's {', '.join(wants)} needs the tread temperature, which was not "
            "given; give --temperature DEGC"
        )
    values = {**model.values, "damping": tire.damping}
    none, n = np.zeros(target.size), target.size
    points = Operating(
        load=target,
        pressure=p,
        omega=omega,
        speed=omega * tire.ring_radius,
        camber=lean,
        slip_angle=none,
        slip_ratio=none,
        side_force=none,
        drive_force=none,
        order=np.arange(n) / max(n - 1, 1),
        temperature=warm,
    )
    if load is None:
        points = _at_deflection(model, values, points, target)
    found = _pressed(model, values, points)
    seen = _of_rolling(found) if isinstance(found, Solution) else _of_linear(found)
    return _simulation(tire, *seen, found.deflection, points)


def _pressed(
    model: TireModel, values: Mapping[str, float | FloatArray], points: Operating
) -> Solution | State:
    """Return the rolling ring over `TURN` as `compare` predicts it, or the linear ring."""
    solve = solved if model.large else predict
    return solve(values, points, model.changes, low_pass=LowPass(), phi=TURN)


def _at_deflection(
    model: TireModel,
    values: Mapping[str, float | FloatArray],
    points: Operating,
    deflection: FloatArray,
) -> Operating:
    """Return the points at the loads that press the model by deflections, by the secant rule."""

    def depth(load: FloatArray) -> FloatArray:
        return _pressed(model, values, replace(points, load=load)).deflection

    load = 1.2e5 * deflection  # a third less than a usual tire's 180 N/mm: an easy first solve
    more = load * (1.0 + TRIAL)
    before, now = depth(load), depth(more)
    for _ in range(MOST_SOLVES):
        slope = (now - before) / (more - load)
        step = (deflection - now) / np.where(slope > 0.0, slope, np.inf)
        load, before, more = more, now, np.clip(more + step, 0.5 * more, 2.0 * more)
        if np.abs(deflection - now).max() < DEFLECTION_SETTLED:
            return replace(points, load=load)
        moved = more != load
        more = np.where(moved, more, load * (1.0 + 1e-9))
        now = depth(more)
    off = float(np.abs(deflection - now).max())
    raise ConvergenceError(
        f"simulate: no load was found that deflects the model by {1e3 * deflection.max():.4g} mm; "
        f"after {MOST_SOLVES} solves it is {1e3 * off:.2g} mm off; give a smaller --deflection, or "
        "--load",
        more,
        off,
    )


class _Curves(NamedTuple):
    """Curves (n_points, n) over `TURN`: belt, tractions, strain, gage."""

    u: FloatArray
    v: FloatArray
    pressure: FloatArray
    up: FloatArray
    along: FloatArray
    strain: FloatArray
    gage: FloatArray


def _of_linear(state: State) -> tuple[_Curves, FloatArray]:
    """Return curves and edges of the linear ring; its contact pushes along the belt's normal."""
    assert state.contact is not None  # noqa: S101 - the chain sets it
    assert state.belt is not None  # noqa: S101
    assert state.strain is not None  # noqa: S101
    u, v, strain = (
        evaluate(h, TURN) for h in (state.belt[..., 0], state.belt[..., 1], state.strain)
    )
    pressure = state.contact.pressure_at(TURN)
    up, along = pressure * np.cos(TURN), -pressure * np.sin(TURN)
    return _Curves(u, v, pressure, up, along, strain, state.wave), state.contact.edges


def _of_rolling(found: Solution) -> tuple[_Curves, FloatArray]:
    """Return curves and edges of the rolling ring, with what the linear one adds."""
    turn = found.rolling.on_turn(TURN.size)
    u, v, pressure, edges = turn.u, turn.v, turn.pressure, turn.edges
    strain = found.rolling.strain(found.made.gage, TURN.size)
    if found.linear is not None:
        (plain, was), (added, is_now) = (_of_linear(state) for state in found.linear)
        u, v, strain = u + added.u - plain.u, v + added.v - plain.v, strain - plain.strain
        strain, edges = strain + added.strain, edges + is_now - was
        pressure = pressure + added.pressure - plain.pressure
        inside = (edges[:, :1] <= TURN) & (edges[:, 1:] >= TURN)
        pressure = np.where(inside, np.maximum(pressure, 0.0), 0.0)
    return _Curves(u, v, pressure, pressure, turn.shear, strain, found.waveform), edges


def _simulation(
    tire: Tire, curves: _Curves, edges: FloatArray, deflection: FloatArray, points: Operating
) -> Simulation:
    """Return the curves of a solved model, their first value at the end as well."""
    u, v, pressure, up, along, strain, gage, rate = (
        np.concatenate([x, x[:, :1]], axis=1) for x in (*curves, angle_slope(curves.strain))
    )
    middles = zip(edges.mean(axis=1), pressure, strict=True)
    return Simulation(
        tire,
        "radial",
        points.pressure,
        points.omega,
        points.load,
        deflection,
        edges,
        np.array([np.interp(middle, PHI, q) for middle, q in middles]),
        tire.ring_radius * (pressure @ np.sin(PHI)) / (pressure @ np.cos(PHI)),
        PHI,
        u,
        v,
        pressure,
        up,
        along,
        strain,
        rate,
        gage=gage,
    )
