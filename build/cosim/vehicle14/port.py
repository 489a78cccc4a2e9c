"""The vehicle as an FMU sees it: a table of variables, and a model that steps by them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .model import Controls, Vehicle
from .parameters import WHEELS, VehicleParameters
from .run import LONGEST, Drive
from .tire import BrushTires

PER_WHEEL = ("drive", "brake", "friction", "road")
SHOWN = ("Fz", "Fx", "Fy", "Mz", "alpha", "kappa", "camber", "speed", "omega", "travel")
BODY = (
    "x",
    "y",
    "z",
    "roll",
    "pitch",
    "yaw",
    "vx",
    "vy",
    "vz",
    "roll_rate",
    "pitch_rate",
    "yaw_rate",
    "ax",
    "ay",
    "az",
)
INPUTS = ("steer_front", "steer_rear", *(f"{name}_{w}" for name in PER_WHEEL for w in WHEELS))
PARAMETERS = ("start_speed", "start_yaw", "longest_step", "sprung_mass", "height")
LONGEST_STEP = 1.0
"""Longest communication step [s]."""
RIGHT = 0.5 * math.pi
_START = {"start_speed": 100.0 / 3.6, "start_yaw": 0.0, "longest_step": LONGEST}
_LIMITS = {
    "start_speed": (1.0, 100.0),
    "start_yaw": (-math.pi, math.pi),
    "longest_step": (1e-5, 5e-3),
    "sprung_mass": (300.0, 5000.0),
    "height": (0.2, 1.5),
}


def parameters(variable: Callable[..., Any]) -> list[Any]:
    """Return the parameters; `variable` is `tirelib.fmu.variables.Variable` or a copy of it."""
    usual = VehicleParameters()
    start = {**_START, "sprung_mass": usual.sprung_mass, "height": usual.height}
    rows = {
        "start_speed": ("speed at the start", "m/s", "km/h", 10.0, "Speed"),
        "start_yaw": ("heading at the start", "rad", "deg", 1.0, "Angle"),
        "longest_step": ("longest step of the integration", "s", "ms", 1e-3, "Time"),
        "sprung_mass": ("sprung mass", "kg", None, 1e3, "Mass"),
        "height": (
            "centre of gravity of the sprung mass above the road, at rest",
            "m",
            "mm",
            1.0,
            "Length",
        ),
    }
    return [
        variable(
            name,
            "Real",
            "parameter",
            text,
            start[name],
            unit,
            display,
            nominal,
            *_LIMITS[name],
            type=kind,
        )
        for name, (text, unit, display, nominal, kind) in rows.items()
    ]


def inputs(variable: Callable[..., Any]) -> list[Any]:
    """Return the inputs, in the order of `INPUTS`."""
    rows = {
        "drive": ("torque on the wheel", 0.0, "N m", "kN m", 1e3, -1e5, 1e5, "Moment"),
        "brake": (
            "torque of the brake, against the turn",
            0.0,
            "N m",
            "kN m",
            1e3,
            0.0,
            1e5,
            "Moment",
        ),
        "friction": ("scale of the road's friction", 1.0, "1", None, 1.0, 1e-3, 10.0, "Ratio"),
        "road": ("height of the road", 0.0, "m", "mm", 0.1, -1.0, 1.0, "Length"),
    }
    table = [
        variable(
            f"steer_{axle}",
            "Real",
            "input",
            f"steering angle of the {axle} wheels, left positive",
            0.0,
            "rad",
            "deg",
            0.1,
            -RIGHT,
            RIGHT,
            type="Angle",
        )
        for axle in ("front", "rear")
    ]
    return table + [
        variable(
            f"{name}_{wheel}",
            "Real",
            "input",
            f"{text}, {wheel}",
            start,
            unit,
            display,
            nominal,
            low,
            high,
            type=kind,
        )
        for name, (text, start, unit, display, nominal, low, high, kind) in rows.items()
        for wheel in WHEELS
    ]


_WHEEL_ROWS = {
    "Fz": ("vertical load", "N", "kN", 1e3, "Force"),
    "Fx": ("force of the road along the wheel's x", "N", "kN", 1e3, "Force"),
    "Fy": ("force of the road along the wheel's y", "N", "kN", 1e3, "Force"),
    "Mz": ("aligning moment", "N m", "kN m", 1e2, "Moment"),
    "alpha": ("slip angle, ISO 8855", "rad", "deg", 0.1, "Angle"),
    "kappa": ("slip ratio, (omega R_e - speed) / speed; NaN: too slow", "1", "%", 0.1, "Ratio"),
    "camber": ("camber angle, top to the right positive", "rad", "deg", 0.1, "Angle"),
    "speed": ("travel speed of the contact", "m/s", "km/h", 10.0, "Speed"),
    "omega": ("turn rate", "rad/s", "rpm", 10.0, "TurnRate"),
    "travel": ("travel of the strut, inward positive", "m", "mm", 0.1, "Length"),
}
_BODY_ROWS = {
    **dict.fromkeys("xyz", ("centre of gravity of the sprung mass", "m", None, 1.0, "Length")),
    **dict.fromkeys(("roll", "pitch", "yaw"), ("angle of the body", "rad", "deg", 0.1, "Angle")),
    **dict.fromkeys(
        ("vx", "vy", "vz"), ("velocity along the body's axis", "m/s", "km/h", 1.0, "Speed")
    ),
    **dict.fromkeys(
        ("roll_rate", "pitch_rate", "yaw_rate"),
        ("turn rate about the body's axis", "rad/s", None, 1.0, "TurnRate"),
    ),
    **dict.fromkeys(
        ("ax", "ay", "az"),
        (
            "acceleration of the centre of gravity along the body's axis",
            "m/s2",
            None,
            1.0,
            "Acceleration",
        ),
    ),
}


def outputs(variable: Callable[..., Any]) -> list[Any]:
    """Return the outputs, in the order of `Port.outputs`."""
    nan = math.nan
    table = [
        variable(
            f"{name}_{wheel}",
            "Real",
            "output",
            f"{text}, {wheel}",
            nan,
            unit,
            display,
            nominal,
            type=kind,
        )
        for name, (text, unit, display, nominal, kind) in _WHEEL_ROWS.items()
        for wheel in WHEELS
    ]
    table += [
        variable(name, "Real", "output", f"{name}: {text}", nan, unit, display, nominal, type=kind)
        for name, (text, unit, display, nominal, kind) in _BODY_ROWS.items()
    ]
    return [
        *table,
        variable("valid", "Boolean", "output", "the last step was done", False),
        variable("status", "String", "output", "ok, or why not", "not_started"),
    ]


def settings_problems(values: Sequence[float]) -> list[str]:
    """Return what is wrong with parameters in the order of `PARAMETERS`."""
    found = []
    for name, value in zip(PARAMETERS, values, strict=True):
        low, high = _LIMITS[name]
        if not low <= value <= high:
            found.append(f"{name} = {value:g}; allowed are {low:g} .. {high:g}")
    return found


def controls(values: Sequence[float]) -> Controls:
    """Return the controls of inputs in the order of `INPUTS`."""
    row = np.asarray(values, dtype=np.float64)
    steer = np.array((row[0], row[0], row[1], row[1]))
    return Controls(steer, *row[2:].reshape(len(PER_WHEEL), 4))


class Port:
    """A vehicle that is stepped by lists of numbers.

    Parameters
    ----------
    tires : BrushTires
    values : sequence of float
        In the order of `PARAMETERS`, checked by `settings_problems`.
    given : sequence of float
        In the order of `INPUTS`: what acts at the start.
    """

    def __init__(self, tires: BrushTires, values: Sequence[float], given: Sequence[float]) -> None:
        speed, yaw, longest, mass, height = values
        usual = replace(VehicleParameters(), sprung_mass=mass, height=height)
        vehicle = Vehicle(usual, tires)
        self.drive = Drive(vehicle, vehicle.at_rest(speed, yaw), longest)
        self._valid, self._status = True, "ok"
        self._given = list(given)
        if not self.refusal(LONGEST, given):
            self.drive.look(controls(given))

    @staticmethod
    def refusal(step: float, given: Sequence[float]) -> str | None:
        """Return why a step cannot be done, if so."""
        if not 0.0 < step <= LONGEST_STEP:
            return (
                f"communication step = {step} s; allowed are above 0 to {LONGEST_STEP:g} s; "
                "step by 1 ms"
            )
        row = np.asarray(given, dtype=np.float64)
        bad = ~np.isfinite(row)
        bad[6:10] |= row[6:10] < 0.0  # brakes
        bad[10:14] |= row[10:14] <= 0.0  # friction
        if bad.any():
            told = ", ".join(f"{INPUTS[i]} = {row[i]:g}" for i in np.flatnonzero(bad))
            return f"{told}; allowed are finite numbers, brakes >= 0, friction > 0; mend the input"
        return None

    def step(self, step: float, given: Sequence[float]) -> bool:
        """Go on; the state stays if what comes is no number."""
        before = self.drive.state
        self.drive.step(step, controls(given))
        if not np.all(np.isfinite(self.drive.state)):
            self.drive.state = before
            self.drive.look(controls(given))
            raise FloatingPointError("the vehicle's state is no number any more; it stays")
        self._given = list(given)
        self._valid, self._status = True, "ok"
        return True

    def fault(self, cause: str) -> None:
        """Hold the last values as invalid, after an error."""
        self._valid, self._status = False, f"fault: {cause}"

    def outputs(self) -> tuple[list[float], tuple[Any, ...]]:
        """Return the values of the Real outputs and of the others, in the table's order."""
        state, motion = self.drive.state, self.drive.motion
        w = motion.wheels
        wheels = np.concatenate(
            (w.Fz, w.Fx, w.Fy, w.Mz, w.alpha, w.kappa, w.camber, w.speed, state[20:24], state[6:10])
        )
        body = np.concatenate((state[:6], state[10:16], motion.acceleration))
        return [*wheels.tolist(), *body.tolist()], (self._valid, self._status)

    def state(self) -> dict[str, Any]:
        """Return everything that is remembered, as JSON knows it."""
        return {
            "state": [x.hex() for x in self.drive.state.tolist()],
            "given": [float(x).hex() for x in self._given],
            "valid": self._valid,
            "status": self._status,
        }

    def restore(self, kept: dict[str, Any]) -> None:
        """Take up a state of a vehicle with the same parameters."""
        self.drive.state = np.array([float.fromhex(x) for x in kept["state"]])
        self._given = [float.fromhex(x) for x in kept["given"]]
        self._valid, self._status = kept["valid"], kept["status"]
        if not self.refusal(LONGEST, self._given):
            self.drive.look(controls(self._given))
