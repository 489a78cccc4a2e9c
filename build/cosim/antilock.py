"""Anti-lock braking on roads whose friction nobody knows: what tires that tell are worth.

    python -m cosim.antilock --virtual T.fmu --strain S.fmu --out build/out/antilock

The 14-DOF vehicle brakes with all that the tires hold. Three ways of knowing the wheels, the same
driver, the same actuators, the same rules for the axles:

- **today**: four wheel speeds, a gyroscope, an accelerometer; the control cycle of `cosim.today`;
- **strain**: four strain tires beside these sensors; `cosim.traction`. Load and slip angle are
  those of the strain tires, once per turn; the slip ratio is that of wheel speed and reference
  speed, and the strain tires are told the reference speed and not the true one;
- **perfect**: the same controller with the truth of load, slip angle and slip ratio.

Friction falls with the speed of sliding (`FALLING`), in the vehicle's tires and in the virtual ones
alike, so a wheel beyond the peak locks unless somebody lets go.
"""

import dataclasses
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cosim.antilock_brakes import (
    APART,
    PEDAL,
    Brakes,
    Given,
    Today,
    TractionBrakes,
    actuated,
    axle_rules,
)
from cosim.antilock_roads import FALLING, ROADS, STARTS_OF_SPLIT, Road, falling
from cosim.closed_loop import HOLDING, STARTS, YAW, YAW_RATE
from cosim.closed_loop_command import run_study
from cosim.closed_loop_sources import TIME_STEP, Known, Perfect, Strain
from cosim.today import Sensors, SpeedEstimator
from cosim.vehicle14.files import make_vehicle
from cosim.vehicle14.model import SIDE_SLIP, Controls
from cosim.vehicle14.run import Drive
from cosim.wheels import FourWheels
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError
from tirelib.core.threads import one_thread

SPEED, END_SPEED = 80.0 / 3.6, 25.0 / 3.6
"""The way is counted between these [m/s]."""
LONGEST = 12.0
"""A run that has not ended by then never will [s]."""
PITCH = 0.039
"""Share of the deceleration that this vehicle's pitch adds to its accelerometer: with 0 the
reference speed ends 2.2 km/h too low on a dry road, with this 0.1."""
AT_ONCE = {"relaxation_length": 0.0, "relaxation_length_kappa": 0.0}
"""Parameters of the virtual tires: the vehicle's own tires relax the slip angle already, and the
slip ratio's 0.1 m are 5 ms. Conditions that hold over a step cost a tenth."""
LOCKED = 0.9
"""Slip that counts as a standing wheel."""
KINDS = ("perfect", "strain", "today")


@dataclass(frozen=True)
class StopRun:
    """One stop; arrays over the steps from the brakes on, wheels in the second axis, ISO 8855.

    Attributes
    ----------
    distance : float, [m]
    time, way, speed, told_speed, yaw, aside, steer : array, shape (n,)
        `told_speed` is the reference speed of today's sensors; `yaw` and `aside` are the angle
        and the way [m] to the left of the course on which the brakes were put on, a straight line
        or a circle; `steer` the angle of the front wheels.
    kappa, load, alpha, torque, friction, known_kappa, known_load, known_alpha : array, \
        shape (n, 4)
    refused, out_of_range : int
    """

    distance: float
    time: FloatArray
    way: FloatArray
    speed: FloatArray
    told_speed: FloatArray
    yaw: FloatArray
    aside: FloatArray
    steer: FloatArray
    kappa: FloatArray
    load: FloatArray
    alpha: FloatArray
    torque: FloatArray
    friction: FloatArray
    known_kappa: FloatArray
    known_load: FloatArray
    known_alpha: FloatArray
    refused: int
    out_of_range: int

    def figures(self) -> dict[str, float]:
        """Return what a reader compares."""
        return {
            "distance_m": self.distance,
            "largest_yaw_deg": math.degrees(float(np.abs(self.yaw).max())),
            "largest_aside_m": float(np.abs(self.aside).max()),
            "largest_slip": float(-self.kappa.min()),
            "largest_steer_deg": math.degrees(float(np.abs(self.steer).max())),
            "steering_deg": math.degrees(float(np.abs(np.diff(self.steer)).sum())),
            "largest_speed_error_kmh": 3.6 * float(np.abs(self.told_speed - self.speed).max()),
        }


@dataclass
class _Log:
    rows: list[tuple[FloatArray, ...]] = field(default_factory=list)

    def add(self, scalars: Sequence[float], *tables: FloatArray) -> None:
        self.rows.append((np.array(scalars), *tables))

    def columns(self) -> list[FloatArray]:
        return [np.array(column) for column in zip(*self.rows, strict=True)]


def stop(road: Road, brakes: Brakes, *, end_speed: float = END_SPEED) -> StopRun:
    """Roll straight, then brake until the speed is `end_speed` [m/s].

    Raises
    ------
    ConvergenceError
        If the vehicle is faster still after `LONGEST`.
    """
    estimator, vehicle = SpeedEstimator(pitch=PITCH), make_vehicle()
    drive = Drive(vehicle, vehicle.at_rest(SPEED), TIME_STEP)
    torque, log = np.zeros(4), _Log()
    time = way = aside = heading = curve = 0.0
    told = before = speed = SPEED
    parted: float | None = None
    motion = drive.look(dataclasses.replace(Controls.none(), friction=road.friction(0.0)))
    begun = False
    while speed > end_speed:
        since = time - road.rolling
        if since > LONGEST:
            raise ConvergenceError(
                f"braking, {road.title}: {speed:.1f} m/s after {LONGEST:g} s; the controller does "
                "not stop the vehicle; look at what it knows",
                drive.state,
                speed - end_speed,
            )
        sensors = Sensors.of(drive.state, motion)
        told = estimator.step(told, sensors, TIME_STEP)
        felt = dataclasses.replace(motion.wheels, alpha=np.arctan(drive.state[SIDE_SLIP]))
        rims = estimator.wheels(sensors)
        given = Given(time, since, motion.wheels, felt, sensors, told, rims)
        if not begun:
            brakes.begin(given)
            begun = True
        asked = brakes.step(given)
        yaw, rate = drive.state[[YAW, YAW_RATE]]
        push = np.zeros(4)
        if since < 0.0:
            push[:2] = 0.5 * _pull(vehicle.parameters.drag, speed) * estimator.radius
            heading, curve = yaw, rate / speed
        else:
            if parted is None and np.ptp(np.minimum(asked[:2], PEDAL[:2])) > APART:
                parted = time
            wanted = axle_rules(asked, None if parted is None else time - parted, brakes.reserve)
            torque = actuated(torque, wanted)
            brakes.held(wanted, torque)
        off, turning = yaw - heading - curve * way, rate - curve * speed
        angle = road.steer
        if since >= 0.0:
            angle -= HOLDING[0] * off + HOLDING[1] * turning
        factor = falling(road.friction(way), motion.wheels)
        if since >= 0.0:
            drift = math.atan2(drive.state[11], drive.state[10])
            aside += speed * math.sin(off + drift) * TIME_STEP
            w, known = motion.wheels, getattr(brakes, "known", _NOTHING)
            log.add(
                (since, way, speed, told, off, aside, angle),
                w.kappa,
                w.Fz,
                w.alpha,
                torque,
                factor,
                known.kappa,
                known.load,
                known.alpha,
            )
        motion = drive.step(
            TIME_STEP,
            Controls(
                steer=np.array([angle, angle, 0.0, 0.0]),
                drive=push,
                brake=torque,
                friction=factor,
                road=np.zeros(4),
            ),
        )
        before, speed = speed, float(np.hypot(*drive.state[10:12]))
        way += 0.5 * (before + speed) * TIME_STEP * (since >= 0.0)
        time += TIME_STEP
    scalars, *tables = log.columns()
    over = (end_speed - speed) / max(before - speed, 1e-12)  # the end lies within the last step
    source = getattr(brakes, "source", None)
    return StopRun(
        way - over * before * TIME_STEP,
        *scalars.T,
        *tables,
        refused=int(getattr(source, "refused", 0)),
        out_of_range=int(getattr(source, "out_of_range", 0)),
    )


_NOTHING = Known(*np.full((3, 4), np.nan))


def _pull(drag: float, speed: float) -> float:
    """Return the force [N] that holds the speed of the start."""
    return max(drag * speed**2 + 2e4 * (SPEED - speed), 0.0)


@dataclass(frozen=True)
class AntiLockStudy:
    """Stops on every road with every kind of knowledge."""

    roads: tuple[Road, ...]
    runs: dict[tuple[str, str], StopRun]

    def mean(self, roads: Sequence[str], kind: str, figure: str) -> float:
        """Return the mean of a figure over roads."""
        return float(np.mean([self.runs[road, kind].figures()[figure] for road in roads]))

    def document(self) -> dict[str, Any]:
        """Return the figures as JSON knows them."""
        rows = [
            {
                "road": road.name,
                "title": road.title,
                "knowledge": kind,
                **run.figures(),
                "estimates_refused": run.refused,
                "out_of_range": run.out_of_range,
            }
            for road in self.roads
            for kind in KINDS
            for run in (self.runs[road.name, kind],)
        ]
        return {
            "from_kmh": 3.6 * SPEED,
            "to_kmh": 3.6 * END_SPEED,
            "falling": FALLING,
            "vehicle": "14 degrees of freedom",
            "rows": rows,
        }


def study(
    virtual: Path,
    strain: Path,
    roads: Sequence[Road] = ROADS,
    progress: Callable[[str], None] | None = None,
) -> AntiLockStudy:
    """Stop on every road with every kind of knowledge.

    Parameters
    ----------
    virtual, strain : path
        The FMUs, for frames of `TIME_STEP`.
    roads : sequence of Road
    progress : callable, optional
        Called with what was done.
    """
    say = progress or (lambda _: None)
    runs = {}
    for number, road in enumerate(roads):
        runs[road.name, "perfect"] = stop(road, TractionBrakes(Perfect(), fused=False))
        runs[road.name, "today"] = stop(road, Today())
        angles = STARTS[number % len(STARTS)]
        with FourWheels(virtual, strain, start_angles=angles, parameters=AT_ONCE) as four:
            runs[road.name, "strain"] = stop(road, TractionBrakes(Strain(four), fused=True))
        say(road.title)
    return AntiLockStudy(tuple(roads), runs)


def missed(study: AntiLockStudy) -> list[str]:
    """Return in words which figures are not reached.

    No wheel may stand. The tire sensor has to shorten the way of the split roads' four starts, in
    the mean, and to keep the car nearer to its course in the turn, against today's sensors alone.
    """
    found = []
    for road in study.roads:
        slip = study.runs[road.name, "strain"].figures()["largest_slip"]
        if slip > LOCKED:
            found.append(f"antilock, {road.title}: slip {slip:.2f} > {LOCKED:g}")
    starts = [road.name for road in study.roads if road.name.startswith("split")]
    if len(starts) == STARTS_OF_SPLIT:
        strain, today = (study.mean(starts, kind, "distance_m") for kind in ("strain", "today"))
        if strain >= today:
            found.append(f"antilock, split roads: {strain:.1f} m with strain, {today:.1f} m today")
    if any(road.name == "turn" for road in study.roads):
        strain, today = (study.mean(["turn"], x, "largest_aside_m") for x in ("strain", "today"))
        if strain >= today:
            found.append(f"antilock, turn: {strain:.2f} m aside with strain, {today:.2f} m today")
    return found


def joined(studies: Sequence[AntiLockStudy]) -> AntiLockStudy:
    """Return several studies as one."""
    return AntiLockStudy(
        tuple(road for one in studies for road in one.roads),
        {key: run for one in studies for key, run in one.runs.items()},
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study by the command line; write JSON and a page."""
    from cosim.antilock_report import part, sentence

    return run_study(
        __doc__,
        "antilock",
        lambda virtual, strain, say: study(virtual, strain, progress=say),
        AntiLockStudy.document,
        lambda found: {
            "parts": [part(found)],
            "title": "Anti-lock braking with strain tires",
            "answer": sentence(found),
        },
        arguments,
    )


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
