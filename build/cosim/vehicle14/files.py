"""Where the vehicle's tires come from; not part of the FMU."""

import tomllib
from functools import cache
from pathlib import Path

from cosim.vehicle14.model import Vehicle
from cosim.vehicle14.parameters import VehicleParameters
from cosim.vehicle14.tire import BrushTires, tires_of
from tirelib.core.errors import ParameterError
from tirelib.core.parameters.tire_file import models_folder
from tirelib.physics.brush import predict

TIRE_FILE = models_folder() / "vehicle14" / "tire.toml"


@cache
def usual_tires() -> BrushTires:
    """Return the tires that are fitted to the virtual tire."""
    return tires_of(tomllib.loads(Path(TIRE_FILE).read_text(encoding="utf-8")), predict)


def make_vehicle(parameters: VehicleParameters | None = None) -> Vehicle:
    """Return a vehicle on its usual tires.

    Raises
    ------
    ParameterError
        Naming every parameter that is out of range.
    """
    given = parameters or VehicleParameters()
    if problems := given.problems():
        raise ParameterError(f"vehicle: {'; '.join(problems)}; give numbers of a vehicle")
    return Vehicle(given, usual_tires())
