"""One virtual tire inside an FMU: conditions in, frames of strain out, sample by sample.

The steady answers of the surface follow slip with first-order relaxation over the way travelled.
All that is random is drawn by the number of the sample, so that neither the frames nor a state that
is taken up again change it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.errors import ParameterError
from tirelib.fmu.refusals import FAULT, StepError, told
from tirelib.fmu.virtual.chance import chance, noise
from tirelib.fmu.virtual.coordinates import INPUTS
from tirelib.fmu.virtual.faults import Faults, check
from tirelib.fmu.virtual.steady import SteadyRun, wrapped
from tirelib.fmu.virtual.surface import FORCES, Surface

RATES = (100.0, 100_000.0)
"""Sample rates that are allowed [Hz]."""
OUT_OF_RANGE, DROPPED, NO_INPUT = "out_of_range", "frame_dropped", "not_started"
STANDSTILL, LOCKED = "standstill", "locked"
LOCK = 1e-9
"""Slip ratios this near to -1 are those of a wheel that does not turn."""
_UNUSED = {"": (), STANDSTILL: ("alpha", "kappa", "speed"), LOCKED: ("alpha", "kappa", "speed")}
"""Inputs that the held strain of a wheel that does not turn is not asked for."""
SETTLED = 1e-10
"""Rest of a relaxation that is dropped [rad], [1]."""
_ROUNDING = 1e-6
"""How far a step may be from a whole sample and still end on it, in samples."""
_ALPHA, _KAPPA, _SPEED = INPUTS.index("alpha"), INPUTS.index("kappa"), INPUTS.index("speed")
_LAGGED = [_ALPHA, _KAPPA]


@dataclass(frozen=True, slots=True)
class Options:
    """What a host sets before the start.

    Attributes
    ----------
    rate : float, [Hz]
        Sample rate.
    relaxation : tuple of two floats, [m]
        Relaxation length of slip angle and slip ratio; 0: none.
    noise : float
        Standard deviation of the gages' noise, as strain.
    seed : int
        Of noise and dropped frames; the wheels of a car need different ones.
    start_angle : float, [rad]
        Wheel angle at the start.
    faults : Faults

    Raises
    ------
    ParameterError
        If one is out of range.
    """

    rate: float = 10_000.0
    relaxation: tuple[float, float] = (0.3, 0.1)
    noise: float = 4e-6
    seed: int = 0
    start_angle: float = -math.pi
    faults: Faults = field(default_factory=Faults)

    def __post_init__(self) -> None:
        check("sample_rate", self.rate, *RATES)
        check("relaxation_length", self.relaxation[0], 0.0, 100.0)
        check("relaxation_length_kappa", self.relaxation[1], 0.0, 100.0)
        check("noise_std", self.noise, 0.0, 1.0)
        check("seed", self.seed, 0, 2**31 - 1)
        check("start_angle", self.start_angle, -math.pi, math.pi)


class VirtualWheel:
    """A tire on a wheel.

    Parameters
    ----------
    surface : Surface
    options : Options
    samples : int
        Most samples of a frame.
    """

    def __init__(self, surface: Surface, options: Options, samples: int) -> None:
        gages = surface.lateral.size
        if not 0 <= options.faults.dead_gage <= gages:
            raise ParameterError(
                f"dead_gage = {options.faults.dead_gage}; allowed are 0 (none) to {gages}; set "
                "another number before the FMU is initialised"
            )
        self._surface, self._options, self.samples = surface.warm(), options, samples
        self._lengths = np.array(options.relaxation)
        self._slip: FloatArray | None = None  # alpha and kappa as the tire feels them
        self._angle = options.start_angle
        self._omega, self._radius = 0.0, math.nan
        self._due = 0.0  # samples since the last one
        self._count = 0  # samples so far
        self._frame = np.zeros((samples, gages))
        self._force = [math.nan] * len(FORCES)
        self._new, self._valid, self._status = 0, False, NO_INPUT
        self._asked: FloatArray | None = None  # inputs of the last single answer
        self._answer: FloatArray | None = None
        self._waveform: FloatArray | None = None
        self._rolls: tuple[float, float, float] | None = None  # what the radius was found for
        self._run: SteadyRun | None = None  # while the conditions stay
        self._last: FloatArray | None = None  # answer of the last sample
        self._held: FloatArray | None = None  # strain of a wheel that does not turn

    def begin(self, inputs: Sequence[float]) -> None:
        """Take the first conditions: slip starts settled, the sample at time zero is given."""
        given = np.asarray(inputs, dtype=np.float64)
        self._new = 1
        self._take(given, np.zeros(1), 1)

    def step(self, step: float, inputs: Sequence[float]) -> bool:
        """Go on by one communication step with constant conditions.

        Samples are due at whole multiples of the sample period since the start; the last one of a
        step may be at its end.

        Parameters
        ----------
        step : float, [s]
        inputs : sequence of float
            In the order of `INPUTS`.

        Raises
        ------
        StepError
            If the step is no positive number, or holds more samples than a frame; nothing has
            changed then.
        """
        rate = self._options.rate
        exact = step * rate
        if not (math.isfinite(exact) and exact > 0.0):
            raise StepError(
                f"communication step = {step} s; allowed is above 0; step by "
                f"{self.samples / rate:g} s"
            )
        until = self._due + exact
        count = math.floor(until + _ROUNDING)
        if count > self.samples:
            raise StepError(
                f"communication step = {step} s brings {count} samples at {rate:g} Hz; allowed are "
                f"up to {self.samples}, the frame's length; step by {self.samples / rate:g} s"
            )
        due, self._due, self._new = self._due, until - count, count
        if self._run is not None and self._run.inputs == list(inputs):
            self._go_on(self._run, step, count)
        else:
            self._run = None
            times = (np.arange(1, count + 1) - due) / rate
            self._take(np.asarray(inputs, dtype=np.float64), np.append(times, step), count)
        return True

    def _go_on(self, run: SteadyRun, step: float, n: int) -> None:
        """Move on with nothing changed: n samples."""
        self._angle = run.go_on(step)
        if n and not self._lost():
            self._show(run.samples(self._count, n))
        self._count += n

    def _take(self, given: FloatArray, times: FloatArray, n: int) -> None:
        """Move on; the first n times [s] are samples, the last is the end of the step."""
        still = _still(given)
        outside = self._surface.outside(given)
        wrong = tuple(name for name in outside if name not in _UNUSED[still])
        omega = 0.0 if still else self._turn_rate(given, wrong)
        slips = self._relaxed(given, times)
        angles = self._angle + omega * times
        self._omega = omega
        self._angle = wrapped(float(angles[-1]))
        if not still:
            self._held = None
            wrong = wrong or self._lag_outside(given, slips)
        if wrong:
            self._valid, self._status = False, f"{OUT_OF_RANGE}: {', '.join(wrong)}"
        elif still:
            self._stand(still, n)
        elif n:
            self._measure(given, slips, angles, n)
        self._count += n
        steady = n and not wrong and not still and len(slips) == 1
        if steady and self._waveform is not None and self._answers_to(given):
            self._run = self._steady(given.tolist(), {})

    def _answers_to(self, given: FloatArray) -> bool:
        """Tell whether the last single answer is of this condition."""
        return self._asked is not None and bool((self._asked[0] == given).all())

    def _steady(self, inputs: list[float], place: dict[str, Any]) -> SteadyRun:
        """Return samples from now on, or from where a state says, if nothing changes."""
        begin = {"angle": self._angle, "due": self._due, "count": self._count, **place}
        return SteadyRun(self._found, inputs, self._omega, self._options.rate, **begin)

    def _found(self, angles: FloatArray, first: int) -> FloatArray:
        """Return what the gages show of the last condition, with noise and faults."""
        if self._answer is None:  # a run begins with an answer
            return np.full((angles.size, self._surface.lateral.size), np.nan)
        return self._seen(self._surface.strain(self._answer, angles, self._waveform), first)

    def _stand(self, why: str, n: int) -> None:
        """Hold the strain of the angle at which the wheel stopped; the noise goes on."""
        if self._last is None:
            self._valid, self._status = False, why
            return
        if self._held is None:
            self._held = self._surface.strain(self._last, np.array([self._angle]))
        if n and not self._lost():
            self._show(self._seen(np.repeat(self._held, n, axis=0), self._count))
            words = (why, self._status) if self._status != "ok" else (why,)
            self._status = ";".join(words)

    def _turn_rate(self, given: FloatArray, wrong: tuple[str, ...]) -> float:
        """Return Omega = v (1 + kappa) / R_e; out of range R_e stays, without speed the rest."""
        load, speed, pressure = (float(given[i]) for i in (0, _SPEED, 5))
        known = not {"Fz", "speed", "pressure"} & set(wrong)
        if known and self._rolls != (load, speed, pressure):
            self._rolls = load, speed, pressure
            self._radius = self._surface.rolling_radius(load, speed, pressure)
        found = speed * (1.0 + float(given[_KAPPA])) / self._radius
        return found if math.isfinite(found) else self._omega

    def _relaxed(self, given: FloatArray, times: FloatArray) -> FloatArray:
        """Return slip at these times, shape (n, 2): d s / d x = (s_given - s) / length."""
        goal = given[_LAGGED]
        if self._slip is None:
            if not np.all(np.isfinite(goal)):
                return np.full((times.size, 2), np.nan)
            self._slip = goal.copy()
        goal = np.where(np.isfinite(goal), goal, self._slip)
        rest = self._slip - goal
        rest[np.abs(rest) < SETTLED] = 0.0
        if not rest.any():
            self._slip = goal
            return goal[None]
        way = abs(float(given[_SPEED])) * times
        way = np.where(np.isfinite(way), way, 0.0)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.where(self._lengths > 0.0, np.exp(-way / self._lengths), 0.0)
        found: FloatArray = goal + rest * left
        self._slip = found[-1]
        return found

    def _lag_outside(self, given: FloatArray, slips: FloatArray) -> tuple[str, ...]:
        """Return which of the relaxed inputs are still out of range; the ends of a step tell."""
        names: tuple[str, ...] = ()
        if len(slips) == 1:
            return names
        for row in (slips[0], slips[-1]):
            felt = given.copy()
            felt[_LAGGED] = row
            names += tuple(name for name in self._surface.outside(felt) if name not in names)
        return names

    def _measure(self, given: FloatArray, slips: FloatArray, angles: FloatArray, n: int) -> None:
        """Fill the frame with n samples."""
        if self._lost():
            return
        answers, waveform = self._answers(given, slips[:n])
        strain = self._surface.strain(answers, angles[:n], waveform)
        self._show(self._seen(strain, self._count))
        self._force = self._surface.forces_of(answers)[-1].tolist()
        self._last = answers[-1:]

    def _lost(self) -> bool:
        """Tell whether the frame that begins with the next sample does not come."""
        faults = self._options.faults
        if not (faults.dropped > 0.0 and self._count / self._options.rate >= faults.start):
            return False
        lost = chance(self._options.seed, self._count) < faults.dropped
        if lost:
            self._valid, self._status = False, DROPPED
        return lost

    def _seen(self, strain: FloatArray, first: int) -> FloatArray:
        """Return strain with noise and faults; the samples are numbered from `first` on."""
        n, gages = strain.shape
        if self._options.noise > 0.0:
            strain = strain + self._options.noise * noise(self._options.seed, first, n, gages)
        return self._options.faults.of(strain, (first + np.arange(n)) / self._options.rate)

    def _show(self, seen: FloatArray) -> None:
        """Put the next samples into the frame."""
        n = len(seen)
        self._frame[:n] = seen
        self._frame[n:] = seen[-1]
        words = self._options.faults.words((self._count + n - 1) / self._options.rate)
        self._valid, self._status = True, ";".join(words) or "ok"

    def _answers(
        self, given: FloatArray, slips: FloatArray
    ) -> tuple[FloatArray, FloatArray | None]:
        """Ask the surface; of a condition that stays, also the waveform, both once."""
        table = np.repeat(given[None], len(slips), axis=0)
        table[:, _LAGGED] = slips
        if len(table) > 1:
            return self._surface.answers(table), None
        if self._asked is None or self._answer is None or (table != self._asked).any():
            self._asked, self._waveform = table, None
            self._answer = self._surface.answers(table)
        elif self._waveform is None:
            self._waveform = self._surface.waveform(self._answer)
        return self._answer, self._waveform

    def fault(self, cause: str) -> None:
        """Hold the last values as invalid, after an error."""
        self._run = None
        self._valid, self._status = False, told(FAULT, cause)

    def outputs(self) -> tuple[list[float], tuple[Any, ...]]:
        """Return the values of the Real outputs and of the others, in the table's order."""
        slip = [math.nan] * 2 if self._slip is None else self._slip.tolist()
        reals = [
            *self._frame.ravel().tolist(), self._omega, self._angle, *slip, *self._force,
            self._radius,
        ]  # fmt: skip
        return reals, (self._new, self._valid, self._omega != 0.0, self._status)

    def state(self) -> dict[str, Any]:
        """Return everything that is remembered, as JSON knows it."""
        return {
            "slip": None if self._slip is None else [x.hex() for x in self._slip.tolist()],
            "reals": [x.hex() for x in (self._angle, self._omega, self._radius, self._due)],
            "frame": [x.hex() for x in self._frame.ravel().tolist()],
            "force": [x.hex() for x in self._force],
            "asked": None if self._asked is None else [x.hex() for x in self._asked[0].tolist()],
            "last": None if self._last is None else [x.hex() for x in self._last[0].tolist()],
            "held": None if self._held is None else [x.hex() for x in self._held[0].tolist()],
            "run": None if self._run is None else self._run.state(),
            "counts": [self._count, self._new],
            "valid": self._valid,
            "status": self._status,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state of a wheel with the same parameters."""
        slip = state["slip"]
        self._slip = None if slip is None else np.array([float.fromhex(x) for x in slip])
        self._angle, self._omega, self._radius, self._due = map(float.fromhex, state["reals"])
        frame = [float.fromhex(x) for x in state["frame"]]
        self._frame = np.array(frame).reshape(self._frame.shape)
        self._force = [float.fromhex(x) for x in state["force"]]
        self._count, self._new = state["counts"]
        self._valid, self._status = state["valid"], state["status"]
        self._rolls = self._waveform = self._asked = self._run = None
        self._last, self._held = _row(state["last"]), _row(state["held"])
        if state["asked"] is not None:
            self._asked = _row(state["asked"])
            self._answer = self._surface.answers(np.asarray(self._asked))
        run = state["run"]
        if run is not None and self._answer is not None and self._asked is not None:
            self._waveform = self._surface.waveform(self._answer)
            place = {name: float.fromhex(run[name]) for name in ("angle", "due", "time")}
            inputs = self._asked[0].tolist()
            self._run = self._steady(inputs, {**place, "count": run["count"]})


def _row(values: list[str] | None) -> FloatArray | None:
    return None if values is None else np.array([[float.fromhex(x) for x in values]])


def _still(given: FloatArray) -> str:
    """Return why the wheel does not turn, or nothing."""
    speed, kappa = float(given[_SPEED]), float(given[_KAPPA])
    if speed == 0.0:
        return STANDSTILL
    return LOCKED if math.isfinite(speed) and speed > 0.0 and abs(kappa + 1.0) < LOCK else ""
