"""Campaigns of forces as folders and files, for the tests of the workflow on forces."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.magic_sweep import CAMBERS, PRESSURES, Sweep, magic_sweep
from tests.synthetic import header
from tirelib.campaign import Campaign, Run, RunPlan, read_campaign, write_campaign
from tirelib.core.parameters import Number, TireFile
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_law import stored_number
from tirelib.inference.identify.force_data import ForceData, force_data
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

PLAN = Sweep(loads=(700.0, 1700.0, 2900.0), pressures=PRESSURES[::2], cambers=CAMBERS[::2])
BRUSH = {"lateral_stiffness": 9e6, "friction": 0.95}


def sweep_run(data: ForceData) -> Run:
    """Return samples as the recording of one sweep."""
    names = {
        "Fz": "load",
        "pressure": "pressure",
        "slip_angle": "slip_angle",
        "camber": "camber",
        "speed": "speed",
        "tread_temperature": "temperature",
        "Fy": "Fy",
    }
    plan = RunPlan(0, "runs/000.mf4", "sweep", *(float("nan"),) * 6)
    rig = {quantity: getattr(data, name) for quantity, name in names.items()}
    return Run(plan, rig=rig, rig_time=data.time)


def steady_runs(
    loads: tuple[float, ...] = (2000.0, 4000.0, 6000.0),
    angles: tuple[float, ...] = (-7.0, -5.0, -3.0, -1.5, -0.5, 0.5, 1.5, 3.0, 5.0, 7.0),
    repeats: int = 2,
    slope: float = 0.0,
    factor: float = 1.0,
    moment: bool = False,
) -> Iterable[Run]:
    """Yield cornering runs of a brush whose friction falls with load by a power `slope`."""
    rng = np.random.default_rng(7)
    number = 0
    for load in loads:
        for angle in np.deg2rad(angles):
            for _ in range(repeats):
                mu = BRUSH["friction"] * (load / 4000.0) ** -slope
                brush = PointParameters(
                    BRUSH["lateral_stiffness"], mu, 0.06 * (load / 4000.0) ** 0.45
                )
                found = predict_forces(brush, PointConditions(load, angle))
                side = factor * found.Fy.item() + 6.0 * rng.standard_normal()
                rig = {
                    "Fz": load,
                    "pressure": 2.1e5,
                    "slip_angle": angle,
                    "camber": 0.0,
                    "speed": 18.0,
                    "Fy": side,
                }
                if moment:
                    rig["Mz"] = found.Mz.item() + 0.5 * rng.standard_normal()
                yield Run(
                    RunPlan(
                        number,
                        f"runs/{number:03d}.mf4",
                        "corner",
                        load,
                        2.1e5,
                        18.0,
                        angle,
                        0.0,
                        0.0,
                        start=12.0 * number,
                    ),
                    rig={name: np.full(8, value) for name, value in rig.items()},
                    rig_time=np.arange(8) / 100.0,
                )
                number += 1


def write_forces(folder: Path, runs: Iterable[Run], name: str) -> Campaign:
    """Write a campaign of forces alone and read it back."""
    bare = replace(header(name), gage_lateral=(), rate=float("nan"))
    write_campaign(folder, bare, runs)
    return read_campaign(folder)


def write_sweep(folder: Path, seed: int, planted: dict[str, float]) -> Campaign:
    """Write the sweep of a Magic Formula tire."""
    return write_forces(folder, [sweep_run(magic_sweep(seed, planted, PLAN))], "sweep")


def brush_file(campaign: Campaign) -> TireFile:
    """Return a model file with the brush that fits a campaign's forces."""
    fit = fit_brush(force_data(campaign))
    values = {k: v for k, v in fit.values.items() if k != "lateral_compliance"}
    source = "fit of the test"
    numbers = dict(stored_number(k, v, float("nan"), "fitted", source) for k, v in values.items())
    for name, value in (
        ("reference_load", fit.reference.load),
        ("reference_pressure", fit.reference.pressure),
    ):
        numbers[name] = Number(value, float("nan"), "fitted", source)
    return TireFile("fitted brush", numbers, {})
