"""A small synthetic campaign: right in kind (contact peak between two dips), not in number."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tirelib.campaign import CampaignHeader, FloatArray, Run, RunPlan, TireGeometry, Tolerance
from tirelib.campaign.mdf import Group, read_mdf, write_mdf

Write = Callable[..., Path]

RATE = 5000.0
RADIUS = 0.32
SPEED = 65.0 / 3.6
LATERAL = (0.06, 0.03, 0.0, -0.03, -0.06)
TURNS = 3.3

HEADER = CampaignHeader(
    name="synthetic",
    axes="adapted_sae",
    tire=TireGeometry("test tire", RADIUS, 0.305, 0.012, 0.165, -0.0033),
    gage_lateral=LATERAL,
    rate=RATE,
    strain_unit="ustrain",
    tolerance=Tolerance(0.005, 0.002, 0.001, 0.003),
    rig_name="synthetic rig",
    rig_note="made by a test",
)


def turn_strain(angle: FloatArray, load: float, lateral_force: float, y: float) -> FloatArray:
    """Strain over the wheel angle: offset, plateau in the contact, dips beside it."""
    half = 0.10 + 2e-5 * load * (1.0 + 5e-4 * lateral_force * y)
    away = np.abs((angle + np.pi) % (2 * np.pi) - np.pi)
    contact = 1.0 / (1.0 + np.exp((away - half) / 0.03))
    dips = np.exp(-(((away - half - 0.12) / 0.15) ** 2)) * (1.0 - contact)
    # the lateral force presses one shoulder flat and relieves the other
    shoulder = 1.0 + lateral_force / 1e3 * y
    return 0.0025 + 0.008 * contact * shoulder - 0.0005 * load / 1e3 * dips / shoulder


def make_run(
    run: int, load: float, slip_angle: float, *, start: float | None = None, turns: float = TURNS
) -> Run:
    """One steady run at a load, N, and a slip angle, rad."""
    random = np.random.default_rng(run)
    lateral_force = -6e4 * slip_angle * load / 5e3
    omega = SPEED / (0.98 * RADIUS)
    count = int(turns * 2 * np.pi / omega * RATE)
    angle = -np.pi + 0.4 + omega * np.arange(0.0, count) / RATE
    strain = np.stack([turn_strain(angle, load, lateral_force, y) for y in LATERAL])
    offsets = 4e-5 * np.array([1.0, -1.5, 0.5, 0.2, -0.8])[:, None]
    strain = strain + offsets + 3e-6 * random.standard_normal(strain.shape)
    strain = np.round(strain / 2.5e-6) * 2.5e-6  # 14 bit
    trigger = np.diff(np.floor((angle + np.pi) / (2 * np.pi)), prepend=0.0) > 0.0
    times = np.arange(0.0, count / RATE, 0.01)
    means = {
        "Fx": 0.0,
        "Fy": lateral_force,
        "Fz": load,
        "Mz": -0.03 * lateral_force,
        "slip_angle": slip_angle,
        "camber": 0.0,
        "slip_ratio": 0.0,
        "speed": SPEED,
        "omega": omega,
        "pressure": 2.3e5,
        "loaded_radius": RADIUS - load / 2.2e5,
    }
    spread = {"Fx": 20.0, "Fy": 20.0, "Fz": 20.0, "Mz": 1.0, "slip_angle": 5e-4, "camber": 5e-4}
    rig = {
        name: mean + spread.get(name, 2e-3 * abs(mean) + 1e-4) * random.standard_normal(times.size)
        for name, mean in means.items()
    }
    kind = "corner" if slip_angle else "free"
    plan = RunPlan(
        run, f"runs/{run:03d}.mf4", kind, load, 2.3e5, SPEED, slip_angle, 0.0, 0.0, start
    )
    return Run(plan, strain, RATE, 0.0, trigger, rig, times)


def make_runs() -> list[Run]:
    """Two loads, five slip angles, two repeats."""
    angles = np.deg2rad([-4.0, -2.0, 0.0, 2.0, 4.0])
    points = [(load, float(a)) for load in (3000.0, 5000.0) for a in angles]
    points += [points[2], points[9]]
    return [make_run(n, load, angle, start=12.0 * n) for n, (load, angle) in enumerate(points)]


def changed(runs: Sequence[Run], number: int | None, change: Callable[[Run], Run]) -> list[Run]:
    """Return the runs with one of them, or with None all of them, changed."""
    return [change(run) if number in (None, run.plan.run) else run for run in runs]


def with_strain(change: Callable[[FloatArray], None]) -> Callable[[Run], Run]:
    """Return a change of a run that edits a copy of its strain in place."""

    def apply(run: Run) -> Run:
        assert run.strain is not None
        strain = run.strain.copy()
        change(strain)
        return replace(run, strain=strain)

    return apply


def with_rig(**changes: Callable[[FloatArray], FloatArray]) -> Callable[[Run], Run]:
    """Return a change of a run that replaces rig quantities."""

    def apply(run: Run) -> Run:
        new = {name: change(run.rig[name]) for name, change in changes.items()}
        return replace(run, rig={**run.rig, **new})

    return apply


def rewrite(file: Path, change: Callable[[Group], Group]) -> None:
    """Change the groups of a written run file, below the level of Run."""
    write_mdf(file, [change(group) for group in read_mdf(file)])
