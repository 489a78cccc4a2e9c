"""A wedge of water under the tires: who notices, and how fast the car still is when it matters.

    python -m cosim.hydroplaning --virtual T.fmu --strain S.fmu --out build/out/hydroplaning

The 14-DOF vehicle rolls straight at 100 km/h into standing water. A wedge ahead of each contact
presses with s rho v^2 / 2 and carries a part of the load; only the rest of it, which the tread
carries, has grip. Whoever knows the water's share of the load brakes gently until it is small. At
`PLACE` something happens, and the driver has the grip that is left.

- **perfect** knows the share;
- **strain** goes by how sure the strain tires are of the load: water ahead of the contact presses
  on the belt, so the strain leaves what a dry road can show, and the load's deviation grows
  with the water;
- **today**: wheel speeds, gyroscope and accelerometer of a car that rolls straight do not change
  with this wedge (its drag is not in the vehicle), so nobody reacts.
"""

import dataclasses
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim.antilock import AT_ONCE
from cosim.closed_loop import STARTS
from cosim.closed_loop_command import run_study
from cosim.closed_loop_sources import TIME_STEP
from cosim.vehicle14.files import make_vehicle
from cosim.vehicle14.model import SPIN, Controls
from cosim.vehicle14.parameters import GRAVITY, VehicleParameters
from cosim.vehicle14.run import Drive
from cosim.water import SPREAD, water_table, wedge_pressure
from cosim.wheels import OWN_FRICTION, Estimates, FourWheels, WheelStates
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread

SPEED = 100.0 / 3.6
"""At the start [m/s]."""
WET, STRENGTH = 0.6, 0.5
"""Factor of the friction on the wet road; s of the wedge (Horne and Dreher, NASA TN D-2056: the
lift of a tire that floats is 0.7 rho v^2 / 2 over its contact)."""
BEGINS, PLACE = 16.0, 90.0
"""Way at which the front wheels enter the water, and at which something happens [m]."""
ALLOWED, GENTLE = 0.08, 3.0
"""Share of the load that the water may carry; deceleration while it carries more [m/s^2]."""
SHOWS = 2.5
"""Standard deviation of a strain tire's load, as a share of the load, over the share that water
carries: 1.9 to 2.5 at 2.7 to 4.7 kN and up to 10 % of the load (``python -m cosim.water``), less
beyond; the upper end, so that a dry road is not taken for a wet one."""
NOTICED = 4.5
"""Way in the water within which it is to be noticed [m]: two turns and the output's delay."""
KINDS = ("perfect", "strain", "today")
BASE = VehicleParameters.front + VehicleParameters.rear


@dataclass(frozen=True)
class Approach:
    """One drive up to `PLACE`; arrays over the steps.

    Attributes
    ----------
    time, way, speed, share, known : array, shape (n,)
        `share` is the larger of both axles' shares of the load that water carries, `known` what is
        known of it.
    """

    time: FloatArray
    way: FloatArray
    speed: FloatArray
    share: FloatArray
    known: FloatArray
    weight: float

    def figures(self) -> dict[str, float]:
        """Return what a reader compares."""
        wet = self.way > BEGINS
        noticed = np.flatnonzero(wet & (self.known > ALLOWED))
        late = self.way[noticed[0]] - BEGINS if noticed.size else math.nan
        return {
            "noticed_after_m": float(late),
            "speed_kmh": 3.6 * float(self.speed[-1]),
            "share_of_water": float(self.share[-1]),
            "stopping_way_m": stopping_way(float(self.speed[-1]), self.weight),
        }


def stopping_way(speed: float, weight: float, end: float = 25.0 / 3.6) -> float:
    """Return the way to `end` [m/s] with all the grip that the tread has, the water staying."""
    v: FloatArray = np.linspace(end, speed, 400)
    lift = 4.0 * SPREAD * wedge_pressure(STRENGTH, v)
    slows = OWN_FRICTION * WET * GRAVITY * np.maximum(1.0 - lift / weight, 0.05)
    return float(np.trapezoid(v / slows, v))


def suspected(told: Estimates) -> float:
    """Return the share of its load that water may carry, the larger of both axles'; NaN: unknown.

    Both wheels of an axle are in the water, so the mean of their doubts counts.
    """
    doubt = told.Fz_std / np.abs(told.Fz)
    return float(doubt.reshape(2, 2).mean(axis=1).max()) / SHOWS


def approach(kind: str, four: FourWheels | None = None) -> Approach:
    """Drive up to `PLACE`; `four` are the wheels of "strain"."""
    vehicle = make_vehicle()
    p = vehicle.parameters
    drive = Drive(vehicle, vehicle.at_rest(SPEED), TIME_STEP)
    motion = drive.look(Controls.none())
    weight = p.mass * GRAVITY
    if four is not None:
        four.start(_states(motion.wheels, drive.state[SPIN], np.zeros(4), np.ones(4)))
    rows, brakes, asked = [], False, 0.0
    time, way, speed = 0.0, 0.0, SPEED
    while way < PLACE:
        wheels = motion.wheels
        places = way + np.array([0.0, 0.0, -BASE, -BASE])
        wedge = wedge_pressure(STRENGTH, wheels.speed) * (places > BEGINS)
        lift = SPREAD * wedge
        factor = WET * (1.0 - lift / wheels.Fz)
        share = float((lift.reshape(2, 2).sum(axis=1) / wheels.Fz.reshape(2, 2).sum(axis=1)).max())
        known = {"perfect": share, "today": 0.0}.get(kind, 0.0)
        if four is not None:
            known = suspected(
                four.step(time, TIME_STEP, _states(wheels, drive.state[SPIN], wedge, factor))
            )
        brakes = known > (0.9 * ALLOWED if brakes else ALLOWED)
        rows.append((time, way, speed, share, known))
        asked += (GENTLE * brakes - asked) * min(TIME_STEP / 0.1, 1.0)
        force = p.mass * asked * 0.31
        hold = p.drag * speed**2 * 0.31 * (not brakes)
        motion = drive.step(
            TIME_STEP,
            dataclasses.replace(
                Controls.none(),
                friction=factor,
                drive=np.array([0.5, 0.5, 0.0, 0.0]) * hold,
                brake=force * np.array([0.35, 0.35, 0.15, 0.15]),
            ),
        )
        before, speed = speed, float(np.hypot(*drive.state[10:12]))
        way += 0.5 * (before + speed) * TIME_STEP
        time += TIME_STEP
    return Approach(*np.array(rows).T, weight)


def _states(wheels: Any, omega: FloatArray, wedge: FloatArray, factor: FloatArray) -> WheelStates:
    return WheelStates(
        load=wheels.Fz,
        alpha=wheels.alpha,
        kappa=wheels.kappa,
        camber=wheels.camber,
        speed=wheels.speed,
        omega=omega,
        friction=OWN_FRICTION * factor,
        wedge=wedge,
    )


Drives = dict[str, Approach]


def study(virtual: Path, strain: Path, progress: Callable[[str], None] | None = None) -> Drives:
    """Drive with every kind of knowledge."""
    say = progress or (lambda _: None)
    found = {kind: approach(kind) for kind in ("perfect", "today")}
    table = water_table()
    say("water on the rig")
    with FourWheels(
        virtual, strain, start_angles=STARTS[0], parameters=AT_ONCE, water=table
    ) as four:
        found["strain"] = approach("strain", four)
    say("water: strain")
    return {kind: found[kind] for kind in KINDS}


def missed(drives: Drives) -> list[str]:
    """Return in words which figures are not reached: water is noticed within two turns."""
    late = drives["strain"].figures()["noticed_after_m"]
    if late <= NOTICED:
        return []
    return [f"hydroplaning: noticed after {late:.1f} m > {NOTICED:g} m"]


def document(drives: Drives) -> dict[str, Any]:
    """Return the figures as JSON knows them."""
    rows = [
        {"knowledge": kind}
        | {name: value if math.isfinite(value) else None for name, value in run.figures().items()}
        for kind, run in drives.items()
    ]
    return {
        "from_kmh": 3.6 * SPEED,
        "strength": STRENGTH,
        "water_from_m": BEGINS,
        "place_m": PLACE,
        "vehicle": "14 degrees of freedom",
        "rows": rows,
    }


def main(arguments: list[str] | None = None) -> int:
    """Run the study by the command line; write JSON and a page."""
    from cosim.hydroplaning_report import part, sentence

    return run_study(
        __doc__,
        "hydroplaning",
        lambda virtual, strain, say: study(virtual, strain, progress=say),
        document,
        lambda found: {
            "parts": [part(found)],
            "title": "Hydroplaning with strain tires",
            "answer": sentence(found),
        },
        arguments,
    )


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
