"""The FMUs of the co-simulations, each written once: frames of 20 samples, steps of 2 ms."""

from functools import cache
from pathlib import Path

from cosim.calibrate import CALIBRATION
from cosim.vehicle14.build_fmu import build_vehicle

from tests.fmu import live
from tirelib.fmu.build import build_fmu
from tirelib.fmu.virtual.spec import build_virtual, friction_surface

SAMPLES, STEP = 20, 2e-3


@cache
def vehicle() -> Path:
    return build_vehicle(live.folder() / "VehicleModel.fmu")


@cache
def virtual() -> Path:
    path = live.folder() / f"Slippery_{SAMPLES}.fmu"
    return build_virtual(path, samples_per_step=SAMPLES, surface=friction_surface())


@cache
def strain() -> Path:
    return build_fmu(CALIBRATION, live.folder() / "Cosim.fmu", samples_per_step=SAMPLES)
