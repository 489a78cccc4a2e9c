"""``StrainTire.fmu``: strain of one wheel to load, slip angle, slip ratio and lateral force.

All work is in `tirelib.fmu.wheel`, which the build copies into the FMU beside this file, under a
name of its own, so that FMUs of several versions can live in one process.
"""

import ctypes
import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from tirelib.errors import FormatError, ParameterError
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.variables import Variable, inputs, outputs, parameters
from tirelib.fmu.wheel import Wheel, load_wheel
from tirelib.stream.estimator import RATES

KINDS = {"Real": Real, "Integer": Integer, "Boolean": Boolean, "String": String}


def _guarded(method: Callable[..., Any]) -> Callable[..., Any]:
    """Let an error reach the importer as an FMI error, with its cause in the log.

    On every exception pythonfmu 0.7.0 gives up a reference to the class, to the instance and to its
    log, and goes on using them: a reset or a free that followed would touch freed memory. Each gets
    one more reference here, so that the importer lives.
    """

    @functools.wraps(method)
    def call(self: Any, *args: Any) -> Any:
        try:
            return method(self, *args)
        except Exception as error:
            self.log(f"{type(error).__name__}: {error}", Fmi2Status.error)
            for kept in (type(self), self, self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))
            raise

    return call


class StrainTire(Fmi2Slave):
    """One wheel. Reals live in one list by value reference, so that a frame is one slice of it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._folder = Path(self.resources)
        settings = json.loads((self._folder / "settings.json").read_text(encoding="utf-8"))
        self._samples = int(settings["samples_per_step"])
        lateral = read_calibration(self._folder / "calibration.toml").lateral
        self.guid = settings["guid"]
        self.version = settings["version"]
        self.description = "Load, slip angle, slip ratio and lateral force from innerliner strain"
        self.default_experiment = DefaultExperiment(
            start_time=0.0, stop_time=1.0, step_size=self._samples / settings["sample_rate"]
        )
        groups = (
            parameters(settings["sample_rate"], RATES),
            inputs(lateral, self._samples),
            outputs(lateral),
        )
        table = [variable for group in groups for variable in group]
        self._real: list[Any] = [v.start if v.kind == "Real" else None for v in table]
        self._other: dict[str, Any] = {v.name: v.start for v in table if v.kind != "Real"}
        self._reference = {v.name: number for number, v in enumerate(table)}
        for variable in table:
            self.register_variable(self._scalar(variable))
        first = len(groups[0])
        self._fixed = frozenset(range(first))
        self._inputs = frozenset(range(first, first + len(groups[1])))
        self._settable = self._inputs | self._fixed
        strains = self._samples * len(lateral)
        self._frame = slice(first, first + strains)
        self._conditions = slice(first + strains, first + strains + 4)
        reals = [self._reference[v.name] for v in groups[2] if v.kind == "Real"]
        self._results = slice(reals[0], reals[-1] + 1)
        self._age = reals[-1]
        self._names = [v.name for v in groups[2] if v.kind != "Real"]
        self._wheel: Wheel | None = None
        self._last_error = ""

    def _scalar(self, variable: Variable) -> Any:
        """Return the variable as pythonfmu declares it."""
        name, fixed = variable.name, variable.causality == "parameter"
        options: dict[str, Any] = {
            "causality": Fmi2Causality[variable.causality],
            "variability": Fmi2Variability.fixed if fixed else Fmi2Variability.discrete,
            "description": variable.description,
        }
        if variable.kind != "Real":
            options["getter"] = lambda: self._other[name]
            options["setter"] = lambda value: self._set_other(variable, value)
        else:
            options["getter"] = lambda: self._real[self._reference[name]]
        return KINDS[variable.kind](name, **options)

    def _set_other(self, variable: Variable, value: Any) -> None:
        self._check({self._reference[variable.name]})
        self._other[variable.name] = value

    def _check(self, references: Any) -> None:
        """Refuse to set an output, or a parameter that is fixed by now."""
        if not self._settable.issuperset(references):
            names = [self.vars[r].name for r in references if r not in self._settable]
            raise ParameterError(
                f"{', '.join(names)}: cannot be set now; inputs may be set at any time, parameters "
                "before initialisation, outputs never"
            )

    get_integer = _guarded(Fmi2Slave.get_integer)
    get_boolean = _guarded(Fmi2Slave.get_boolean)
    get_string = _guarded(Fmi2Slave.get_string)
    set_integer = _guarded(Fmi2Slave.set_integer)
    set_boolean = _guarded(Fmi2Slave.set_boolean)
    set_string = _guarded(Fmi2Slave.set_string)

    @_guarded
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Reals by value reference."""
        if not self._settable.issuperset(vrs):
            self._check(vrs)
        real = self._real
        for reference, value in zip(vrs, values, strict=True):
            if real[reference] is None:
                raise TypeError(f"{self.vars[reference].name} is not of type Real")
            real[reference] = value

    @_guarded
    def get_real(self, vrs: list[int]) -> list[float]:
        """Return Reals by value reference."""
        real = self._real
        values = [real[reference] for reference in vrs]
        if None in values:
            raise TypeError(f"{self.vars[vrs[values.index(None)]].name} is not of type Real")
        return values

    @_guarded
    def exit_initialization_mode(self) -> None:
        """Take up the parameters."""
        self._start()

    def _start(self) -> Wheel:
        self._wheel = load_wheel(
            self._folder / "calibration.toml",
            str(self._other["calibration"]),
            self._real[self._reference["sample_rate"]],
            self._samples,
            str(self._other["axes"]),
        )
        self._settable = self._inputs
        return self._wheel

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Push the frame; an error is logged, the last values are held and are not valid."""
        wheel, real = self._wheel, self._real
        if wheel is None:
            self._complain("the FMU is not initialised; call exitInitializationMode first")
            return False
        try:
            wheel.samples_in(step_size)
        except ParameterError as error:
            self._complain(str(error))
            return False
        try:
            changed = wheel.step(
                real[self._frame], step_size, self._other["frame_valid"], *real[self._conditions]
            )
        except Exception as error:  # nothing may reach the importer
            self._complain(f"{type(error).__name__}: {error}")
            wheel.fault()
            changed = True
        else:
            self._last_error = ""
        if changed:
            self._publish(wheel)
        else:
            real[self._age] = wheel.age
        return True

    def _publish(self, wheel: Wheel) -> None:
        values, others = wheel.outputs()
        self._real[self._results] = values
        self._other.update(zip(self._names, others, strict=True))

    def _complain(self, message: str) -> None:
        """Log an error once, until another comes."""
        if message != self._last_error:
            self.log(message, Fmi2Status.error)
        self._last_error = message

    @_guarded
    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "real": [None if value is None else float(value).hex() for value in self._real],
            "other": dict(self._other),
            "wheel": None if self._wheel is None else self._wheel.state(),
        }

    @_guarded
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if "real" not in state:
            raise FormatError("the bytes are no state of this FMU; save it anew")
        real = [None if value is None else float.fromhex(value) for value in state["real"]]
        self._real[:] = real
        self._other.update(state["other"])
        self._wheel, self._settable = None, self._inputs | self._fixed
        if state["wheel"] is not None:
            self._start().restore(state["wheel"])

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            content = json.loads(state)
        except ValueError:
            return {}
        return content if isinstance(content, dict) else {}
