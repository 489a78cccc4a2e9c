"""Campaigns of the families' tires: plan, day, and what is hidden.

    case("string", 12)                                   a plain tire
    case("magic", 101, "friction_pressure", 0.15)        with something hidden

A plan is drawn with the seed: sweeps of the slip or steady runs, which conditions vary, in order or
at random, with or without tread temperature. So is the day: set points that are off alike in a run,
noise, a friction that drifts by a percent, a slip angle that comes late.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from force_tires.families import FAMILIES, Changes, Setting
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.inference.identify.force_data import ForceData

RATE, PERIOD, PAUSE = 12.0, 12.0, 8.0
"""Samples a second, length of a sweep and pause after it [s]."""
ANGLE_OFF, LOAD_OFF, PRESSURE_OFF = 2e-4, 0.003, 0.003
"""Errors of a run, alike in all its samples: slip angle [rad], load and pressure (relative)."""
DRIFT = 0.007
"""Rms of the drift of friction, and of stiffness, over a campaign."""
LATE = 0.005
"""Largest time by which the slip angle comes late [s]."""


@dataclass(frozen=True)
class Law:
    """What can be hidden: a strength that shows clearly, the conditions it needs, and its law."""

    visible: float
    needs: tuple[str, ...]
    law: Callable[[Setting, "Middle", float], dict[str, FloatArray]]
    signed: bool = True


@dataclass(frozen=True)
class Middle:
    """Where laws change nothing, SI."""

    load: float
    pressure: float


def _df(at: Setting, m: Middle) -> FloatArray:
    return np.asarray(at.load / m.load - 1.0)


def _dp(at: Setting, m: Middle) -> FloatArray:
    return np.asarray(at.pressure / m.pressure - 1.0)


def _dt(at: Setting) -> FloatArray:
    return np.asarray((at.temperature - 328.0) / 25.0)


def _sliding(at: Setting) -> FloatArray:
    slip = np.hypot(at.slip_ratio, np.tan(at.slip_angle))
    return np.asarray(np.abs(at.speed) * slip)


KNOWN = {
    "friction_load": Law(
        0.1, ("load",), lambda at, m, s: {"friction": 1 - s * np.tanh(_df(at, m))}, signed=False
    ),
    "stiffness_load": Law(
        0.25,
        ("load",),
        lambda at, m, s: {"stiffness": 1 - s * _df(at, m) ** 2 / (1 + 0.5 * _df(at, m))},
        signed=False,
    ),
    "friction_pressure": Law(
        0.2, ("pressure",), lambda at, m, s: {"friction": 1 - s * _dp(at, m) * (1 + _dp(at, m))}
    ),
    "stiffness_pressure": Law(
        0.35, ("pressure",), lambda at, m, s: {"stiffness": 1 + s * np.sin(1.5 * _dp(at, m)) / 1.5}
    ),
    "friction_temperature": Law(
        0.08,
        ("temperature",),
        lambda at, m, s: {"friction": 1 - s * (_dt(at) + 0.2 * _dt(at) ** 2)},
    ),
    "stiffness_temperature": Law(
        0.12, ("temperature",), lambda at, m, s: {"stiffness": 1 / (1 + s * _dt(at))}
    ),
    "friction_speed": Law(
        0.12,
        ("speed",),
        lambda at, m, s: {"friction": 1 - s * np.log1p(_sliding(at) / 1.5)},
        signed=False,
    ),
    "brush_camber": Law(
        0.12, ("camber",), lambda at, m, s: {"angle": s * at.camber * (1 + 0.2 * _df(at, m))}
    ),
    "friction_drift": Law(0.08, (), lambda at, m, s: {"friction": 1 - s * np.sqrt(at.order)}),
    "stiffness_drift": Law(
        0.12, (), lambda at, m, s: {"stiffness": 1 - s * (1 - np.exp(-2 * at.order))}
    ),
    "relaxation": Law(
        0.3,
        ("sweep",),
        lambda at, m, s: {
            "angle": -s * (at.load / m.load) ** 0.3 * at.slip_rate / np.abs(at.speed)
        },
        signed=False,
    ),
    "conicity": Law(
        0.03, ("load",), lambda at, m, s: {"side": s * at.load * (at.load / m.load) ** 0.2}
    ),
    "ply_steer": Law(
        0.008,
        ("ways",),
        lambda at, m, s: {"angle": s * np.sign(at.speed) * (1 + 0.1 * _df(at, m))},
    ),
}
UNKNOWN = {
    "one_sided_friction": Law(
        0.08, (), lambda at, m, s: {"friction": 1 + s * np.tanh(at.slip_angle / 0.02)}
    ),
    "stick_slip": Law(
        0.05, (), lambda at, m, s: {"side": s * at.load * np.sin(at.slip_angle / 0.015)}
    ),
    "load_crosstalk": Law(
        0.05,
        ("load",),
        lambda at, m, s: {"side": s * (at.load - m.load) * np.cos(20 * at.slip_angle)},
    ),
    "camber_softens": Law(
        40.0, ("camber",), lambda at, m, s: {"stiffness": 1 / (1 + s * at.camber**2)}, signed=False
    ),
    "day_by_day": Law(
        0.04, (), lambda at, m, s: {"friction": 1 + s * np.sign(np.sin(30 * at.order))}
    ),
    "low_load_grip": Law(
        0.15,
        ("load",),
        lambda at, m, s: {"friction": 1 + s * np.exp(-((at.load / m.load / 0.6) ** 4))},
    ),
}
LAWS = {**KNOWN, **UNKNOWN}


def case(
    family: str, seed: int, kind: str = "none", strength: float = 1.0, quantity: str = "Fy"
) -> ForceData:
    """Return the samples of a campaign; `strength` is over that which shows clearly."""
    random = np.random.default_rng([sum(map(ord, family)), seed])
    tire = FAMILIES[family](random)
    needs = () if kind == "none" else LAWS[kind].needs
    run, at = _plan(random, tire.nominal, needs, quantity)
    middle = Middle(float(np.exp(np.mean(np.log(at.load)))), float(np.median(at.pressure)))
    n, runs = at.load.size, int(run.max()) + 1

    def off(size: float) -> FloatArray:
        return np.asarray(size * random.standard_normal(runs)[run])

    really = Setting(
        **{
            **vars(at),
            "load": at.load * (1.0 + off(LOAD_OFF)),
            "pressure": at.pressure * (1.0 + off(PRESSURE_OFF)),
            "slip_angle": at.slip_angle
            + off(ANGLE_OFF)
            - random.uniform(-LATE, LATE) * at.slip_rate,
        }
    )
    none, one = np.zeros(n), np.ones(n)
    every = {"friction": one, "stiffness": one, "angle": none, "side": none, "flatter": none}
    every |= {"turn": none}
    sign = random.choice([-1.0, 1.0])
    for name in ("friction", "stiffness"):
        nodes = random.standard_normal(5)
        every[name] = 1.0 + DRIFT * np.interp(at.order, np.linspace(0.0, 1.0, 5), nodes)
    if kind != "none":
        law = LAWS[kind]
        size = strength * law.visible * (sign if law.signed else 1.0)
        for name, value in law.law(really, middle, size).items():
            both = every[name] * value if name in ("friction", "stiffness") else every[name] + value
            every[name] = both
    Fx, Fy, Mz = tire.forces(really, Changes(**every))
    level = random.uniform(0.002, 0.01) * tire.nominal
    Fx, Fy = (force + level * random.standard_normal(n) for force in (Fx, Fy))
    Mz = Mz + 0.02 * level * random.standard_normal(n)
    gone = np.full(n, np.nan)
    known = random.random() < 0.6 or "temperature" in needs
    time = at.order * n / RATE + PAUSE * run if at.slip_rate.any() else PAUSE * np.arange(n)
    return ForceData(
        at.load,
        at.pressure,
        at.slip_angle,
        at.slip_ratio,
        at.camber,
        np.sign(at.speed) * 40.0,
        Fx if quantity == "Fx" else gone,
        gone if quantity == "Fx" else Fy,
        gone if quantity == "Fx" else Mz,
        run.astype(np.int64),
        np.abs(at.speed),
        at.temperature if known else gone,
        time,
    )


def _plan(
    random: np.random.Generator, nominal: float, needs: tuple[str, ...], quantity: str
) -> tuple[IntArray, Setting]:
    """Return the number of each sample's run, and the conditions as the rig was set."""

    def several(name: str, chance: float, values: list[float]) -> list[float]:
        wanted = random.random() < chance or name in needs
        return values if wanted else values[:1]

    sweep = bool(random.random() < 0.6) or "sweep" in needs
    loads = [
        x * nominal for x in np.linspace(random.uniform(0.3, 0.45), 1.5, random.integers(3, 6))
    ]
    low = float(random.uniform(0.9e5, 2.2e5))
    pressures = several("pressure", 0.6, [low, 1.2 * low, 1.4 * low][: random.integers(2, 4)])
    cambers = np.deg2rad(several("camber", 0.5, [0.0, float(random.uniform(2, 4)), 5.0][:2]))
    speeds = several("speed", 0.3, [10.0, 20.0])
    ways = several("ways", 0.2, [1.0, -1.0])
    top = float(random.uniform(6.0, 12.0))
    conditions = [
        (load, p, c, v * w)
        for p in pressures
        for v in speeds
        for w in ways
        for c in cambers
        for load in loads
    ]
    if len(conditions) > 48:
        chosen = random.choice(len(conditions), 48, replace=False)
        conditions = [conditions[k] for k in sorted(chosen)]
    if random.random() < 0.5:
        random.shuffle(conditions)
    if random.random() < 0.5:
        conditions += conditions[: len(loads)]  # the first ones again, at the end
    if sweep:
        within = np.arange(int(PERIOD * RATE)) / RATE
        one = np.sin(4.0 * np.pi * within / PERIOD)
    else:
        one = np.repeat(np.linspace(-1.0, 1.0, 9), 2)
    count = one.size
    n = count * len(conditions)
    columns = [np.repeat([c[k] for c in conditions], count) for k in range(4)]
    slip = np.tile(one, len(conditions))
    angle = np.deg2rad(top) * slip if quantity != "Fx" else np.zeros(n)
    ratio = 0.018 * top * slip if quantity == "Fx" else np.zeros(n)
    rate = np.zeros(n)
    if sweep and quantity != "Fx":
        rate = np.gradient(angle.reshape(-1, count), 1.0 / RATE, axis=1).ravel()
    work = np.cumsum(np.abs(slip).reshape(-1, count), axis=1).ravel() / count
    warm = 318.0 + 15.0 * work * np.sqrt(columns[0] / max(loads)) + random.uniform(0.0, 8.0)
    if sweep:
        run = np.repeat(np.arange(len(conditions)), count)
    else:
        run = np.arange(n)
        warm = warm + 10.0 * np.repeat(random.random(len(conditions)), count)
    order = np.arange(n) / (n - 1.0)
    warm = warm + 0.3 * random.standard_normal(n)
    return run, Setting(
        columns[0], columns[1], angle, ratio, columns[2], columns[3], warm, rate, order
    )
