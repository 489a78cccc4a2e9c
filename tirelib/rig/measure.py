"""The measuring chain: from the tire's true state to what the loggers write.

Gages: gain and offset that belong to the tire, gain repeatability from run to run, slow drift,
white noise, quantisation. Rig: set-point errors, sensor noise, once-per-turn load from run-out.
Everything random comes from seeds: the tire's name for the gages, the campaign's seed (the day)
for the rest, one stream a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from tirelib.campaign import BoolArray
from tirelib.rig.observe import Forces, Trace, winding
from tirelib.rig.solve import RigState
from tirelib.rig.tire import N_STRIPS, Array, Condition, RigTire


@dataclass(frozen=True)
class MeasuringChain:
    """Constants of the measuring chain, one sigma where it is random, SI.

    A gage fault would be a change of these, or of `Gages`.
    """

    gage_rate: float = 10_000.0
    rig_rate: float = 100.0
    turns: float = 5.1
    gage_noise: float = 4e-6
    gage_gain: float = 0.01
    gage_offset: float = 3e-5
    gage_drift: float = 1.5e-8
    gain_repeatability: float = 0.003
    gage_range: float = 0.02
    gage_bits: int = 14
    load_setting: float = 0.005
    pressure_setting: float = 0.002
    speed_setting: float = 0.001
    angle_setting: float = 3e-4
    slip_setting: float = 3e-4
    force_noise: float = 30.0
    moment_noise: float = 0.5
    angle_noise: float = 2e-4
    slip_noise: float = 3e-4
    speed_noise: float = 0.01
    omega_noise: float = 0.01
    pressure_noise: float = 200.0
    radius_noise: float = 5e-5
    run_out: float = 1e-4
    run_spacing: float = 12.0


@dataclass(frozen=True)
class Gages:
    """Gain and offset of the five gages, and the tire's run-out angle; fixed for a tire."""

    gain: Array
    offset: Array
    run_out_angle: float


@dataclass(frozen=True)
class Stage:
    """A solved state, what it shows, and the time at which the wheel passes through it [s]."""

    state: RigState
    trace: Trace
    force: Forces
    time: float = 0.0


@dataclass(frozen=True)
class Recording:
    """Data of the loggers after a run, SI and ISO signs.

    `strain` has shape (5, n); `rig` maps channel names of a campaign to arrays.
    """

    strain: Array
    trigger: BoolArray
    rig: dict[str, Array]
    rig_time: Array


def gages(tire: RigTire, chain: MeasuringChain) -> Gages:
    """Draw the gages of a tire; the same name gives the same gages."""
    rng = np.random.default_rng([crc32(tire.name.encode()), 1])
    return Gages(
        gain=1.0 + chain.gage_gain * rng.standard_normal(N_STRIPS),
        offset=chain.gage_offset * rng.standard_normal(N_STRIPS),
        run_out_angle=float(rng.uniform(-np.pi, np.pi)),
    )


def settle(nominal: Condition, chain: MeasuringChain, seed: int, run: int) -> Condition:
    """Return the true condition of a run: the rig does not hold its set points exactly."""
    rng = np.random.default_rng([seed, run, 0])
    e = rng.standard_normal(6)
    slip = nominal.slip_ratio
    return replace(
        nominal,
        load=nominal.load * (1.0 + chain.load_setting * float(e[0])),
        pressure=nominal.pressure * (1.0 + chain.pressure_setting * float(e[1])),
        speed=nominal.speed * (1.0 + chain.speed_setting * float(e[2])),
        slip_angle=nominal.slip_angle + chain.angle_setting * float(e[3]),
        camber=nominal.camber + chain.angle_setting * float(e[4]),
        slip_ratio=None if slip is None else slip + chain.slip_setting * float(e[5]),
    )


def slip_ratio(state: RigState) -> float:
    """Return kappa = (Omega R_e - v) / v of a state, v the travel speed.

    A wheel that rolls freely at a slip angle alpha turns at v cos(alpha) / R_e, so it reads
    cos(alpha) - 1: -0.004 at 5 deg.
    """
    return state.omega * state.free_radius / state.condition.speed - 1.0


def record(stages: Sequence[Stage], chain: MeasuringChain, seed: int, run: int) -> Recording:
    """Measure a state for some turns, or the states that a wheel passes through.

    Between two stages the turn rate, the rig's channels and the strain at each wheel angle lie on
    straight lines over time; the wheel angle is the integral of the turn rate. Run-out a makes the
    load swing by k_z a cos(phi - phi_a) once per turn; the strain follows by its derivative with
    load.
    """
    rng = np.random.default_rng([seed, run, 1])
    if len(stages) == 1:
        (stage,) = stages
        end = chain.turns * 2.0 * np.pi / stage.state.omega
        stages = (stage, replace(stage, time=end))
    sensors = gages(stages[0].state.tire, chain)
    n = int(np.ceil(stages[-1].time * chain.gage_rate))
    time = np.arange(n) / chain.gage_rate
    start = -np.pi - 0.05 * 2.0 * np.pi * float(rng.uniform(0.2, 1.0))
    phi = start + _turned(stages, time)
    swing = chain.run_out * _along(stages, time, [s.state.stiffness for s in stages])
    strain = _strain(stages, time, phi, swing * np.cos(phi - sensors.run_out_angle))
    drift = _drift(chain, seed) * (run * chain.run_spacing + time)
    gain = sensors.gain * (1.0 + chain.gain_repeatability * rng.standard_normal(N_STRIPS))
    noise = chain.gage_noise * rng.standard_normal(strain.shape)
    raw = strain * gain[:, None] + sensors.offset[:, None] + drift + noise
    turn = np.floor((phi + np.pi) / (2.0 * np.pi))
    trigger = np.concatenate([[False], np.diff(turn) > 0.0])
    rig_time = np.arange(int(time[-1] * chain.rig_rate) + 1) / chain.rig_rate
    wheel = start + _turned(stages, rig_time)
    swing = chain.run_out * _along(stages, rig_time, [s.state.stiffness for s in stages])
    rig = _rig(stages, rig_time, swing * np.cos(wheel - sensors.run_out_angle), chain, rng)
    return Recording(_quantise(raw, chain), trigger, rig, rig_time)


def _along(stages: Sequence[Stage], time: Array, values: Sequence[float]) -> Array:
    """Return what has these values at the stages, at any times."""
    return np.asarray(np.interp(time, [s.time for s in stages], values), dtype=np.float64)


def _segments(stages: Sequence[Stage], time: Array) -> NDArray[np.intp]:
    """Return the number of the stage that each time follows; the last one ends a segment."""
    inner = [s.time for s in stages[1:-1]]
    return np.searchsorted(inner, time, side="right")


def _turned(stages: Sequence[Stage], time: Array) -> Array:
    """Return the angle by which the gages have turned since the start [rad].

    Under torque the belt winds up, so the gages turn further than the rim by the wind-up.
    """
    at, omega = np.array([s.time for s in stages]), np.array([s.state.omega for s in stages])
    whole = np.concatenate(([0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]) * np.diff(at))))
    k = _segments(stages, time)
    rim = whole[k] + 0.5 * (omega[k] + np.interp(time, at, omega)) * (time - at[k])
    wound = [winding(s.state) for s in stages]
    return np.asarray(rim + (_along(stages, time, wound) - wound[0]))


def _strain(stages: Sequence[Stage], time: Array, phi: Array, extra_load: Array) -> Array:
    """Strain of the gages along the stages at angles phi, shape (5, n)."""
    out = np.empty((N_STRIPS, len(time)))
    number = _segments(stages, time)
    for k, (a, b) in enumerate(pairwise(stages)):
        here = number == k
        share = (time[here] - a.time) / (b.time - a.time)
        before, after = (_sample(s.trace, phi[here], extra_load[here]) for s in (a, b))
        out[:, here] = before + share * (after - before)
    return out


def _sample(trace: Trace, phi: Array, extra_load: Array) -> Array:
    """Strain of the gages at angles phi, shape (5, n); the trace is fine enough to be linear."""
    n = len(trace.phi)
    place = (phi - trace.phi[0]) / (2.0 * np.pi) * n
    low = np.floor(place).astype(np.intp)
    part = (place - low)[:, None]
    a, b = low % n, (low + 1) % n
    strain = (1.0 - part) * trace.strain[a] + part * trace.strain[b]
    by_load = (1.0 - part) * trace.by_load[a] + part * trace.by_load[b]
    return np.asarray((strain + by_load * extra_load[:, None]).T)


def _drift(chain: MeasuringChain, seed: int) -> Array:
    rng = np.random.default_rng([seed, 2])
    return chain.gage_drift * rng.standard_normal((N_STRIPS, 1))


def _quantise(strain: Array, chain: MeasuringChain) -> Array:
    step = 2.0 * chain.gage_range / 2**chain.gage_bits
    code = np.clip(np.round(strain / step), -(2 ** (chain.gage_bits - 1)), None)
    return np.asarray(np.minimum(code, 2 ** (chain.gage_bits - 1) - 1) * step)


def _rig(
    stages: Sequence[Stage],
    time: Array,
    swing: Array,
    chain: MeasuringChain,
    rng: np.random.Generator,
) -> dict[str, Array]:
    sigma = {
        "Fx": chain.force_noise,
        "Fy": chain.force_noise,
        "Fz": chain.force_noise,
        "Mz": chain.moment_noise,
        "slip_angle": chain.angle_noise,
        "camber": chain.angle_noise,
        "slip_ratio": chain.slip_noise,
        "speed": chain.speed_noise,
        "omega": chain.omega_noise,
        "pressure": chain.pressure_noise,
        "loaded_radius": chain.radius_noise,
    }
    true = [_true(stage) for stage in stages]
    out = {}
    for name, size in sigma.items():
        value = _along(stages, time, [t[name] for t in true])
        value = value + swing if name == "Fz" else value
        out[name] = np.asarray(value + size * rng.standard_normal(len(time)))
    return out


def _true(stage: Stage) -> dict[str, float]:
    state, force, cond = stage.state, stage.force, stage.state.condition
    return {
        "Fx": force.fx,
        "Fy": force.fy,
        "Fz": force.fz,
        "Mz": force.aligning,
        "slip_angle": cond.slip_angle,
        "camber": cond.camber,
        "slip_ratio": slip_ratio(state),
        "speed": cond.speed,
        "omega": state.omega,
        "pressure": cond.pressure,
        "loaded_radius": float(state.height / np.cos(cond.camber)),
    }
