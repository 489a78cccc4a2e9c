"""Drive a manoeuvre with four virtual tires and four strain tires, and keep what happened."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cosim.manoeuvres import Manoeuvre
from cosim.vehicle import Motion, Vehicle
from cosim.wheels import NAMES, WHEELS, FourWheels, WheelStates
from tirelib.core.arrays import FloatArray
from tirelib.fmu.build import build_fmu
from tirelib.fmu.virtual.coordinates import FRICTION, INPUTS
from tirelib.fmu.virtual.spec import build_virtual, friction_surface

TIME_STEP = 1e-3
"""Communication step [s]."""
RATE = 1e4
"""Sample rate of the gages [Hz]."""
VEHICLE = 3
"""Parameter set whose wheel loads lie best in the virtual tire's range."""
STATES = (*INPUTS, FRICTION)
"""What a virtual tire is given."""
MOTION = ("speed", "steer", "heading", "yaw_rate", "roll", "side_slip")


@dataclass(frozen=True, slots=True)
class Recording:
    """A drive, row by row: row k is of the step that ends at ``time[k]``.

    Attributes
    ----------
    name : str
    time : array, shape (n,), [s]
    truth : dict of arrays, shape (n, 4)
        True wheel states by the names of `STATES`, held over the step; SI, ISO 8855.
    told : dict of arrays, shape (n, 4)
        Everything of `cosim.wheels.Estimates`, at the end of the step.
    motion : dict of arrays, shape (n,)
        `MOTION`, at the start of the step.
    vehicle_fy : array, shape (n, 4), [N]
        Lateral forces of the vehicle's own tires.
    static : array, shape (4,), [N]
        Static loads.
    """

    name: str
    time: FloatArray
    truth: dict[str, FloatArray]
    told: dict[str, FloatArray]
    motion: dict[str, FloatArray]
    vehicle_fy: FloatArray
    static: FloatArray


def build_fmus(
    folder: Path, calibration: Path, step: float = TIME_STEP, *, python: bool = False
) -> tuple[Path, Path]:
    """Write both FMUs for steps [s], compiled or Python's; return virtual and strain tire."""
    samples = round(step * RATE)
    folder.mkdir(parents=True, exist_ok=True)
    return (
        build_virtual(
            folder / "VirtualTire.fmu",
            samples_per_step=samples,
            sample_rate=RATE,
            surface=friction_surface(),
            python=python,
        ),
        build_fmu(
            calibration,
            folder / "StrainTire.fmu",
            samples_per_step=samples,
            sample_rate=RATE,
            python=python,
        ),
    )


def drive(manoeuvre: Manoeuvre, number: int = VEHICLE) -> Iterator[Motion]:
    """Yield the vehicle's motion at the start of every step."""
    vehicle = Vehicle(number, manoeuvre.speed)
    driver = manoeuvre.driver(vehicle)
    motion = vehicle.look()
    for _ in range(round(manoeuvre.duration / TIME_STEP)):
        motion = vehicle.step(TIME_STEP, driver(vehicle.time, motion))
        yield motion


def record(manoeuvre: Manoeuvre, wheels: FourWheels, number: int = VEHICLE) -> Recording:
    """Drive a manoeuvre open loop: nothing goes back from the estimates to the vehicle."""
    motions = list(drive(manoeuvre, number))
    told = follow([motion.wheels for motion in motions], wheels)
    truth = np.array([motion.wheels.rows() for motion in motions])
    return Recording(
        name=manoeuvre.name,
        time=TIME_STEP * np.arange(1.0, len(motions) + 1.0, dtype=np.float64),
        truth={name: truth[:, :, at] for at, name in enumerate(STATES)},
        told=told,
        motion={name: np.array([getattr(m, name) for m in motions]) for name in MOTION},
        vehicle_fy=np.array([motion.fy for motion in motions]),
        static=Vehicle(number, manoeuvre.speed).static_load(),
    )


def follow(states: list[WheelStates], wheels: FourWheels) -> dict[str, FloatArray]:
    """Give wheel states to the wheels, one a step; return what they say, shape (n, 4) each."""
    told = {name: np.empty((len(states), len(WHEELS))) for name in NAMES}
    wheels.start(states[0])
    for row, state in enumerate(states):
        now = wheels.step(row * TIME_STEP, TIME_STEP, state)
        for name, values in told.items():
            values[row] = getattr(now, name)
    return told
