"""Slip control by brakes: what it costs to know the tires once per turn only.

    python -m cosim.closed_loop --virtual T.fmu --strain S.fmu --out build/out/closed_loop

The same controller brakes the same vehicle from 100 km/h with four sources of what it must know of
each wheel, load and slip ratio (`closed_loop_sources`). `study` gives the distances.

The virtual tire ends at 20 km/h and 12 % of slip: the way is measured down to `END_SPEED`, and the
controller aims at half that slip.
"""

import dataclasses
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim.closed_loop_command import run_study
from cosim.closed_loop_controller import SlipController
from cosim.closed_loop_sources import TIME_STEP, OncePerTurn, OneTurnLate, Perfect, Source, Strain
from cosim.vehicle14.files import make_vehicle
from cosim.vehicle14.model import SPIN, Controls
from cosim.vehicle14.run import Drive
from cosim.wheels import FourWheels
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.threads import one_thread

YAW, YAW_RATE = 5, 15
"""Places in the vehicle's state."""
SPEED, END_SPEED = 100.0 / 3.6, 25.0 / 3.6
"""The way is counted between these [m/s]."""
SLOWEST = 21.0 / 3.6
"""The virtual tire ends at 20 km/h [m/s]."""
LONGEST = 8.0
"""A run that has not ended by then never will [s]."""
HOLDING = (0.8, 0.25)
"""Steering angle per yaw [1] and per yaw rate [s] of a driver who holds the course."""
STARTS = ((-3.1, -1.6, 0.6, 2.2), (-1.5, 0.0, 2.2, -2.5))
"""Wheel angles at time zero of repeated runs: when the contacts come is chance."""


@dataclass(frozen=True)
class Braking:
    """A road to brake on.

    Attributes
    ----------
    name, title : str
    friction : callable
        Its scale for each wheel, by the way since the brakes were put on.
    steer : float, [rad]
        Angle of the front wheels.
    rolling : float, [s]
        Time before the brakes: two turns of every wheel, and the turn settles.
    holds : bool
        Whether the driver steers against a yaw of the vehicle.
    """

    name: str
    title: str
    friction: Callable[[float], FloatArray]
    steer: float = 0.0
    rolling: float = 0.35
    holds: bool = False

    def angles(self, yaw: float, yaw_rate: float) -> FloatArray:
        """Return the steering angles [rad], shape (4,), by yaw [rad] and its rate [rad/s]."""
        against = HOLDING[0] * yaw + HOLDING[1] * yaw_rate if self.holds else 0.0
        return (self.steer - against) * np.array([1.0, 1.0, 0.0, 0.0])


def _dry(_: float) -> FloatArray:
    return np.ones(4)


def _wet_patch(way: float) -> FloatArray:
    """Return less friction from 10 m on, first under the front wheels."""
    return np.where(way + np.array([0.0, 0.0, -2.7, -2.7]) > 10.0, 0.8, 1.0)


def _split(_: float) -> FloatArray:
    """Return less friction under the left wheels."""
    return np.array([0.6, 1.0, 0.6, 1.0])


ROADS = (
    Braking("dry", "dry road", _dry),
    Braking("drop", "friction falls to 0.8 after 10 m", _wet_patch),
    Braking("turn", "in a turn of 4 m/s\N{SUPERSCRIPT TWO}", _dry, 0.019, 1.5),
    Braking("split", "friction 0.6 under the left wheels", _split, holds=True),
)
SHOWN_ROADS = (ROADS[0], ROADS[3])
"""What `make cosim` shows."""


@dataclass(frozen=True)
class BrakingRun:
    """One run; arrays over the steps, wheels in the second axis.

    Attributes
    ----------
    distance : float, [m]
        From the brakes at 100 km/h to `END_SPEED`.
    time, way, speed : array, shape (n,)
        Since the brakes were put on.
    kappa, load, alpha, known_kappa, known_load, torque : array, shape (n, 4)
    yaw : float, [rad]
        How far the vehicle turned.
    out_of_range : int
        Steps of wheels that the virtual tire had no strain for.
    refused : int
        Estimates that were not valid, and so not used.
    delay : float, [s]
        From the middle of a contact to its estimate, median; NaN without strain.
    """

    distance: float
    time: FloatArray
    way: FloatArray
    speed: FloatArray
    kappa: FloatArray
    load: FloatArray
    alpha: FloatArray
    known_kappa: FloatArray
    known_load: FloatArray
    torque: FloatArray
    yaw: float
    out_of_range: int
    refused: int
    delay: float


def brake(
    road: Braking,
    source: Source,
    controller: SlipController | None = None,
    *,
    end_speed: float = END_SPEED,
) -> BrakingRun:
    """Roll with the steering held, then brake until the speed is `end_speed` [m/s].

    Raises
    ------
    ParameterError
        If `end_speed` is above the start's or below that of the virtual tire.
    ConvergenceError
        If the vehicle is faster still after `LONGEST`.
    """
    if not SLOWEST <= end_speed < SPEED - 1.0:
        raise ParameterError(
            f"end_speed = {end_speed:g} m/s; allowed are {SLOWEST:.2f} .. {SPEED - 1.0:.2f} m/s, "
            "where the virtual tire has strain; choose another"
        )
    control = controller or SlipController()
    vehicle = make_vehicle()
    drive = Drive(vehicle, vehicle.at_rest(SPEED), TIME_STEP)
    given = dataclasses.replace(Controls.none(), steer=road.angles(0.0, 0.0))
    motion = drive.look(given)
    source.begin(motion.wheels, drive.state[SPIN])
    asked, spin = np.full(4, control.first), drive.state[SPIN]
    rows: list[tuple[FloatArray, ...]] = []
    time = way = 0.0
    speed = before = SPEED
    while speed > end_speed:
        if time > LONGEST:
            raise ConvergenceError(
                f"braking, {road.title}: {speed:.1f} m/s after {LONGEST:g} s; the controller does "
                "not stop the vehicle; look at what it knows",
                drive.state,
                speed - end_speed,
            )
        given = dataclasses.replace(given, steer=road.angles(*drive.state[[YAW, YAW_RATE]]))
        if time < road.rolling:
            known = source.step(time, motion.wheels, drive.state[SPIN])
            push = _hold(vehicle.parameters.drag, speed)
            motion = drive.step(TIME_STEP, dataclasses.replace(given, drive=push))
            speed, spin = float(np.hypot(*drive.state[10:12])), drive.state[SPIN]
        else:
            since = time - road.rolling
            slowing = (spin - drive.state[SPIN]) / TIME_STEP * control.radius
            known = source.step(time, motion.wheels, drive.state[SPIN])
            asked, torque = control.step(asked, known, slowing, speed, since)
            wheels = motion.wheels
            rows.append(
                (
                    np.array([since, way, speed]),
                    wheels.kappa,
                    wheels.Fz,
                    wheels.alpha,
                    known.kappa,
                    known.load,
                    torque,
                )
            )
            spin = drive.state[SPIN]
            held = dataclasses.replace(given, brake=torque, friction=road.friction(way))
            motion = drive.step(TIME_STEP, held)
            before, speed = speed, float(np.hypot(*drive.state[10:12]))
            way += 0.5 * (before + speed) * TIME_STEP
        time += TIME_STEP
    scalars, *tables = (np.array(column) for column in zip(*rows, strict=True))
    over = (end_speed - speed) / max(before - speed, 1e-12)  # the end lies within the last step
    delays = getattr(source, "delays", [])
    since_brakes, ways, speeds = scalars.T
    kappa, load, alpha, known_kappa, known_load, torques = tables
    return BrakingRun(
        distance=way - over * before * TIME_STEP,
        time=since_brakes,
        way=ways,
        speed=speeds,
        kappa=kappa,
        load=load,
        alpha=alpha,
        known_kappa=known_kappa,
        known_load=known_load,
        torque=torques,
        yaw=float(drive.state[YAW]),
        out_of_range=int(getattr(source, "out_of_range", 0)),
        refused=int(getattr(source, "refused", 0)),
        delay=float(np.median(delays)) if delays else math.nan,
    )


def _hold(drag: float, speed: float) -> FloatArray:
    """Return drive torques [N m] that hold the speed of the start, and give way to none below."""
    wanted = (drag * speed**2 + 2e4 * (SPEED - speed)) * SlipController.radius
    return np.array([0.5, 0.5, 0.0, 0.0]) * max(wanted, 0.0)


@dataclass(frozen=True)
class Outcome:
    """What one source did on one road, over repeated runs."""

    road: str
    source: str
    runs: tuple[BrakingRun, ...]
    perfect: float

    @property
    def distances(self) -> FloatArray:
        """Distances of the runs [m]."""
        return np.array([run.distance for run in self.runs])

    @property
    def loss(self) -> float:
        """How much longer than with perfect knowledge, relative, mean over the runs."""
        return float(self.distances.mean() / self.perfect - 1.0)

    @property
    def slip_error(self) -> float:
        """Rms of true slip less target, from 0.3 s on [1]."""
        parts = [run.kappa[run.time > 0.3] - SlipController.target for run in self.runs]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

    @property
    def refused(self) -> int:
        """Estimates of all runs that were not valid."""
        return sum(run.refused for run in self.runs)

    @property
    def rear_angle(self) -> float:
        """Largest slip angle of a rear wheel over the runs [deg]."""
        return math.degrees(max(float(np.abs(run.alpha[:, 2:]).max()) for run in self.runs))


@dataclass(frozen=True)
class Study:
    """All roads and sources; `end_speed` [m/s] is where the way ends."""

    outcomes: tuple[Outcome, ...]
    end_speed: float

    def of(self, road: str, source: str) -> Outcome:
        """Return one of them."""
        return next(o for o in self.outcomes if (o.road, o.source) == (road, source))

    def document(self) -> dict[str, Any]:
        """Return the figures as JSON knows them."""
        rows = [
            {
                "road": o.road,
                "source": o.source,
                "runs": len(o.runs),
                "distance_m": float(o.distances.mean()),
                "distance_spread_m": float(np.ptp(o.distances)),
                "loss": o.loss,
                "rms_slip_error": o.slip_error,
                "least_kappa": float(min(run.kappa.min() for run in o.runs)),
                "largest_rear_alpha_deg": o.rear_angle,
                "turned_deg": [math.degrees(run.yaw) for run in o.runs],
                "estimates_refused": o.refused,
                "out_of_range": sum(run.out_of_range for run in o.runs),
                "delay_s": _finite(float(np.median([run.delay for run in o.runs]))),
            }
            for o in self.outcomes
        ]
        return {
            "from_kmh": SPEED * 3.6,
            "to_kmh": self.end_speed * 3.6,
            "controller": dataclasses.asdict(SlipController()),
            "rows": rows,
        }


def joined(studies: Sequence[Study]) -> Study:
    """Return several studies as one."""
    return Study(tuple(o for study in studies for o in study.outcomes), studies[0].end_speed)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def study(
    virtual: Path,
    strain: Path,
    roads: Sequence[Braking] = ROADS,
    starts: Sequence[Sequence[float]] = STARTS,
    progress: Callable[[str], None] | None = None,
    *,
    end_speed: float = END_SPEED,
) -> Study:
    """Brake on every road with every source.

    Parameters
    ----------
    virtual, strain : path
        The FMUs, for frames of `TIME_STEP`.
    roads : sequence of Braking
    starts : sequence of 4 floats each, [rad]
        Wheel angles at time zero of the repetitions.
    progress : callable, optional
        Called with what was done.
    end_speed : float, [m/s]
        Down to which the way is measured.
    """
    say = progress or (lambda _: None)
    outcomes = []
    for road in roads:
        perfect = brake(road, Perfect(), end_speed=end_speed)
        found: dict[str, tuple[BrakingRun, ...]] = {
            "perfect": (perfect,),
            "one turn late": (brake(road, OneTurnLate(), end_speed=end_speed),),
            "once per turn": tuple(
                brake(road, OncePerTurn(angles), end_speed=end_speed) for angles in starts
            ),
        }
        say(f"{road.title}: truth")
        runs = []
        for number, angles in enumerate(starts):
            with FourWheels(virtual, strain, start_angles=angles, seed=1 + 4 * number) as four:
                runs.append(brake(road, Strain(four), end_speed=end_speed))
            say(f"{road.title}: strain {number + 1} of {len(starts)}")
        found["strain"] = tuple(runs)
        outcomes += [
            Outcome(road.name, source, made, perfect.distance) for source, made in found.items()
        ]
    return Study(tuple(outcomes), end_speed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study by the command line; write JSON and a page."""
    from cosim.closed_loop_report import parts, sentence

    return run_study(
        __doc__,
        "closed_loop",
        lambda virtual, strain, say: study(virtual, strain, progress=say),
        Study.document,
        lambda found: {
            "parts": parts(found),
            "title": "Slip control with strain tires",
            "answer": sentence(found, ROADS[0].name),
        },
        arguments,
    )


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
