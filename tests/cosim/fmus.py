"""The FMUs of the co-simulations, each written once: frames of 20 samples, steps of 2 ms."""

from functools import cache
from pathlib import Path

from cosim.calibrate import CALIBRATION
from cosim.vehicle14.build_fmu import build_vehicle

from tests.fmu import live, virtual_host
from tirelib.fmu.build import build_fmu

SAMPLES, STEP = 20, 2e-3


@cache
def vehicle() -> Path:
    return build_vehicle(live.folder() / "VehicleModel.fmu")


@cache
def virtual() -> Path:
    return virtual_host.file(SAMPLES)


@cache
def strain() -> Path:
    return build_fmu(CALIBRATION, live.folder() / "Cosim.fmu", samples_per_step=SAMPLES)
