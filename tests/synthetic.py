"""A strain waveform in closed form, for tests of what reads waveforms. It is no tire model."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tirelib.campaign import (
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    Tolerance,
    write_campaign,
)

FloatArray = npt.NDArray[np.float64]
LATERAL = (0.06, 0.03, 0.0, -0.03, -0.06)
RATE = 1e4


def wrapped(phi: FloatArray) -> FloatArray:
    """Wheel angle in [-pi, pi)."""
    return np.asarray((phi + np.pi) % (2.0 * np.pi) - np.pi)


def waveform(
    phi: FloatArray,
    *,
    half: float = 0.2,
    tension: float = 8e-3,
    dip: float = 3e-3,
    imbalance: float = 0.0,
    edge: float = 0.05,
) -> FloatArray:
    """Strain over wheel angle: a plateau with smooth edges at +-half, dips just outside."""
    x = wrapped(phi)
    plateau = 0.5 * (np.tanh((x + half) / edge) - np.tanh((x - half) / edge))
    before = np.exp(-(((x + half + 0.15) / 0.12) ** 2))
    after = np.exp(-(((x - half - 0.15) / 0.12) ** 2))
    dips = (dip - imbalance) * before + (dip + imbalance) * after
    return np.asarray(tension * plateau - dips)


def record(
    *,
    turns: float = 5.0,
    speed: float = 18.0,
    radius: float = 0.305,
    start: float = np.pi,
    half: float = 0.2,
    tension: float = 8e-3,
    dip: float = 3e-3,
    imbalance: float = 0.0,
    tilt: float = 0.0,
    offset: float = 2.7e-3,
    noise: float = 0.0,
    rate: float = RATE,
    gages: int = 5,
    seed: int = 0,
) -> tuple[FloatArray, npt.NDArray[np.bool_], float]:
    """Strain of several gages over time, the trigger, and the turn rate [rad/s].

    `tilt` makes contact length and dips grow over the lateral position, as a slip angle does.
    """
    omega = speed / radius
    n = int(turns * 2.0 * np.pi / omega * rate)
    phi = start + omega * np.arange(n) / rate
    rng = np.random.default_rng(seed)
    side = np.array(LATERAL[:gages]) / 0.06
    rows = [
        waveform(
            phi,
            half=half * (1 + tilt * s),
            tension=tension * (1 + 0.3 * tilt * s),
            dip=dip * (1 + 2 * tilt * s),
            imbalance=imbalance,
        )
        for s in side
    ]
    strain = np.stack(rows) + offset + noise * rng.standard_normal((gages, n))
    top = np.floor((phi - np.pi) / (2.0 * np.pi))
    trigger = np.concatenate(([False], np.diff(top) > 0.5))
    return strain, trigger, omega


def frames(n: int, longest: int, seed: int) -> list[slice]:
    """Cut n samples into frames of random lengths from 1 to `longest`."""
    rng = np.random.default_rng(seed)
    ends = np.cumsum(rng.integers(1, longest + 1, size=n))
    ends = np.append(ends[ends < n], n)
    return [slice(int(a), int(b)) for a, b in zip(np.append(0, ends[:-1]), ends, strict=True)]


def cornering_force(load: float, slip_angle: float) -> float:
    """Lateral force, ISO signs, of the made-up tire."""
    return float(-0.8 * load * np.tanh(slip_angle / np.deg2rad(4.0)))


def synthetic_run(
    run: int,
    *,
    load: float = 4000.0,
    slip_angle: float = 0.0,
    slip_ratio: float = 0.0,
    pressure: float = 2.3e5,
    speed: float = 18.0,
    camber: float = 0.0,
    noise: float = 4e-6,
    turns: float = 4.6,
    kind: str = "corner",
    seed: int = 0,
) -> Run:
    """One run of a made-up tire whose contact grows with load and leans with lateral force."""
    rng = np.random.default_rng([run, seed])
    force = cornering_force(load, slip_angle)
    radius = 0.312 - 1.0e-6 * load * 2.3e5 / pressure
    strain, trigger, omega = record(
        turns=turns,
        speed=speed,
        radius=radius / (1.0 + slip_ratio),
        start=float(rng.uniform(-3.0, 3.0)),
        half=0.04 + 2.6e-5 * load * 2.3e5 / pressure,
        dip=1e-3 + 3e-7 * load,
        imbalance=-2e-3 * float(np.tanh(20.0 * slip_ratio)),
        tilt=0.25 * force / load,
        noise=noise,
        seed=int(rng.integers(1 << 30)),
    )
    n = int(strain.shape[1] / RATE * 100.0)

    def measured(value: float, scatter: float) -> FloatArray:
        return value + scatter * rng.standard_normal(n)

    return Run(
        plan=RunPlan(
            run,
            f"runs/{run:03d}.mf4",
            kind,
            load,
            pressure,
            speed,
            slip_angle,
            camber,
            slip_ratio,
            start=12.0 * run,
            friction=0.9,
            tread_depth=0.008,
            tread_temperature=313.15,
        ),
        strain=strain,
        rate=RATE,
        trigger=trigger,
        rig={
            "Fx": measured(2e4 * slip_ratio, 20.0),
            "Fy": measured(force, 20.0),
            "Fz": measured(load, 20.0),
            "slip_angle": measured(slip_angle, 3e-4),
            "camber": measured(camber, 3e-4),
            "slip_ratio": measured(slip_ratio, 2e-4),
            "speed": measured(speed, 5e-3),
            "omega": measured(omega, 5e-3),
            "pressure": measured(pressure, 300.0),
        },
        rig_time=np.arange(n) / 100.0,
    )


def header(
    name: str = "synthetic", tire: str = "made-up tire", axes: str = "iso"
) -> CampaignHeader:
    """Header of a campaign of the made-up tire."""
    return CampaignHeader(
        name=name,
        axes=axes,
        tire=TireGeometry(tire, 0.3155, 0.302, 0.012, 0.165, -0.0033),
        gage_lateral=LATERAL,
        rate=RATE,
        tolerance=Tolerance(0.005, 0.002, 0.001, 0.003),
        rig_name="closed-form waveforms",
    )


LOADS = (1500.0, 3000.0, 4500.0, 6000.0, 7500.0)
ANGLES = tuple(float(np.deg2rad(a)) for a in (-5.0, -3.0, -1.0, 0.0, 1.0, 3.0, 5.0))


def cornering_runs(seed: int = 0, **options: float) -> list[Run]:
    """Five loads times seven slip angles."""
    conditions = [(load, angle) for load in LOADS for angle in ANGLES]
    return [
        synthetic_run(i, load=load, slip_angle=angle, seed=seed, **options)
        for i, (load, angle) in enumerate(conditions)
    ]


def write(folder: Path, runs: Iterable[Run], **options: str) -> Path:
    """Write a campaign of the made-up tire and return its folder."""
    write_campaign(folder, header(**options), runs)
    return folder
