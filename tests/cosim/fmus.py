"""The FMUs of the co-simulations, each written once: frames of 20 samples, steps of 2 ms."""

from functools import cache
from pathlib import Path

from cosim.calibrate import CALIBRATION
from cosim.vehicle14.build_fmu import build_vehicle

from tests.once import once
from tirelib.fmu.build import build_fmu
from tirelib.fmu.virtual.spec import build_virtual, friction_surface

SAMPLES, TIME_STEP = 20, 2e-3


@cache
def vehicle() -> Path:
    name = "VehicleModel.fmu"
    return once("cosim_vehicle", lambda place: build_vehicle(place / name)) / name


@cache
def virtual() -> Path:
    name = f"Slippery_{SAMPLES}.fmu"

    def build(place: Path) -> None:
        build_virtual(place / name, samples_per_step=SAMPLES, surface=friction_surface())

    return once("cosim_virtual", build) / name


@cache
def strain() -> Path:
    name = "Cosim.fmu"

    def build(place: Path) -> None:
        build_fmu(CALIBRATION, place / name, samples_per_step=SAMPLES)

    return once("cosim_strain", build) / name
