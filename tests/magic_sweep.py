"""Slip-angle sweeps of a tire that is no brush: a Magic Formula whose constants are drawn anew.

Its laws of load, pressure, temperature and camber have other forms than the effects' laws.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.inference.identify.force_data import ForceData

LOADS = (500.0, 1100.0, 1700.0, 2300.0, 2900.0)
PRESSURES = (0.7e5, 0.83e5, 0.97e5)
CAMBERS = tuple(np.deg2rad([0.0, 1.6, 3.2]))
RATE, PERIOD, GAP, SPEED = 25.0, 12.0, 20.0, 11.0
TOP_ANGLE = float(np.deg2rad(9.0))
PLANTS = {
    "friction_load": {"friction_load": 0.12},
    "stiffness_load": {"stiffness_load": 0.35},
    "pressure": {"friction_pressure": 0.15, "stiffness_pressure": 0.25},
    "friction_pressure": {"friction_pressure": 0.2},
    "stiffness_pressure": {"stiffness_pressure": 0.4},
    "friction_temperature": {"friction_temperature": 0.2},
    "stiffness_temperature": {"stiffness_temperature": 0.4},
    "brush_camber": {"brush_camber": 0.15},
    "relaxation": {"relaxation": 0.3},
}


@dataclass(frozen=True)
class Sweep:
    """Plan of a sweep: one sweep of the slip angle for each load, pressure and camber."""

    loads: tuple[float, ...] = LOADS
    pressures: tuple[float, ...] = PRESSURES
    cambers: tuple[float, ...] = CAMBERS
    twice: bool = True
    noise: float = 15.0


def magic_sweep(seed: int, planted: dict[str, float], plan: Sweep = Sweep()) -> ForceData:
    """Return the samples of a sweep, SI, ISO; `planted` holds relative changes over the plan."""
    rng = np.random.default_rng(seed)
    segments = [(f, p, g) for p in plan.pressures for g in plan.cambers for f in plan.loads]
    count = int(PERIOD * RATE)
    within = np.arange(count) / RATE
    turns = 2.0 if plan.twice else 1.0
    angle = TOP_ANGLE * np.sin(2.0 * np.pi * turns * within / PERIOD)
    n = count * len(segments)
    time = np.concatenate([within + k * (PERIOD + GAP) for k in range(len(segments))])
    alpha = np.tile(angle, len(segments)) + 2e-4 * rng.standard_normal(n)
    load, pressure, camber = (np.repeat([s[i] for s in segments], count) for i in range(3))
    load = load * (1.0 + 0.02 * np.sin(40.0 * time) + 0.005 * rng.standard_normal(n))
    pressure = pressure * (1.0 + 0.004 * rng.standard_normal(n))
    warm = np.cumsum(np.tile(np.abs(angle), len(segments)).reshape(-1, count), axis=1).ravel()
    warm = warm / warm.max()
    temperature = 328.0 + 15.0 * warm * (load / max(plan.loads)) ** 0.5
    temperature = temperature + 0.3 * rng.standard_normal(n)
    rate = np.gradient(np.tile(angle, len(segments)).reshape(-1, count), 1.0 / RATE, axis=1).ravel()
    lag = planted.get("relaxation", 0.0) / SPEED * rate
    side = _force(rng, planted, load, pressure, camber, temperature, alpha - lag, time)
    side = side + plan.noise * rng.standard_normal(n)
    nothing = np.full(n, np.nan)
    return ForceData(
        load,
        pressure,
        alpha,
        np.zeros(n),
        camber,
        nothing,
        nothing,
        side,
        nothing,
        np.floor(time / 11.0).astype(np.int64),
        np.full(n, SPEED),
        temperature,
        time,
    )


def _force(
    rng: np.random.Generator,
    planted: dict[str, float],
    load: np.ndarray,
    pressure: np.ndarray,
    camber: np.ndarray,
    temperature: np.ndarray,
    alpha: np.ndarray,
    time: np.ndarray,
) -> np.ndarray:
    """Return Fy: shape C, curvature E, slope K, peak D, shifts, each drawn; ISO."""
    nominal = 1800.0
    df, dp, dt = load / nominal - 1.0, pressure / 0.83e5 - 1.0, (temperature - 335.0) / 50.0
    mu = rng.uniform(0.95, 1.25)
    mu = mu * (1.0 - planted.get("friction_load", 0.0) * df)
    mu = mu * (1.0 - planted.get("friction_pressure", 0.0) * dp * (1.0 + 0.5 * dp))
    mu = mu * (1.0 - planted.get("friction_temperature", 0.0) * (dt + 0.4 * dt**2))
    mu = mu * (1.0 + 0.005 * np.sin(2.0 * np.pi * time / rng.uniform(500.0, 2000.0)))
    slope = rng.uniform(11.0, 16.0) * nominal * (load / nominal) ** rng.uniform(0.6, 0.95)
    slope = slope * (1.0 + rng.normal(0.0, 0.02) * np.log(load / nominal) ** 2)
    # stiffness that levels off toward a load
    slope = slope * (1.0 - planted.get("stiffness_load", 0.0) * df**2 / (1.0 + 0.5 * df))
    slope = slope * (1.0 + planted.get("stiffness_pressure", 0.0) * dp * (1.0 - 0.5 * dp))
    slope = slope * (1.0 - planted.get("stiffness_temperature", 0.0) * dt)
    shape, bend = rng.uniform(1.15, 1.5), rng.uniform(-1.0, 0.4)
    peak = mu * load
    x = alpha + rng.normal(0.0, 0.002)
    x = x + planted.get("brush_camber", 0.0) * camber * (1.0 + 0.2 * df)
    b = slope / (shape * peak)
    e = bend * (1.0 + 0.1 * np.sign(x))
    inside = b * x - e * (b * x - np.arctan(b * x))
    out: np.ndarray = -peak * np.sin(shape * np.arctan(inside)) + rng.normal(0.0, 10.0)
    return out
