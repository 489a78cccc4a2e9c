"""One virtual tire inside an FMU: conditions in, frames of strain out, sample by sample.

The steady answers of the surface follow slip with first-order relaxation over the way travelled.
All that is random is drawn by the number of the sample, so that neither the frames nor a state that
is taken up again change it.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.fmu.refusals import FAULT, StepError, status_entry
from tirelib.fmu.virtual.chance import chance, noise
from tirelib.fmu.virtual.coordinates import INPUTS
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.relaxation import Relaxation
from tirelib.fmu.virtual.steady import SteadyRun, wrapped
from tirelib.fmu.virtual.surface import FORCES, Surface

OUT_OF_RANGE, DROPPED, NO_INPUT = "out_of_range", "frame_dropped", "not_started"
STANDSTILL, LOCKED = "standstill", "locked"
LOCK = 1e-9
"""Slip ratios this near to -1 are those of a wheel that does not turn."""
_UNUSED = {"": (), STANDSTILL: ("alpha", "kappa", "speed"), LOCKED: ("alpha", "kappa", "speed")}
"""Inputs that the held strain of a wheel that does not turn is not asked for."""
_ROUNDING = 1e-6
"""How far a step may be from a whole sample and still end on it, in samples."""
_ALPHA, _KAPPA, _SPEED = INPUTS.index("alpha"), INPUTS.index("kappa"), INPUTS.index("speed")
_LOAD, _PRESSURE = INPUTS.index("Fz"), INPUTS.index("pressure")
_LAGGED = [_ALPHA, _KAPPA]


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
        self._slip = Relaxation(options.relaxation)
        self._angle = options.start_angle
        self._omega, self._radius = 0.0, math.nan
        self._due = 0.0  # samples since the last one
        self._count = 0  # samples so far
        self._frame = np.zeros((samples, gages))
        self._force = [math.nan] * len(FORCES)
        self._new, self._valid, self._status = 0, False, NO_INPUT
        self._asked: list[float] | None = None  # inputs of the last single answer
        self._answer: FloatArray | None = None
        self._waveform: FloatArray | None = None
        self._rolls: tuple[float, float, float] | None = None  # what the radius was found for
        self._run: SteadyRun | None = None  # while the conditions stay
        self._last: FloatArray | None = None  # answer of the last sample
        self._held: FloatArray | None = None  # strain of a wheel that does not turn
        self.outside: tuple[str, ...] = ()  # inputs of the last step that are out of range

    def begin(self, inputs: Sequence[float]) -> None:
        """Take the first conditions: slip starts settled, the sample at time zero is given."""
        self._new = 1
        self._take(list(inputs), 0.0, 1.0, 1)
        self._count = 1

    def step(self, step: float, inputs: Sequence[float]) -> bool:
        """Go on by one communication step with constant conditions.

        Samples are due at whole multiples of the sample period since the start; the last one of a
        step may be at its end.

        Parameters
        ----------
        step : float, [s]
        inputs : sequence of float
            Those of the surface.

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
                f"communication step = {step:g} s; allowed is above 0; step by "
                f"{self.samples / rate:g} s"
            )
        until = self._due + exact
        count = math.floor(until + _ROUNDING)
        if count > self.samples:
            raise StepError(
                f"communication step = {step:g} s brings {count} samples at {rate:g} Hz; allowed "
                f"are up to {self.samples}, the frame's length; step by {self.samples / rate:g} s"
            )
        due, self._due, self._new = self._due, until - count, count
        given, reached = list(inputs), self._count + count
        try:
            if self._run is not None and self._run.inputs == given:
                self._go_on(self._run, step, count)
            else:
                self._run = None
                self._take(given, step, due, count)
        finally:
            self._count = reached  # time goes on after an error as well
        return True

    def _go_on(self, run: SteadyRun, step: float, n: int) -> None:
        """Advance by n samples under unchanged conditions."""
        self._angle = run.go_on(step)
        if n and not self._lost():
            self._show(run.samples(self._count, n))

    def _take(self, given: list[float], step: float, due: float, n: int) -> None:
        """Move on by a step [s] with n samples; the last one was `due` samples before."""
        still = _still(given)
        outside = self._surface.outside(given)
        wrong = tuple([name for name in outside if name not in _UNUSED[still]])
        self.outside = wrong
        omega = 0.0 if still else self._turn_rate(given, wrong)
        settled = self._slip.aim(given[_ALPHA : _KAPPA + 1], given[_SPEED])
        first = (1.0 - due) / self._options.rate
        if not still:
            self._held = None
            wrong = wrong or self._lag_outside(given, settled, first if n else step, step)
        if not settled:
            self._slip.go_on(step)
        start, self._omega = self._angle, omega
        self._angle = wrapped(start + omega * step)
        if wrong:
            self._valid, self._status = False, f"{OUT_OF_RANGE}: {', '.join(wrong)}"
        elif still:
            self._stand(still, n)
        elif n and not self._lost():
            self._measure(given, settled, start, first, n)
        steady = n and not wrong and not still and settled
        if steady and self._waveform is not None and self._asked == given:
            self._run = self._steady(given, {"count": self._count + n})

    def _steady(self, inputs: list[float], place: dict[str, Any]) -> SteadyRun:
        """Return samples from now on, or from where a state says, if nothing changes."""
        begin = {"angle": self._angle, "due": self._due, **place}
        return SteadyRun(self._found, inputs, self._omega, self._options.rate, **begin)

    def _found(self, angles: FloatArray, first: int) -> FloatArray:
        """Return the gages' signals at the last condition, with noise and faults."""
        if self._answer is None:  # a run begins with an answer
            return np.full((angles.size, self._surface.lateral.size), np.nan)
        return self._seen(self._surface.strain(self._answer, angles, self._waveform), first)

    def _stand(self, why: str, n: int) -> None:
        """Hold the strain of the angle at which the wheel stopped; the noise continues."""
        if self._last is None:
            self._valid, self._status = False, why
            return
        if self._held is None:
            self._held = self._surface.strain(self._last, np.array([self._angle]))
        if n and not self._lost():
            self._show(self._seen(np.repeat(self._held, n, axis=0), self._count))
            words = (why, self._status) if self._status != "ok" else (why,)
            self._status = ";".join(words)

    def _turn_rate(self, given: list[float], wrong: tuple[str, ...]) -> float:
        """Return Omega = v (1 + kappa) / R_e; out of range R_e stays, without speed the rest."""
        load, speed, pressure = given[_LOAD], given[_SPEED], given[_PRESSURE]
        known = not {"Fz", "speed", "pressure"} & set(wrong)
        if known and self._rolls != (load, speed, pressure):
            self._rolls = load, speed, pressure
            self._radius = self._surface.rolling_radius(load, speed, pressure)
        found = speed * (1.0 + given[_KAPPA]) / self._radius
        return found if math.isfinite(found) else self._omega

    def _lag_outside(self, given: list[float], settled: bool, *times: float) -> tuple[str, ...]:
        """Return which of the relaxed inputs are still out of range at the ends of a step."""
        names: tuple[str, ...] = ()
        if settled:
            return names
        for time in times:
            felt = self._felt(given, self._slip.at(time))
            names += tuple(name for name in self._surface.outside(felt) if name not in names)
        return names

    @staticmethod
    def _felt(given: list[float], slip: list[float]) -> list[float]:
        """Return a condition with the slip that is felt."""
        return [*given[:_ALPHA], *slip, *given[_KAPPA + 1 :]]

    def _measure(
        self, given: list[float], settled: bool, start: float, first: float, n: int
    ) -> None:
        """Fill the frame with n samples, the first at a time [s] from the start angle on."""
        if settled or n == 1:
            felt = given if settled else self._felt(given, self._slip.at(first))
            answers, waveform = self._answers(felt)
        if n == 1:
            strain = self._surface.strain(answers, [start + self._omega * first], waveform)
        else:
            times: FloatArray = first + np.arange(n) / self._options.rate
            if not settled:
                table = np.repeat(np.array(given)[None], n, axis=0)
                table[:, _LAGGED] = self._slip.course(times)
                answers, waveform = self._surface.answers(table), None
            strain = self._surface.strain(answers, start + self._omega * times, waveform)
        self._show(self._seen(strain, self._count))
        self._force = self._surface.forces_of(answers)[-1].tolist()
        self._last = answers[-1:]

    def _lost(self) -> bool:
        """Return whether the frame that begins with the next sample is lost."""
        faults = self._options.faults
        if not (faults.dropped > 0.0 and self._count / self._options.rate >= faults.start):
            return False
        lost = chance(self._options.seed, self._count) < faults.dropped
        if lost:
            self._valid, self._status = False, DROPPED
        return lost

    def _seen(self, strain: FloatArray, first: int) -> FloatArray:
        """Return strain with noise and faults; the samples are numbered from `first` on."""
        options = self._options
        n, gages = strain.shape
        if options.noise > 0.0:
            strain = strain + options.noise * noise(options.seed, first, n, gages)
        if options.faults.none:
            return strain
        return options.faults.of(strain, (first + np.arange(n)) / options.rate)

    def _show(self, seen: FloatArray) -> None:
        """Put the next samples into the frame."""
        n = len(seen)
        self._frame[:n] = seen
        if n < self.samples:
            self._frame[n:] = seen[-1]
        words = self._options.faults.words((self._count + n - 1) / self._options.rate)
        self._valid, self._status = True, ";".join(words) or "ok"

    def _answers(self, condition: list[float]) -> tuple[FloatArray, FloatArray | None]:
        """Ask the surface; of a condition that stays, also the waveform, both once."""
        if self._answer is None or self._asked != condition:
            self._asked, self._waveform = condition, None
            self._answer = self._surface.answers(np.array([condition]))
        elif self._waveform is None:
            self._waveform = self._surface.waveform(self._answer)
        return self._answer, self._waveform

    def fault(self, cause: str) -> None:
        """Hold the last values as invalid, after an error."""
        self._run = None
        self._valid, self._status = False, status_entry(FAULT, cause)

    def outputs(self) -> tuple[list[float], tuple[Any, ...]]:
        """Return the values of the Real outputs and of the others, in the table's order."""
        slip = self._slip.slip or [math.nan] * 2
        reals = [
            *self._frame.ravel().tolist(),
            self._omega,
            self._angle,
            *slip,
            *self._force,
            self._radius,
        ]
        return reals, (self._new, self._valid, self._omega != 0.0, self._status)

    def state(self) -> dict[str, Any]:
        """Return everything that is remembered, as JSON knows it."""
        return {
            "slip": None if self._slip.slip is None else [x.hex() for x in self._slip.slip],
            "reals": [x.hex() for x in (self._angle, self._omega, self._radius, self._due)],
            "frame": [x.hex() for x in self._frame.ravel().tolist()],
            "force": [x.hex() for x in self._force],
            "asked": None if self._asked is None else [x.hex() for x in self._asked],
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
        self._slip.slip = None if slip is None else [float.fromhex(x) for x in slip]
        self._angle, self._omega, self._radius, self._due = map(float.fromhex, state["reals"])
        frame = [float.fromhex(x) for x in state["frame"]]
        self._frame = np.array(frame).reshape(self._frame.shape)
        self._force = [float.fromhex(x) for x in state["force"]]
        self._count, self._new = state["counts"]
        self._valid, self._status = state["valid"], state["status"]
        self._rolls = self._waveform = self._asked = self._run = None
        self._last, self._held = _row(state["last"]), _row(state["held"])
        if state["asked"] is not None:
            self._asked = [float.fromhex(x) for x in state["asked"]]
            self._answer = self._surface.answers(np.array([self._asked]))
        run = state["run"]
        if run is not None and self._answer is not None and self._asked is not None:
            self._waveform = self._surface.waveform(self._answer)
            place = {name: float.fromhex(run[name]) for name in ("angle", "due", "time")}
            self._run = self._steady(self._asked, {**place, "count": run["count"]})


def _row(values: list[str] | None) -> FloatArray | None:
    return None if values is None else np.array([[float.fromhex(x) for x in values]])


def _still(given: list[float]) -> str:
    """Return why the wheel does not turn; empty if it turns."""
    speed, kappa = given[_SPEED], given[_KAPPA]
    if speed == 0.0:
        return STANDSTILL
    return LOCKED if math.isfinite(speed) and speed > 0.0 and abs(kappa + 1.0) < LOCK else ""
