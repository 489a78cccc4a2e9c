"""A model file on the road: the solve that `identify` fits and `compare` uses, effects included.

Effects add what they change in the linear ring to the rolling one (`tirelib.model.base.predict`).
Belt, pressure and strain are put together in the same way; the shear is that of the rolling ring.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.model import Model
from tirelib.errors import ConvergenceError, ParameterError
from tirelib.model.base import Correction, large_displacements, predict
from tirelib.model.state import Operating, State
from tirelib.parameters import FIELDS, Tire
from tirelib.report.simulation import (
    N_ANGLES,
    Simulation,
    check_range,
    check_turn_rate,
    points_of,
)
from tirelib.ring.ring import ComplexArray
from tirelib.rolling.gage import Gage
from tirelib.signal import LowPass
from tirelib.threads import one_thread

TURN = np.linspace(-np.pi, np.pi, N_ANGLES - 1, endpoint=False)
"""Angles of the curves, the last of which is the first; every fourth is one of `GRID`."""
TRIAL = 0.02
"""Relative step of the load by which the slope of the deflection is found."""
SETTLED, MOST = 1e-8, 30
"""Difference from the deflection that was asked for [m], and the solves until then."""


def simulate_file(
    model: Model,
    tire: Tire,
    *,
    load: FloatArray | None = None,
    deflection: FloatArray | None = None,
    inflation: FloatArray | None = None,
    turn_rate: FloatArray | None = None,
    camber: FloatArray | None = None,
    temperature: FloatArray | None = None,
) -> Simulation:
    """Simulate a model at one or many operating points; a scalar condition holds for all of them.

    Parameters
    ----------
    model, tire
        As of `simulate_model`.
    load, deflection : shape (n_points,), [N], [m]
        One of the two.
    inflation, turn_rate, camber, temperature : shape (n_points,), [Pa], [rad/s], [rad], [K]
        By default the tire's own, 0, 0 and unknown.

    Raises
    ------
    ParameterError
        If numbers of points differ or a value is outside the model's range; see `simulate_model`.
    ConvergenceError
        From `simulate_model`.
    """
    pressed = load if load is not None else deflection
    target, p, omega, lean, warm = points_of(
        pressed,
        tire.pressure if inflation is None else inflation,
        0.0 if turn_rate is None else turn_rate,
        0.0 if camber is None else camber,
        np.nan if temperature is None else temperature,
    )
    check_range("inflation pressure", p, FIELDS["pressure"].highest, "bar", "pressure")
    check_turn_rate(tire, omega)
    conditions = Conditions(p, omega, lean, warm)
    if load is not None:
        return simulate_model(model, tire, conditions, load=target)
    return simulate_model(model, tire, conditions, deflection=target)


@dataclass(frozen=True, slots=True)
class Conditions:
    """Operating points; arrays of shape (n_points,), SI.

    Attributes
    ----------
    inflation, turn_rate : [Pa], [rad/s]
    camber : [rad]
    temperature : [K]
        Temperature of the tread; NaN where unknown.
    """

    inflation: FloatArray
    turn_rate: FloatArray
    camber: FloatArray
    temperature: FloatArray

    def at(self, load: FloatArray, ring_radius: float) -> Operating:
        """Return free rolling at loads, in the order of the points."""
        none, n = np.zeros(load.size), load.size
        return Operating(
            load=load,
            pressure=self.inflation,
            omega=self.turn_rate,
            speed=self.turn_rate * ring_radius,
            camber=self.camber,
            slip_angle=none,
            slip_ratio=none,
            side_force=none,
            drive_force=none,
            order=np.arange(n) / max(n - 1, 1),
            temperature=self.temperature,
        )


@one_thread()
def simulate_model(
    model: Model,
    tire: Tire,
    conditions: Conditions,
    *,
    load: FloatArray | None = None,
    deflection: FloatArray | None = None,
    low_pass: LowPass | None = None,
) -> Simulation:
    """Press a model with its effects onto the road, at one or many operating points.

    Parameters
    ----------
    model : Model
    tire : Tire
        The model's, with the damping that is to be simulated.
    conditions : Conditions
    load, deflection : shape (n_points,), [N], [m]
        One of the two.
    low_pass : LowPass, optional
        Low-pass filter of the gage's waveform; the default is that of the signal chain.

    Raises
    ------
    ParameterError
        If an effect needs a condition that is unknown.
    ConvergenceError
        If the contact does not settle, or no load gives the deflection.
    """
    values = {**model.values, "damping": tire.damping}
    low_pass = low_pass or LowPass()
    _check_known(model, conditions)
    if load is None:
        assert deflection is not None  # noqa: S101 - the caller has looked
        load = _load_at(model, values, conditions, deflection, low_pass, tire)
    points = conditions.at(load, tire.ring_radius)
    state, correction = _solved(model, values, points, low_pass)
    return _simulation(tire, values, state, correction, low_pass, points)


def _check_known(model: Model, conditions: Conditions) -> None:
    wants = [u.effect.name for u in model.used if u.effect.varies_with == ("temperature",)]
    if wants and not np.isfinite(conditions.temperature).all():
        raise ParameterError(
            f"simulate: the model's {', '.join(wants)} needs the tread temperature, which was not "
            "given; give --temperature DEGC"
        )


def _solved(
    model: Model, values: Mapping[str, float | FloatArray], points: Operating, low_pass: LowPass
) -> tuple[State, Correction | None]:
    """Return the state over `TURN` as `compare` predicts it, and the exact ring behind it."""
    correction = None
    if model.large:
        correction = large_displacements(values, points, low_pass=low_pass, phi=TURN)
    state = predict(
        values, points, model.changes, low_pass=low_pass, correction=correction, phi=TURN
    )
    return state, correction


def _load_at(
    model: Model,
    values: Mapping[str, float | FloatArray],
    conditions: Conditions,
    deflection: FloatArray,
    low_pass: LowPass,
    tire: Tire,
) -> FloatArray:
    """Return the loads that press the model by deflections, by the secant rule."""

    def depth(load: FloatArray) -> FloatArray:
        points = conditions.at(load, tire.ring_radius)
        found: FloatArray = _solved(model, values, points, low_pass)[0].deflection
        return found

    load = 1.2e5 * deflection  # a third less than a usual tire's 180 N/mm: an easy first solve
    more = load * (1.0 + TRIAL)
    before, now = depth(load), depth(more)
    for _ in range(MOST):
        slope = (now - before) / (more - load)
        step = (deflection - now) / np.where(slope > 0.0, slope, np.inf)
        load, before, more = more, now, np.clip(more + step, 0.5 * more, 2.0 * more)
        if np.abs(deflection - now).max() < SETTLED:
            return load
        moved = more != load
        more = np.where(moved, more, load * (1.0 + 1e-9))
        now = depth(more)
    raise ConvergenceError(
        f"simulate: no load was found that deflects the model by {1e3 * deflection.max():.4g} mm; "
        f"after {MOST} solves it is {1e3 * float(np.abs(deflection - now).max()):.2g} mm off; give "
        "a smaller --deflection, or --load",
        more,
        float(np.abs(deflection - now).max()),
    )


def _simulation(
    tire: Tire,
    values: Mapping[str, float | FloatArray],
    state: State,
    correction: Correction | None,
    low_pass: LowPass,
    points: Operating,
) -> Simulation:
    """Return the curves of a solved model."""
    assert state.contact is not None  # noqa: S101 - the chain sets it
    assert state.belt is not None  # noqa: S101
    assert state.strain is not None  # noqa: S101
    u, v, strain = (_on_turn(h) for h in (state.belt[..., 0], state.belt[..., 1], state.strain))
    pressure, edges = state.contact.pressure_at(TURN), state.contact.edges
    rolling = correction.contact if correction is not None else None
    up, along = pressure * np.cos(TURN), -pressure * np.sin(TURN)
    if rolling is not None:
        plain = predict({**values, "damping": 0.0}, points, low_pass=low_pass, phi=TURN)
        assert plain.contact is not None  # noqa: S101
        assert plain.belt is not None  # noqa: S101
        assert plain.strain is not None  # noqa: S101
        turn = rolling.on_turn(TURN.size)
        u = u - _on_turn(plain.belt[..., 0]) + turn.u
        v = v - _on_turn(plain.belt[..., 1]) + turn.v
        gage = Gage(
            state.offset,
            np.full(state.offset.shape, tire.liner_share),
            tire.tread_spread * state.thickness,
        )
        strain = strain - _on_turn(plain.strain) + rolling.strain(gage, TURN.size)
        edges = edges - plain.contact.edges + turn.edges
        pressure = pressure - plain.contact.pressure_at(TURN) + turn.pressure
        pressure = np.where(_inside(edges), np.maximum(pressure, 0.0), 0.0)
        up, along = pressure, turn.shear
    rate = _slope(strain)
    curves = (_closed(x) for x in (u, v, pressure, up, along, strain, rate, state.wave))
    u, v, pressure, up, along, strain, rate, wave = curves
    phi = np.append(TURN, np.pi)
    return Simulation(
        tire,
        "radial",
        points.pressure,
        points.omega,
        points.load,
        state.deflection,
        edges,
        _at_middle(phi, pressure, edges),
        _centre(phi, pressure, tire.ring_radius),
        phi,
        u,
        v,
        pressure,
        up,
        along,
        strain,
        rate,
        gage=wave,
    )


def _on_turn(harmonics: ComplexArray) -> FloatArray:
    """Return Re sum F_n exp(i n phi) over `TURN`."""
    angle = np.arange(harmonics.shape[-1])[:, None] * TURN
    out: FloatArray = harmonics.real @ np.cos(angle) - harmonics.imag @ np.sin(angle)
    return out


def _inside(edges: FloatArray) -> FloatArray:
    return np.asarray((edges[:, :1] <= TURN) & (edges[:, 1:] >= TURN))


def _slope(values: FloatArray) -> FloatArray:
    """Return the derivative by angle of periodic curves (n_points, n)."""
    n = values.shape[-1]
    order = 1j * np.fft.rfftfreq(n, 1.0 / n)
    order[-1] = 0.0
    out: FloatArray = np.fft.irfft(np.fft.rfft(values) * order, n=n)
    return out


def _closed(values: FloatArray) -> FloatArray:
    """Return curves with their first value at the end as well."""
    return np.concatenate([values, values[:, :1]], axis=1)


def _at_middle(phi: FloatArray, pressure: FloatArray, edges: FloatArray) -> FloatArray:
    middles = edges.mean(axis=1)
    return np.array([np.interp(m, phi, q) for m, q in zip(middles, pressure, strict=True)])


def _centre(phi: FloatArray, pressure: FloatArray, radius: float) -> FloatArray:
    """Return R int q sin / int q cos."""
    out: FloatArray = radius * (pressure @ np.sin(phi)) / (pressure @ np.cos(phi))
    return out
