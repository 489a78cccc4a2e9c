"""One virtual tire in FMPy, and a calibration made on its strain, for the tests."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from tests.fmu import live
from tests.once import once
from tirelib.campaign import CampaignHeader, Run, RunPlan, TireGeometry, write_campaign
from tirelib.campaign.read import read_campaign
from tirelib.estimators.calibration_file import write_calibration
from tirelib.estimators.train import train
from tirelib.fmu.run import keeping, runs_with
from tirelib.fmu.virtual.spec import build_virtual, default_surface, friction_surface
from tirelib.fmu.virtual.surface import Surface, mirrored, read_surface
from tirelib.measured.observations import observe
from tirelib.rig.observe import Forces, forces, trace
from tirelib.rig.solve import RigState, solve
from tirelib.rig.tire import Condition, tire

RATE = 1e4
TYPICAL = {
    "Fz": 4000.0,
    "alpha": 0.03,
    "kappa": -0.01,
    "camber": 0.01,
    "speed": 20.0,
    "pressure": 2.3e5,
}
QUIET = {"noise_std": 0.0}


@cache
def surface() -> Surface:
    return read_surface(default_surface())


@cache
def friction() -> Surface:
    return read_surface(friction_surface())


@cache
def friction_file() -> Path:
    name, surface = "VirtualTire_friction.fmu", friction_surface()

    def build(place: Path) -> None:
        build_virtual(place / name, samples_per_step=10, surface=surface)

    return once(f"fmu_{name}", build) / name


@cache
def file(samples: int, *, python: bool = False) -> Path:
    name = f"VirtualTire_{samples}{'_python' if python else ''}.fmu"

    def build(place: Path) -> None:
        build_virtual(place / name, samples_per_step=samples, python=python)

    return once(f"fmu_{name}", build) / name


def hold_against_rig(
    known: Surface, condition: Sequence[float], part: str
) -> tuple[RigState, Forces]:
    """Solve the rig at a condition of a surface, and demand the errors stated for a part of it.

    Returns
    -------
    State, Forces
        The rig's, and what the surface says beyond its forces.
    """
    load, alpha, kappa, camber, speed, pressure, *friction = condition
    rolling = replace(tire("reference"), friction=friction[0]) if friction else tire("reference")
    slip = (1.0 + kappa) / np.cos(alpha) - 1.0
    state = solve(rolling, Condition(load, pressure, speed, alpha, camber, slip))
    seen, force = trace(state, 1440), forces(state)
    answers = known.answers(np.array([condition]))
    error = 1e6 * (known.strain(answers, seen.phi) - seen.strain)
    told = known.about["left_out"][part]
    assert np.sqrt(np.mean(error**2)) < told["strain_ustrain_rms"]
    assert np.abs(error).max() < told["strain_ustrain_median_of_largest"]
    given = known.forces_of(answers)[0]
    return state, replace(force, fx=given[0] - force.fx, fy=given[1] - force.fy)


def hold_mirrored(known: Surface, inputs: np.ndarray, angle: np.ndarray) -> None:
    """Demand that mirror images of conditions have the mirror images of strain and forces."""
    here, there = known.answers(inputs), known.answers(mirrored(inputs))
    np.testing.assert_allclose(
        known.strain(there, angle), known.strain(here, angle)[:, ::-1], atol=1e-9
    )
    signs = np.array([1.0, -1.0, -1.0, 1.0])
    np.testing.assert_allclose(
        known.forces_of(there), known.forces_of(here) * signs, rtol=1e-6, atol=1e-3
    )


class Host:
    """One instance in FMPy."""

    def __init__(self, path: Path, messages: list[str] | None = None) -> None:
        description = read_model_description(str(path))
        self.kinds = {v.name: v.type for v in description.modelVariables}
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.strains = [
            v.valueReference for v in description.modelVariables if v.name[:7] == "strain_"
        ]
        self.samples = len(self.strains) // 5
        self.folder = extract(str(path), include=runs_with)
        self.python = (Path(self.folder) / "resources" / "slavemodule.txt").is_file()
        self.slave: Any = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="wheel",
        )
        self.messages: list[str] = [] if messages is None else messages
        self.slave.instantiate(loggingOn=True, callbacks=keeping(self.messages))
        self.time = 0.0

    def close(self) -> None:
        self.slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def put(self, **values: float) -> None:
        for name, value in values.items():
            setter = self.slave.setReal if self.kinds[name] == "Real" else self.slave.setInteger
            setter([self.references[name]], [value])

    def start(self, inputs: dict[str, float] = TYPICAL, **parameters: float) -> None:
        self.slave.reset()
        self.slave.setupExperiment(startTime=0.0)
        self.put(**{**QUIET, **parameters, **inputs})
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = 0.0

    def step(self, step: float | None = None) -> None:
        step = self.samples / RATE if step is None else step
        self.slave.doStep(self.time, step)
        self.time += step

    def frame(self) -> np.ndarray:
        return np.array(self.slave.getReal(self.strains)).reshape(self.samples, 5)

    def get(self, name: str) -> Any:
        reader = getattr(self.slave, f"get{self.kinds[name]}")
        value = reader([self.references[name]])[0]
        if self.kinds[name] == "String":
            return value.decode() if isinstance(value, bytes) else value
        return bool(value) if self.kinds[name] == "Boolean" else value

    def play(self, n: int) -> np.ndarray:
        """Samples of so many steps, shape (n * samples, 5)."""
        found = []
        for _ in range(n):
            self.step()
            found.append(self.frame())
        return np.concatenate(found)


def calibration_file() -> Path:
    """Return a calibration made on runs of the surface, at other conditions."""
    place = live.folder() / "virtual_campaign"
    geometry = TireGeometry("virtual", 0.316, 0.303, 0.0115, 0.168, -0.003)
    header = CampaignHeader(
        name="virtual",
        axes="iso",
        tire=geometry,
        gage_lateral=tuple(surface().lateral.tolist()),
        rate=RATE,
    )
    points = [
        (load, alpha)
        for load in (3200.0, 4000.0, 4800.0, 5600.0)
        for alpha in (-0.06, -0.03, 0.0, 0.03, 0.06)
    ]
    write_campaign(place, header, [_run(n, *point) for n, point in enumerate(points, start=1)])
    path = live.folder() / "virtual.toml"
    write_calibration(train(observe([read_campaign(place)])).calibration, path, {})
    return path


def _run(number: int, load: float, alpha: float) -> Run:
    slip = float(np.cos(alpha)) - 1.0  # rolls freely
    given = np.array([[load, alpha, slip, 0.0, 20.0, 2.3e5]])
    answers = surface().answers(given)
    omega = 20.0 * (1.0 + slip) / surface().rolling_radius(load, 20.0, 2.3e5)
    angle = -np.pi - 0.3 + omega * np.arange(int(3.4 * 2.0 * np.pi / omega * RATE)) / RATE
    noise = np.random.default_rng(number).normal(0.0, 4e-6, (angle.size, 5))
    turn = np.floor((angle + np.pi) / (2.0 * np.pi))
    fx, fy = surface().forces_of(answers)[0, :2]
    times = np.arange(0.0, angle.size / RATE, 0.01)
    held = {
        "Fz": load,
        "Fy": fy,
        "Fx": fx,
        "slip_angle": alpha,
        "camber": 0.0,
        "slip_ratio": slip,
        "speed": 20.0,
        "pressure": 2.3e5,
    }
    plan = RunPlan(
        number,
        f"runs/{number:03d}.mf4",
        "corner" if alpha else "free",
        load,
        2.3e5,
        20.0,
        alpha,
        0.0,
        0.0,
    )
    strain = (surface().strain(answers, angle) + noise).T
    return Run(
        plan,
        strain,
        RATE,
        0.0,
        np.concatenate(([False], np.diff(turn) > 0.0)),
        {name: np.full(times.size, value) for name, value in held.items()},
        times,
    )
