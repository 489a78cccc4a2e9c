"""The measuring chain: what loggers write of a solved run.

Gages have gain, offset and a slow drift, white noise, 14 bits and a gain that repeats from run to
run within its tolerance; the rig misses its set points a little; its channels are noisy; the tire
runs out by a tenth of a millimetre; the trigger comes a little late. A campaign's seed draws the
size of each (a laboratory), and every random number.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from continuum.observe import Trace
from continuum.polar import Array
from continuum.solve import State
from continuum.tire import Condition

GAGES = 5


@dataclass(frozen=True)
class Laboratory:
    """Sizes of the errors, one sigma where random, SI; `gain` and `offset` are the gages' own."""

    seed: int
    gain: Array
    offset: Array
    drift: Array
    run_out_angle: float
    delay: float
    noise: float
    gain_repeat: float
    load_error: float
    pressure_error: float
    speed_error: float
    rate: float = 10_000.0
    rig_rate: float = 100.0
    turns: float = 5.1
    range: float = 0.025
    bits: int = 14
    force_noise: float = 30.0
    speed_noise: float = 0.01
    pressure_noise: float = 200.0
    radius_noise: float = 5e-5
    run_out: float = 1e-4


def laboratory(seed: int) -> Laboratory:
    """Draw a laboratory: errors of usual size, each within a factor of 1.5."""
    rng = np.random.default_rng([seed, 4102])

    def about(size: float) -> float:
        return size * float(1.5 ** rng.uniform(-1.0, 1.0))

    return Laboratory(
        seed=seed,
        gain=1.0 + 0.01 * rng.standard_normal(GAGES),
        offset=3e-5 * rng.standard_normal(GAGES),
        drift=1.5e-8 * rng.standard_normal(GAGES),
        run_out_angle=float(rng.uniform(-np.pi, np.pi)),
        delay=float(rng.uniform(0.0, 1e-4)),
        noise=about(4e-6),
        gain_repeat=about(0.003),
        load_error=about(0.005),
        pressure_error=about(0.002),
        speed_error=about(0.001),
    )


def settled(lab: Laboratory, nominal: Condition, run: int) -> Condition:
    """Return the condition that the rig really held."""
    e = np.random.default_rng([lab.seed, 4103, run]).standard_normal(3)
    return replace(
        nominal,
        load=nominal.load * (1.0 + lab.load_error * float(e[0])),
        pressure=nominal.pressure * (1.0 + lab.pressure_error * float(e[1])),
        speed=nominal.speed * (1.0 + lab.speed_error * float(e[2])),
    )


@dataclass(frozen=True)
class Recording:
    """What is written: strain (5, n), trigger (n,), and the rig's channels by name."""

    strain: Array
    trigger: NDArray[np.bool_]
    rig: dict[str, Array]
    rig_time: Array


def record(lab: Laboratory, state: State, seen: Trace, run: int, start: float) -> Recording:
    """Measure a run that starts at a time of the campaign [s]."""
    rng = np.random.default_rng([lab.seed, 4104, run])
    omega = state.omega
    count = int(np.ceil(lab.turns * 2.0 * np.pi / omega * lab.rate))
    time = np.arange(count) / lab.rate
    first = -np.pi - float(rng.uniform(0.05, 0.3))
    phi = first + omega * time
    swing = lab.run_out * state.stiffness
    strain = _at(seen, phi, swing * np.cos(phi - lab.run_out_angle))
    gain = lab.gain * (1.0 + lab.gain_repeat * rng.standard_normal(GAGES))
    slow = lab.drift[:, None] * (start + time)
    noise = lab.noise * rng.standard_normal(strain.shape)
    raw = strain * gain[:, None] + lab.offset[:, None] + slow + noise
    if np.abs(raw).max() >= lab.range:
        raise ArithmeticError(
            f"run {run}: a gage shows {1e6 * np.abs(raw).max():.0f} microstrain; its range is "
            f"{1e6 * lab.range:.0f}; give a wider range, or a tire whose innerliner is nearer to "
            "the belt"
        )
    step = 2.0 * lab.range / 2**lab.bits
    shown = np.round(raw / step) * step
    turn = np.floor((phi - omega * lab.delay + np.pi) / (2.0 * np.pi))
    trigger = np.concatenate([[False], np.diff(turn) > 0.0])
    rig_time = np.arange(int(time[-1] * lab.rig_rate) + 1) / lab.rig_rate
    wheel = first + omega * rig_time - lab.run_out_angle
    return Recording(shown, trigger, _channels(lab, state, rng, swing * np.cos(wheel)), rig_time)


def _at(seen: Trace, phi: Array, more: Array) -> Array:
    """Return the gages' strain at angles and extra loads, shape (5, n)."""
    count = len(seen.phi)
    place = (phi - seen.phi[0]) / (2.0 * np.pi) * count
    low = np.floor(place).astype(np.intp)
    part = (place - low)[:, None]

    def read(values: Array) -> Array:
        return np.asarray((1.0 - part) * values[low % count] + part * values[(low + 1) % count])

    return np.asarray((read(seen.strain) + read(seen.by_load) * more[:, None]).T)


def _channels(
    lab: Laboratory, state: State, rng: np.random.Generator, swing: Array
) -> dict[str, Array]:
    cond, road = state.balance.cond, state.balance.road
    size, zero = len(swing), np.zeros(len(swing))
    true = {
        "Fx": (road.forward + zero, lab.force_noise),
        "Fy": (zero, lab.force_noise),
        "Fz": (road.load + swing, lab.force_noise),
        "Mz": (zero, 0.5),
        "slip_angle": (zero, 2e-4),
        "camber": (zero, 2e-4),
        "slip_ratio": (zero, 3e-4),
        "speed": (cond.speed + zero, lab.speed_noise),
        "omega": (state.omega + zero, 0.01),
        "pressure": (cond.pressure + zero, lab.pressure_noise),
        "loaded_radius": (state.height + zero, lab.radius_noise),
    }
    return {
        name: np.asarray(value + sigma * rng.standard_normal(size))
        for name, (value, sigma) in true.items()
    }
