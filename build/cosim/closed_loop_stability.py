"""Stability control by one front brake: what it costs to know the tires once per turn only.

    python -m cosim.closed_loop_stability --virtual T.fmu --strain S.fmu --out build/out/stability

A driver steers a sine with a dwell while the rear wheels stand on a more slippery road. The
controller knows the slip angles and loads of the wheels from one of the sources of
`closed_loop_sources`; a gyroscope it has none. Where the rear axle's slip angle exceeds a
threshold it brakes the front wheel on the outside of the turn.

The virtual tires have the friction under their wheels; the calibration is that of a dry road.
"""

import dataclasses
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim.closed_loop import STARTS, YAW_RATE
from cosim.closed_loop_command import run_study
from cosim.closed_loop_sources import (
    TIME_STEP,
    Known,
    OncePerTurn,
    OneTurnLate,
    Perfect,
    Source,
    Strain,
)
from cosim.vehicle14.files import make_vehicle
from cosim.vehicle14.model import SPIN, Controls
from cosim.vehicle14.run import Drive
from cosim.wheels import FourWheels
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread

FORWARD, SIDE = 10, 11
"""Places in the vehicle's state: velocities in its axes."""


@dataclass(frozen=True)
class Swerve:
    """A sine with dwell, on a road that is slippery under the rear wheels.

    Attributes
    ----------
    speed : float, [m/s]
        At the start; no drive torque.
    angle : float, [rad]
        Largest of the front wheels.
    frequency : float, [Hz]
    dwell : float, [s]
        How long the second extreme is held.
    rolling : float, [s]
        Before the driver steers: two turns of every wheel.
    lasts : float, [s]
    rear_friction : float
        Its scale under the rear wheels.
    """

    speed: float = 80.0 / 3.6
    angle: float = 0.05
    frequency: float = 0.7
    dwell: float = 0.5
    rolling: float = 0.4
    lasts: float = 3.6
    rear_friction: float = 0.7

    def steer(self, time: float) -> float:
        """Return the angle of the front wheels [rad], to the left positive."""
        since, hold = time - self.rolling, 0.75 / self.frequency
        if hold < since <= hold + self.dwell:
            return -self.angle
        phase = since if since <= hold else since - self.dwell
        if not 0.0 <= phase <= 1.0 / self.frequency:
            return 0.0
        return self.angle * math.sin(2.0 * math.pi * self.frequency * phase)


@dataclass(frozen=True)
class StabilityController:
    """Yaw moment M = gain (alpha_rear - threshold), by the front brake outside the turn.

    alpha_rear is the mean of what is known of the rear wheels. The brake's force is |M| over half
    the track, at most `most` times the wheel's known load; it is let off as the known slip ratio
    goes from half of `deepest` to all of it. Nothing known: no torque.

    Attributes
    ----------
    gain : float, [N m / rad]
    threshold : float, [rad]
    most : float
    deepest : float
        Slip ratio, < 0.
    radius, half_track : float, [m]
    """

    gain: float = 1.2e5
    threshold: float = math.radians(2.0)
    most: float = 0.7
    deepest: float = -0.08
    radius: float = 0.31
    half_track: float = 0.775

    def torque(self, known: Known) -> FloatArray:
        """Return brake torques [N m], shape (4,)."""
        found = np.zeros(4)
        rear = float(np.mean(known.alpha[2:]))
        excess = math.copysign(max(abs(rear) - self.threshold, 0.0), rear)
        if not math.isfinite(rear) or excess == 0.0:
            return found
        outside = 1 if excess < 0.0 else 0  # a left turn has slip angles below zero
        load, slip = float(known.load[outside]), float(known.kappa[outside])
        if math.isfinite(load) and math.isfinite(slip):
            force = min(self.gain * abs(excess) / self.half_track, self.most * load)
            found[outside] = (
                self.radius * force * float(np.clip(2.0 - 2.0 * slip / self.deepest, 0.0, 1.0))
            )
        return found


@dataclass(frozen=True)
class SwerveRun:
    """One run; arrays over the steps, wheels in the second axis, SI, ISO 8855.

    Attributes
    ----------
    time, steer, yaw_rate, side_slip, speed : array, shape (n,)
        Since the start; side slip of the sprung mass's centre of gravity.
    alpha, kappa, known_alpha, torque : array, shape (n, 4)
    out_of_range, refused : int
        Steps of wheels without strain; estimates that were not valid, and so not used.
    """

    time: FloatArray
    steer: FloatArray
    yaw_rate: FloatArray
    side_slip: FloatArray
    speed: FloatArray
    alpha: FloatArray
    kappa: FloatArray
    known_alpha: FloatArray
    torque: FloatArray
    out_of_range: int
    refused: int

    @property
    def rear_angle(self) -> float:
        """Largest slip angle of a rear wheel [rad]."""
        return float(np.abs(self.alpha[:, 2:]).max())

    @property
    def largest_side_slip(self) -> float:
        """Largest side slip of the vehicle [rad]."""
        return float(np.abs(self.side_slip).max())

    @property
    def lost_speed(self) -> float:
        """Speed that the manoeuvre and the brakes took [m/s]."""
        return float(self.speed[0] - self.speed[-1])


def swerve(
    source: Source | None, road: Swerve | None = None, controller: StabilityController | None = None
) -> SwerveRun:
    """Drive the manoeuvre; without a source nobody brakes."""
    road, control = road or Swerve(), controller or StabilityController()
    vehicle = make_vehicle()
    drive = Drive(vehicle, vehicle.at_rest(road.speed), TIME_STEP)
    rear = road.rear_friction
    given = dataclasses.replace(Controls.none(), friction=np.array([1.0, 1.0, rear, rear]))
    motion = drive.look(given)
    if source is not None:
        source.begin(motion.wheels, drive.state[SPIN])
    rows: list[tuple[FloatArray, ...]] = []
    unknown = Known(*np.full((3, 4), np.nan))
    for number in range(round(road.lasts / TIME_STEP)):
        time, wheels = number * TIME_STEP, motion.wheels
        known = source.step(time, wheels, drive.state[SPIN]) if source is not None else unknown
        torque, angle = control.torque(known), road.steer(time)
        x = drive.state
        scalars = (
            time,
            angle,
            x[YAW_RATE],
            math.atan2(x[SIDE], x[FORWARD]),
            math.hypot(x[FORWARD], x[SIDE]),
        )
        rows.append((np.array(scalars), wheels.alpha, wheels.kappa, known.alpha, torque))
        steer = np.array([angle, angle, 0.0, 0.0])
        motion = drive.step(TIME_STEP, dataclasses.replace(given, steer=steer, brake=torque))
    table, alpha, kappa, told, torques = (np.array(x) for x in zip(*rows, strict=True))
    return SwerveRun(
        *table.T,
        alpha,
        kappa,
        told,
        torques,
        out_of_range=int(getattr(source, "out_of_range", 0)),
        refused=int(getattr(source, "refused", 0)),
    )


@dataclass(frozen=True)
class StabilityOutcome:
    """What one source did, over repeated runs with other wheel angles at the start."""

    source: str
    runs: tuple[SwerveRun, ...]

    def worst(self, name: str) -> float:
        """Return the largest of a figure of `SwerveRun` over the runs."""
        return float(max(getattr(run, name) for run in self.runs))


def stability(
    virtual: Path,
    strain: Path,
    road: Swerve | None = None,
    starts: Sequence[Sequence[float]] = STARTS,
    progress: Callable[[str], None] | None = None,
) -> tuple[StabilityOutcome, ...]:
    """Drive the manoeuvre without control, and with every source.

    Parameters
    ----------
    virtual, strain : path
        The FMUs, for frames of `TIME_STEP`.
    road : Swerve, optional
    starts : sequence of 4 floats each, [rad]
        Wheel angles at time zero of the repetitions.
    progress : callable, optional
        Called with what was done.
    """
    say = progress or (lambda _: None)
    found = {
        "no control": (swerve(None, road),),
        "perfect": (swerve(Perfect(), road),),
        "one turn late": (swerve(OneTurnLate(), road),),
        "once per turn": tuple(swerve(OncePerTurn(angles), road) for angles in starts),
    }
    say("stability: truth")
    runs = []
    for number, angles in enumerate(starts):
        with FourWheels(virtual, strain, start_angles=angles, seed=1 + 4 * number) as four:
            runs.append(swerve(Strain(four), road))
        say(f"stability: strain {number + 1} of {len(starts)}")
    found["strain"] = tuple(runs)
    return tuple(StabilityOutcome(name, made) for name, made in found.items())


def document(outcomes: Sequence[StabilityOutcome]) -> dict[str, Any]:
    """Return the figures as JSON knows them."""
    return {
        "controller": dataclasses.asdict(StabilityController()),
        "road": dataclasses.asdict(Swerve()),
        "rows": [
            {
                "source": o.source,
                "runs": len(o.runs),
                "rear_alpha_deg": math.degrees(o.worst("rear_angle")),
                "side_slip_deg": math.degrees(o.worst("largest_side_slip")),
                "lost_speed_kmh": 3.6 * o.worst("lost_speed"),
                "refused": sum(run.refused for run in o.runs),
                "out_of_range": sum(run.out_of_range for run in o.runs),
            }
            for o in outcomes
        ],
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study by the command line; write JSON and a page."""
    from cosim.closed_loop_stability_report import part, sentence

    return run_study(
        __doc__,
        "stability",
        lambda virtual, strain, say: stability(virtual, strain, progress=say),
        document,
        lambda found: {
            "parts": [part(found)],
            "title": "Stability control with strain tires",
            "answer": sentence(found),
        },
        arguments,
    )


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
