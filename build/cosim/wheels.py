"""Four wheels of a vehicle: true wheel states in, what four strain tires say out.

Each wheel is one ``VirtualTire.fmu`` (state to strain frames) and one ``StrainTire.fmu`` (frames to
estimates), stepped by FMPy. The vehicle is anything that can fill a `WheelStates`::

    with FourWheels(virtual, strain) as wheels:
        wheels.start(truth)                      # state at time zero; the gages begin to turn
        for k in range(n):
            told = wheels.step(k * h, h, truth)  # truth holds over (t, t + h]; told is at t + h
"""

import math
from collections.abc import Sequence
from ctypes import c_double, c_uint32
from dataclasses import dataclass, field, fields
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.core.held import HELD
from tirelib.estimators.estimate import QUANTITIES
from tirelib.fmu.run import LoadedFmu, runs_with
from tirelib.fmu.virtual.coordinates import FRICTION, INPUTS
from tirelib.fmu.virtual.table import START

if TYPE_CHECKING:
    from cosim.water import WaterTable

WHEELS = ("FL", "FR", "RL", "RR")
"""Order of the wheels in every array: front left, front right, rear left, rear right."""
TREAD_DEPTH = 0.008
"""Tread depth of the virtual tire, which is new [m]."""
PRESSURE = 2.3e5
"""Inflation pressure where a vehicle has none [Pa]."""
OWN_FRICTION = START[FRICTION]
"""Coefficient of friction of the virtual tire's own road: a vehicle's factor of 1."""
_SHOWN = (
    "omega",
    "wheel_angle",
    "alpha_relaxed",
    "kappa_relaxed",
    "Fx_rig",
    "Fy_rig",
    "rolling_radius",
)
_REALS = (*QUANTITIES, *(f"{q}_std" for q in QUANTITIES), "turn_rate", "contact_time")
_VALID = ("valid", *(f"{q}_valid" for q in QUANTITIES))


def _nan() -> FloatArray:
    return np.full(len(WHEELS), np.nan)


@dataclass(frozen=True, slots=True)
class WheelStates:
    """True states of the four wheels, arrays of shape (4,) in the order of `WHEELS`; SI, ISO 8855.

    Attributes
    ----------
    load : array, [N]
        Vertical load Fz, positive.
    alpha : array, [rad]
        Slip angle: atan(v_y / v_x) in the wheel's axes, y to the left; positive gives negative Fy.
    kappa : array, [1]
        (Omega R_e - v) / v with v the travel speed of the contact point (not its component in the
        wheel's plane: free rolling at a slip angle has cos(alpha) - 1); braking < 0.
    camber : array, [rad]
        Top of the wheel to the right: positive, on both sides of the vehicle.
    speed : array, [m/s]
        Travel speed v of each contact point.
    pressure : array, [Pa]
        Inflation pressure (gauge).
    omega : array, [rad/s]
        Turn rate that a wheel speed sensor measures, by which the strain tires follow the wheel
        angle within a turn. NaN: there is none.
    friction : array, [1]
        Coefficient of friction under each wheel, 0.3 to 1.1.
    told_speed : array, [m/s]
        Speed that the strain tires are told; NaN: the true one.
    wedge : array, [Pa]
        Pressure of a wedge of water ahead of each contact; needs a `cosim.water.WaterTable`.
    """

    load: FloatArray
    alpha: FloatArray
    kappa: FloatArray
    camber: FloatArray
    speed: FloatArray
    pressure: FloatArray = field(default_factory=lambda: np.full(len(WHEELS), PRESSURE))
    omega: FloatArray = field(default_factory=_nan)
    friction: FloatArray = field(default_factory=lambda: np.full(len(WHEELS), OWN_FRICTION))
    told_speed: FloatArray = field(default_factory=_nan)
    wedge: FloatArray = field(default_factory=lambda: np.zeros(len(WHEELS)))

    def rows(self) -> FloatArray:
        """Return the inputs of the virtual tires, shape (4, 7): `INPUTS`, then the friction."""
        return np.stack(
            (
                self.load,
                self.alpha,
                self.kappa,
                self.camber,
                self.speed,
                self.pressure,
                self.friction,
            ),
            axis=1,
        )


@dataclass(frozen=True, slots=True)
class Estimates:
    """What the strain tires say at the end of a step, arrays of shape (4,); SI, ISO 8855.

    Values are those of the last completed turn; NaN before the first.

    Attributes
    ----------
    Fz, alpha, kappa, Fy : array, [N], [rad], [1], [N]
    Fz_std, alpha_std, kappa_std, Fy_std : array
    turn_rate : array, [rad/s]
        Mean over the turn before the contact, from the strain alone.
    contact_time : array, [s]
        Middle of the contact that the estimate is of, on the vehicle's clock.
    valid, Fz_valid, alpha_valid, kappa_valid, Fy_valid : bool array
        Whether the estimate may be used now.
    turn : int array
        Contacts so far: it counts up when an estimate is new.
    flags : int array
        `tirelib.core.flags.TurnFlag` bits.
    tire_omega, tire_angle : array, [rad/s], [rad]
        Turn rate and angle of the gages of the virtual tire (0: over the road).
    tire_alpha, tire_kappa : array, [rad], [1]
        Slip that the virtual tire feels, after relaxation.
    tire_fx, tire_fy : array, [N]
        Forces of the tire whose strain is estimated from: the truth for `Fy`.
    tire_radius : array, [m]
        Its effective rolling radius.
    tire_valid : bool array
        False: the state is outside the virtual tire's range, no frame came.
    """

    Fz: FloatArray = field(default_factory=_nan)
    alpha: FloatArray = field(default_factory=_nan)
    kappa: FloatArray = field(default_factory=_nan)
    Fy: FloatArray = field(default_factory=_nan)
    Fz_std: FloatArray = field(default_factory=_nan)
    alpha_std: FloatArray = field(default_factory=_nan)
    kappa_std: FloatArray = field(default_factory=_nan)
    Fy_std: FloatArray = field(default_factory=_nan)
    turn_rate: FloatArray = field(default_factory=_nan)
    contact_time: FloatArray = field(default_factory=_nan)
    valid: BoolArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.bool_))
    Fz_valid: BoolArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.bool_))
    alpha_valid: BoolArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.bool_))
    kappa_valid: BoolArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.bool_))
    Fy_valid: BoolArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.bool_))
    turn: IntArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.int64))
    flags: IntArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.int64))
    tire_omega: FloatArray = field(default_factory=_nan)
    tire_angle: FloatArray = field(default_factory=_nan)
    tire_alpha: FloatArray = field(default_factory=_nan)
    tire_kappa: FloatArray = field(default_factory=_nan)
    tire_fx: FloatArray = field(default_factory=_nan)
    tire_fy: FloatArray = field(default_factory=_nan)
    tire_radius: FloatArray = field(default_factory=_nan)
    tire_valid: BoolArray = field(default_factory=lambda: np.zeros(len(WHEELS), dtype=np.bool_))


NAMES = tuple(entry.name for entry in fields(Estimates))
"""Names of everything that the wheels say."""


class VirtualTire:
    """One instance of ``VirtualTire.fmu`` in FMPy; close it when done.

    Parameters
    ----------
    path : path
    name : str
        Name of the instance.
    """

    def __init__(self, path: Path, name: str) -> None:
        description = read_model_description(str(path))
        self._at = {v.name: v.valueReference for v in description.modelVariables}
        strains = [reference for name, reference in self._at.items() if name[:7] == "strain_"]
        wanted = [*strains, *(self._at[name] for name in _SHOWN)]
        self._n = len(strains)
        self._folder = extract(str(path), include=runs_with)
        self.slave: Any = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self._folder,
            instanceName=name,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        self.slave.instantiate()
        self._wanted = (c_uint32 * len(wanted))(*wanted)
        self._values = (c_double * len(wanted))()
        self.slippery = FRICTION in self._at
        names = (*INPUTS, FRICTION) if self.slippery else INPUTS
        self._inputs = (c_uint32 * len(names))(*(self._at[name] for name in names))
        self._given = (c_double * len(names))()

    def close(self) -> None:
        """Free the instance and the files that were unpacked."""
        self.slave.freeInstance()
        rmtree(self._folder, ignore_errors=True)

    def start(self, state: FloatArray, parameters: dict[str, float]) -> None:
        """Initialise with the first state, shape (7,), as `WheelStates.rows` has it."""
        slave = self.slave
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        for name, value in parameters.items():
            setter = slave.setInteger if isinstance(value, int) else slave.setReal
            setter([self._at[name]], [value])
        self._put(state)
        slave.enterInitializationMode()
        slave.exitInitializationMode()

    def _put(self, state: FloatArray) -> None:
        if not self.slippery and state[-1] != OWN_FRICTION:
            raise ParameterError(
                f"{self.slave.instanceName}: friction = {state[-1]:g}, but this virtual tire knows "
                f"no other than its own; allowed is {OWN_FRICTION:g}; make it with "
                "`tirelib fmu virtual --friction`"
            )
        self._given[:] = state[: len(self._given)].tolist()
        self.slave.fmi2SetReal(self.slave.component, self._inputs, len(self._given), self._given)

    def step(self, time: float, step: float, state: FloatArray) -> tuple[FloatArray, list[float]]:
        """Step with a state and return the frame, shape (samples, g), and `_SHOWN`."""
        self._put(state)
        self.slave.doStep(time, step)
        self.slave.fmi2GetReal(self.slave.component, self._wanted, len(self._wanted), self._values)
        found = np.array(self._values)
        return found[: self._n].reshape(-1, 5), found[self._n :].tolist()

    def frame(self) -> tuple[int, bool]:
        """Return how many samples of the frame are new, and whether it may be used."""
        n = self.slave.getInteger([self._at["samples"]])[0]
        return n, bool(self.slave.getBoolean([self._at["frame_valid"]])[0])


class FourWheels:
    """Four virtual tires and four strain tires; use it in a ``with`` block.

    Parameters
    ----------
    virtual, strain : path
        The FMUs, with the same samples per step and sample rate; one file serves all wheels.
    rate : float, [Hz]
        Sample rate of the gages.
    noise : float
        Standard deviation of the gages' noise, as strain.
    seed : int
        Seed of the noise; the wheels get seed .. seed + 3.
    start_angles : sequence of 4 floats, [rad]
        Where the gages of each wheel stand at time zero: contacts of the wheels are not in step.
    parameters : dict, optional
        Further parameters of all virtual tires, for example ``relaxation_length``.
    water : WaterTable, optional
        What a wedge of water changes.
    speed_sensors : bool
        Whether the strain tires are told the turn rates of the virtual tires where the states have
        none, as by a wheel speed sensor.
    tread_depth : float, [m]
        What the strain tires are told of the tread, as measured before the drive; NaN: nothing.
    tells_friction : bool
        Whether the strain tires are told the friction under each wheel.
    """

    def __init__(
        self,
        virtual: Path,
        strain: Path,
        *,
        rate: float = 1e4,
        noise: float = 4e-6,
        seed: int = 1,
        start_angles: Sequence[float] = (-3.1, -1.6, 0.6, 2.2),
        parameters: dict[str, float] | None = None,
        water: "WaterTable | None" = None,
        speed_sensors: bool = False,
        tread_depth: float = TREAD_DEPTH,
        tells_friction: bool = False,
    ) -> None:
        self.rate, self._water, self._speed_sensors = rate, water, speed_sensors
        self._tread_depth, self._tells_friction = tread_depth, tells_friction
        self._options = [
            {
                "sample_rate": rate,
                "noise_std": noise,
                "seed": seed + at,
                "start_angle": angle,
                **(parameters or {}),
            }
            for at, angle in enumerate(start_angles)
        ]
        self.tires = [VirtualTire(virtual, f"tire_{name}") for name in WHEELS]
        self.estimators = [LoadedFmu(strain, name=f"wheel_{name}") for name in WHEELS]
        self.samples = self.estimators[0].samples

    def __enter__(self) -> "FourWheels":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free all instances."""
        for tire, estimator in zip(self.tires, self.estimators, strict=True):
            tire.close()
            estimator.close()

    def start(self, truth: WheelStates) -> None:
        """Begin at time zero with settled slip; whatever was before is forgotten."""
        for tire, options, state in zip(self.tires, self._options, truth.rows(), strict=True):
            tire.start(state, options)
        for estimator in self.estimators:
            estimator.start(self.rate)
        self._fresh = [True] * len(WHEELS)
        self.told = Estimates()

    def step(self, time: float, step: float, truth: WheelStates) -> Estimates:
        """Go on from `time` [s] by `step` [s] with states that hold over it.

        Raises
        ------
        ParameterError
            If the step is no whole number of samples, or longer than a frame.
        """
        n = round(step * self.rate)
        if not 1 <= n <= self.samples or abs(n - step * self.rate) > 1e-6:
            raise ParameterError(
                f"step = {step} s is {step * self.rate:g} samples; allowed are 1 .. {self.samples} "
                f"whole samples at {self.rate:g} Hz; step by {self.samples / self.rate:g} s"
            )
        parts: dict[str, Any] = {
            entry.name: getattr(self.told, entry.name).copy() for entry in fields(Estimates)
        }
        for wheel, state in enumerate(truth.rows()):
            frame, shown = self.tires[wheel].step(time, step, state)
            new, good = self.tires[wheel].frame()
            if truth.wedge[wheel]:
                frame = frame + self._wet(state[0], float(truth.wedge[wheel]), shown, len(frame))
            for name, value in zip(_TIRE, shown, strict=True):
                parts[name][wheel] = value
            parts["tire_valid"][wheel] = good
            measured = parts["tire_omega"][wheel] if self._speed_sensors else math.nan
            told = told_conditions(
                truth,
                wheel,
                measured,
                self._tread_depth,
                truth.friction[wheel] if self._tells_friction else math.nan,
            )
            self._estimate(wheel, frame[:new], good, told, parts)
        self.told = Estimates(**parts)
        return self.told

    def _wet(self, load: float, wedge: float, shown: list[float], n: int) -> FloatArray:
        """Return what a wedge of water changes in a whole frame of n samples."""
        if self._water is None:
            raise ParameterError(
                f"wedge = {wedge:g} Pa, but these wheels have no table of what water does; allowed "
                "is 0; give one by cosim.water.water_table"
            )
        omega, angle = shown[:2]
        return self._water.at(
            load, wedge, angle - omega * np.arange(n - 1.0, -1.0, -1.0) / self.rate
        )

    def _estimate(
        self, wheel: int, frame: FloatArray, good: bool, known: FloatArray, parts: dict[str, Any]
    ) -> None:
        """Give a frame and the conditions of `HELD` to a strain tire, and note what it says."""
        fmu = self.estimators[wheel]
        at, slave = fmu.references, fmu.slave
        if good != self._fresh[wheel]:
            slave.setBoolean([at["frame_valid"]], [good])
            self._fresh[wheel] = good
        fmu.step(frame.T, known)
        turn, flags = slave.getInteger([at["turn"], at["flags"]])
        valid = slave.getBoolean([at[name] for name in _VALID])
        for name, value in zip(_VALID, valid, strict=True):
            parts[name][wheel] = bool(value)
        if turn != parts["turn"][wheel]:
            for name, value in zip(_REALS, fmu.reals(*_REALS), strict=True):
                parts[name][wheel] = value
            parts["contact_time"][wheel] += 1.0 / fmu.rate  # its first sample is not at zero
        parts["turn"][wheel], parts["flags"][wheel] = turn, flags


def told_conditions(
    truth: WheelStates,
    wheel: int,
    measured: float = math.nan,
    tread_depth: float = math.nan,
    friction: float = math.nan,
) -> FloatArray:
    """Return what a strain tire is told with the strain, in the order of `HELD`; NaN: nothing.

    `measured` is the turn rate [rad/s] where the states have none.
    """
    speed, omega = truth.told_speed[wheel], truth.omega[wheel]
    known = {
        "speed": speed if np.isfinite(speed) else truth.speed[wheel],
        "pressure": truth.pressure[wheel],
        "camber": truth.camber[wheel],
        "omega": omega if np.isfinite(omega) else measured,
        "tread_depth": tread_depth,
        "friction": friction,
    }
    return np.array([known.get(name, np.nan) for name in HELD])


_TIRE = (
    "tire_omega",
    "tire_angle",
    "tire_alpha",
    "tire_kappa",
    "tire_fx",
    "tire_fy",
    "tire_radius",
)
