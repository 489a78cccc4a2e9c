"""Run a plan on the rig and write a campaign folder together with its true values."""

import csv
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from tirelib.campaign import (
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    Tolerance,
    write_campaign,
)
from tirelib.core.errors import ParameterError
from tirelib.rig.hidden import hidden
from tirelib.rig.measure import MeasuringChain, Recording, Stage, record, settle, slip_ratio
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import Forces, edges, forces, trace
from tirelib.rig.plans import Plan, kind, with_repeats
from tirelib.rig.ramp import Nominal, Point, Ramp, changed, dense, points_of, set_point
from tirelib.rig.shown import Shown, fixed_angle
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import NEW_DEPTH, Array, Condition, RigTire, on_road

TRUTH_FILE = "truth.csv"
TREAD_TEMPERATURE = 313.15
"""The single temperature of the rig's rubber, [K]."""
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment of a process that shares the processors with others like it: one thread each."""


@dataclass(frozen=True)
class Truth:
    """A noise-free state behind a run, SI and ISO; `time` is when the wheel passes through it."""

    run: int
    time: float
    condition: Condition
    force: Forces
    slip_ratio: float
    free_radius: float
    omega: float
    height: float
    edge: Array
    length: Array

    def row(self) -> dict[str, float]:
        """One row of truth.csv; units are in the names."""
        out = {
            "run": float(self.run),
            "time_s": self.time,
            "Fx_N": self.force.fx,
            "Fy_N": self.force.fy,
            "Fz_N": self.force.fz,
            "Mx_Nm": self.force.overturning,
            "Mz_Nm": self.force.aligning,
            "torque_Nm": self.force.torque,
            "slip_angle_rad": self.condition.slip_angle,
            "camber_rad": self.condition.camber,
            "slip_ratio_1": self.slip_ratio,
            "pressure_Pa": self.condition.pressure,
            "speed_m_per_s": self.condition.speed,
            "omega_rad_per_s": self.omega,
            "axle_height_m": self.height,
            "R_e_m": self.free_radius,
        }
        for i, (ends, length) in enumerate(zip(self.edge, self.length, strict=True), start=1):
            out[f"contact_length_{i}_m"] = float(length)
            out[f"edge_lead_{i}_rad"] = float(ends[0])
            out[f"edge_trail_{i}_rad"] = float(ends[1])
        return out


@dataclass(frozen=True)
class Job:
    """A run to be made; `friction` is the tire's own, for roads that do not say another."""

    run: int
    nominal: Nominal
    seed: int
    chain: MeasuringChain
    planted: tuple[tuple[str, float], ...] = ()
    place: float = 0.0
    friction: float = np.nan


class _Worker:
    """States that a process starts from; set once per process."""

    references: tuple[RigState, ...] = ()


def _prepare(references: tuple[RigState, ...]) -> None:
    grid = mesh()
    _Worker.references = tuple(replace(s, grid=grid) for s in references)


def _make(job: Job) -> tuple[Recording, tuple[Truth, ...]]:
    """Measure the states that a run passes through, each from the one before."""
    run = changed(job.nominal, lambda c: settle(c, job.chain, job.seed, job.run))
    points = dense(points_of(run))
    load = points[0].condition.load
    start = min(_Worker.references, key=lambda s: abs(s.condition.load - load))
    stages, truths = [], []
    for point in points:
        stage, truth = _pass(job, point, start)
        stages.append(stage)
        truths.append(truth)
        start = stage.state
    return record(stages, job.chain, job.seed, job.run), tuple(truths)


def _pass(job: Job, point: Point, start: RigState) -> tuple[Stage, Truth]:
    cond = point.condition
    tire = on_road(_Worker.references[0].tire, cond)
    for name, strength in job.planted:
        tire = hidden(name).tire(tire, cond, job.place, strength)
    lower = tire.free_radius - start.tire.free_radius
    state = solve(tire, cond, replace(start, height=start.height + lower))
    force = forces(state)
    angle, length = edges(state)
    seen = trace(state)
    for name, strength in job.planted:
        shown = Shown(
            tire, cond, state.omega, seen, angle, state.stiffness, job.place, fixed_angle(tire)
        )
        seen = hidden(name).trace(shown, strength)
    truth = Truth(
        run=job.run,
        time=point.time,
        condition=cond,
        force=force,
        slip_ratio=slip_ratio(state),
        free_radius=state.free_radius,
        omega=state.omega,
        height=state.height,
        edge=angle,
        length=length,
    )
    return Stage(state, seen, force, point.time), truth


def references(tire: RigTire, conditions: tuple[Condition, ...]) -> tuple[RigState, ...]:
    """Solve a straight, freely rolling state for each load of a plan.

    Every run starts from one of these, so that its result does not depend on the other runs.
    """
    first, out, state = conditions[0], [], None
    for load in sorted({c.load for c in conditions}):
        cond = Condition(load, first.pressure, first.speed)  # the tire's own friction, new
        state = solve(tire, cond, state)
        out.append(state)
    return tuple(out)


def run_plan(
    plan: Plan,
    tire: RigTire,
    out: str | Path,
    *,
    seed: int = 0,
    repeats: int | None = None,
    jobs: int = 2,
    chain: MeasuringChain | None = None,
    axes: str = "iso",
    overwrite: bool = False,
    planted: Mapping[str, float] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Truth]:
    """Measure a plan and write the campaign; return the truth of each run.

    A ramp has several truths, one for each state that it was solved at.

    Parameters
    ----------
    seed : int
        The day: set-point errors, noise, gain repeatability. The tire and its gages stay.
    repeats : int, optional
        Number of runs repeated at the end; the plan's own number otherwise.
    axes : str
        Axis system of the files.
    planted : mapping of name to strength, optional
        Effects to hide in the rig (`tirelib.rig.hidden`).
    progress : callable, optional
        Called with the number of finished runs and of all runs.

    Raises
    ------
    ParameterError
        If the folder is not empty and `overwrite` is off, or an option is out of range.
    """
    folder, chain = Path(out), chain or MeasuringChain()
    if folder.exists() and any(folder.iterdir()) and not overwrite:
        raise ParameterError(
            f"{folder} is not empty; allowed is a new or empty folder; "
            "name another one or ask to overwrite (--force)"
        )
    if jobs < 1 or seed < 0:
        raise ParameterError(
            f"rig: jobs = {jobs}, seed = {seed}; allowed are jobs >= 1 and seed >= 0; change them"
        )
    conditions = with_repeats(plan, plan.repeats if repeats is None else repeats)
    effects = tuple((hidden(name).name, strength) for name, strength in (planted or {}).items())
    tasks = [
        Job(i, c, seed, chain, effects, i / max(len(conditions) - 1, 1), tire.friction)
        for i, c in enumerate(conditions)
    ]
    truths: list[Truth] = []

    def finished() -> Iterator[Run]:
        made = zip(tasks, _all(tire, tasks, jobs), strict=True)
        for count, (job, (recording, truth)) in enumerate(made, start=1):
            truths.extend(truth)
            if progress is not None:
                progress(count, len(tasks))
            yield _run(job, recording)

    note = f"{plan.about}; five turns of a steady run; the truth is in {TRUTH_FILE}"
    header = rig_header(f"rig-{plan.name}", tire, chain, note, axes)
    write_campaign(folder, header, finished(), axes=axes, overwrite=overwrite)
    write_truth(folder / TRUTH_FILE, truths)
    return truths


def _all(
    tire: RigTire, tasks: list[Job], jobs: int
) -> Iterator[tuple[Recording, tuple[Truth, ...]]]:
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        start = references(tire, tuple(points_of(t.nominal)[0].condition for t in tasks))
        if jobs == 1:
            _prepare(start)
            yield from map(_make, tasks)
            return
        with ProcessPoolExecutor(
            jobs, mp_context=get_context("spawn"), initializer=_prepare, initargs=(start,)
        ) as pool:
            yield from pool.map(_make, tasks)
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _run(job: Job, recording: Recording) -> Run:
    run = job.nominal
    road = points_of(run)[0].condition
    plan = RunPlan(
        run=job.run,
        file=f"runs/{job.run:03d}.mf4",
        kind=kind(run),
        load=set_point(run, "load"),
        pressure=set_point(run, "pressure"),
        speed=set_point(run, "speed"),
        slip_angle=set_point(run, "slip_angle"),
        camber=set_point(run, "camber"),
        slip_ratio=set_point(run, "slip_ratio"),
        start=job.run * job.chain.run_spacing,
        extra={"ramp": run.about} if isinstance(run, Ramp) else {},
        friction=job.friction if road.friction is None else road.friction,
        tread_depth=NEW_DEPTH if road.tread_depth is None else road.tread_depth,
        tread_temperature=TREAD_TEMPERATURE,
    )
    return Run(
        plan=plan,
        strain=recording.strain,
        rate=job.chain.gage_rate,
        trigger=recording.trigger,
        rig=recording.rig,
        rig_time=recording.rig_time,
    )


def rig_header(
    name: str, tire: RigTire, chain: MeasuringChain, note: str, axes: str = "iso"
) -> CampaignHeader:
    """Return the header of a campaign on the rig: its tire, its gages, its tolerances."""
    return CampaignHeader(
        name=name,
        axes=axes,
        tire=TireGeometry(
            name=tire.name,
            free_radius=tire.free_radius,
            ring_radius=tire.ring_radius,
            tread_thickness=tire.tread_thickness,
            belt_width=tire.belt_width,
            innerliner_offset=tire.innerliner_offset,
        ),
        gage_lateral=tuple(float(y) for y in tire.lateral),
        rate=chain.gage_rate,
        strain_unit="ustrain",
        tolerance=Tolerance(
            load=chain.load_setting,
            pressure=chain.pressure_setting,
            speed=chain.speed_setting,
            gain=chain.gain_repeatability,
        ),
        rig_name="tirelib numerical flat-belt rig",
        rig_note=note,
    )


def write_truth(path: Path, truths: list[Truth]) -> None:
    """Write truth.csv: a row a solved state, SI and ISO signs whatever the campaign's axes."""
    rows = [t.row() for t in truths]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(rows[0])
        for row in rows:
            cells = [f"{v:.9g}" if np.isfinite(v) else "" for v in row.values()]
            writer.writerow(cells)
