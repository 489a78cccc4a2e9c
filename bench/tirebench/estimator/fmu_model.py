"""The estimator as an FMU file, stepped through FMPy (FMI 2.0 co-simulation).

Every array that crosses the border is made once. Inputs are ``strain_1 .. strain_5``, or
``strain_1_1 .. strain_k_5`` for k samples a step (oldest first); what else the FMU has is taken
from its description, so an FMU without camber is as good as one with it.
"""

import ctypes
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2Fatal,
    fmi2ValueReference,
)

from tirebench.errors import FmuError
from tirebench.estimator.chain import Outputs
from tirebench.estimator.fmu_archive import FmuArchive
from tirebench.estimator.remark_units import in_options_units
from tirebench.wire.conditions import Condition
from tirebench.wire.frames import GAGES, MOST_GAGES
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import FormatError
from tirelib.core.held import HELD

if TYPE_CHECKING:
    from tirelib.estimators.calibration import Calibration

RATE = "sample_rate"
"""Name of the parameter that holds the sample rate, [Hz]."""
LONGEST_CAUSE = 400
"""Characters of a cause that a message quotes."""
REQUIRED = ("Fz", "alpha", "kappa", "Fy", "turn", "age", "valid", "flags")
_CTYPES: dict[str, Any] = {
    "Real": ctypes.c_double,
    "Integer": ctypes.c_int,
    "Boolean": ctypes.c_int,
    "Enumeration": ctypes.c_int,
}
_STRAIN = re.compile(r"strain_(?:(\d+)_)?(\d+)")


class _Ports:
    """Some variables of one type, with the arrays that FMI wants."""

    def __init__(self, slave: FMU2Slave, variables: list[Any], kind: str) -> None:
        count = len(variables)
        self.names = [variable.name for variable in variables]
        self._count = count
        self._references = (fmi2ValueReference * count)(*(v.valueReference for v in variables))
        self._values = (_CTYPES[kind] * count)()
        self.values = np.ctypeslib.as_array(self._values)
        fmi = "Integer" if kind == "Enumeration" else kind
        self._get: Callable[..., int] = getattr(slave, f"fmi2Get{fmi}")
        self._set: Callable[..., int] = getattr(slave, f"fmi2Set{fmi}")
        self._slave = slave

    def get(self) -> Any:
        self._get(self._slave.component, self._references, self._count, self._values)
        return self.values

    def set(self) -> None:
        self._set(self._slave.component, self._references, self._count, self._values)


class FmuFile:
    """An FMU that was unpacked and found to be a strain estimator; nothing of it runs yet.

    A context manager that removes the unpacked files. It can be sent to another process, which then
    uses these files and leaves them.

    Parameters
    ----------
    archive : FmuArchive
        Checked by `tirebench.estimator.fmu_archive.read_fmu`.

    Attributes
    ----------
    path : Path
    folder : str
    samples, gages : int
        Samples a step (k), and gages of each.
    name : str

    Raises
    ------
    FmuError
        If the FMU cannot be unpacked or is no strain estimator.
    """

    def __init__(self, archive: FmuArchive) -> None:
        self.path = archive.path
        self._unpacked = archive.unpack()
        self.folder = self._unpacked.name
        try:
            description = self.description()
            self.samples, self.gages = _frame(self.path, description)
            self.name = str(description.modelName)
        except FmuError:
            self.close()
            raise

    def description(self) -> Any:
        """Return the FMU's model description.

        Raises
        ------
        FmuError
            If it cannot be read.
        """
        try:
            return read_model_description(self.folder)
        except Exception as error:  # FMPy raises bare Exception and whatever lxml does
            raise _fmu_error(self.path, "cannot be loaded", error, []) from None

    @property
    def calibration(self) -> "Calibration | None":
        """The calibration inside, where the FMU has one that can be read."""
        from tirelib.estimators.calibration_file import read_calibration  # takes a while

        path = Path(self.folder) / "resources" / "calibration.toml"
        try:
            return read_calibration(path) if path.is_file() else None
        except FormatError:
            return None

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_unpacked": None}

    def close(self) -> None:
        """Remove the unpacked files; calling twice does no harm."""
        if self._unpacked is not None:
            self._unpacked.cleanup()

    def __enter__(self) -> "FmuFile":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def strain_names(samples: int, gages: int) -> list[str]:
    """Return the names of the strain inputs in their order, oldest sample first."""
    if samples == 1:
        return [f"strain_{g}" for g in range(1, gages + 1)]
    return [f"strain_{i}_{g}" for i in range(1, samples + 1) for g in range(1, gages + 1)]


def _frame(path: Path, description: Any) -> tuple[int, int]:
    """Return samples a step and gages; refuse an FMU that is no strain estimator."""
    if description.coSimulation is None:
        raise FmuError(
            f"{path}: not an FMU for co-simulation; FMI 2.0 co-simulation is needed; build it with "
            "`tirelib fmu build`"
        )
    if not description.fmiVersion.startswith("2"):
        raise FmuError(
            f"{path}: an FMU of FMI {description.fmiVersion}; FMI 2.0 is needed; build it with "
            "`tirelib fmu build`, without --fmi 3"
        )
    names = {variable.name for variable in description.modelVariables}
    found = [m for name in names if (m := _STRAIN.fullmatch(name))]
    gages = max((int(m[2]) for m in found), default=GAGES)
    samples = max(1, len(found) // gages) if 1 <= gages <= MOST_GAGES else 1
    wanted = set(strain_names(samples, min(gages, MOST_GAGES)))
    missing = sorted(wanted - names)
    missing += [name for name in REQUIRED if name not in names]
    if not description.coSimulation.canHandleVariableCommunicationStepSize:
        missing.append("variable communication steps")
    if missing or len(found) != len(wanted):
        raise FmuError(
            f"{path}: the variables {', '.join(missing[:8]) or 'some strain inputs'} are missing; "
            "all variables of a StrainTire.fmu are needed; build it with `tirelib fmu build`"
        )
    return samples, gages


class FmuModel:
    """One instance of the estimator; a context manager that frees it.

    Parameters
    ----------
    file : FmuFile

    Attributes
    ----------
    samples : int
        k, samples a step.

    Raises
    ------
    FmuError
        If the FMU cannot be loaded.
    """

    def __init__(self, file: FmuFile) -> None:
        self._path = file.path
        self._file = file  # its folder lives as long
        self._messages: list[str] = []
        self._slave: Any = None
        self._description = file.description()
        self._variables = {v.name: v for v in self._description.modelVariables}
        self.samples = file.samples
        try:
            self._instantiate()
        except FmuError:
            self.close()
            raise
        except Exception as error:  # FMPy raises bare Exception and whatever ctypes does
            self.close()
            raise self._error("cannot be loaded", error) from None

    def _instantiate(self) -> None:
        slave = FMU2Slave(
            guid=self._description.guid,
            unzipDirectory=self._file.folder,
            modelIdentifier=self._description.coSimulation.modelIdentifier,
            instanceName="wheel",
        )
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        self._slave = slave
        self._ready = False
        strain = strain_names(self.samples, self._file.gages)
        present = [name for name in HELD if name in self._variables]
        self._held = [HELD.index(name) for name in present]
        self._inputs = self._ports([*strain, *present])
        self._strain = self._inputs.values[: len(strain)]
        self._conditions = self._inputs.values[len(strain) :]
        self._given: Condition | None = None  # what stands there
        self._turn = self._ports(["turn"])
        texts = [v for v in self._variables.values() if v.type == "String"]
        self._texts = [v for v in texts if v.causality == "output"]
        self._valid = self._ports(["frame_valid"]) if "frame_valid" in self._variables else None
        outputs = [v for v in self._variables.values() if v.causality == "output"]
        kinds = {v.type for v in outputs if v.type in _CTYPES}
        self._outputs = [
            _Ports(slave, [v for v in outputs if v.type == kind], kind) for kind in sorted(kinds)
        ]

    def _ports(self, names: list[str]) -> _Ports:
        variables = [self._variables[name] for name in names]
        kinds = {variable.type for variable in variables}
        if len(kinds) != 1 or not kinds <= set(_CTYPES):
            raise FmuError(
                f"{self._path}: {names[0]} .. {names[-1]} are of type {', '.join(sorted(kinds))}; "
                "one numeric type is needed; build it with `tirelib fmu build`"
            )
        return _Ports(self._slave, variables, kinds.pop())

    def start(self, period: float) -> None:
        """Start again with this sample period [s]; the former state is dropped."""
        slave = self._slave
        try:
            if self._ready:
                slave.terminate()
                slave.reset()
            if RATE in self._variables:
                rate = self._ports([RATE])
                rate.values[0] = round(1.0 / period, 6)
                rate.set()
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
            if self._valid is not None:
                self._valid.values[0] = 1
                self._valid.set()
            slave.exitInitializationMode()
            self._ready = True
            self._period, self._count, self._frame_valid = period, 0, True
            self._seen = float(self._turn.get()[0])
        except FMICallException as error:
            raise self._error("does not start", error) from None

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> Outputs | None:
        """Take one step; return all outputs, SI, and texts when it ended a turn.

        Parameters
        ----------
        strain : array, shape (n, n_gages), n up to k
            Oldest first, NaN where unknown.
        conditions : Condition
        valid : bool
            False when no sample of the step arrived.

        Raises
        ------
        FmuError
            With the message of the FMU.
        """
        try:
            n = len(strain)
            self._strain[: strain.size] = strain.reshape(-1)
            if conditions is not self._given:
                self._conditions[:] = [conditions[index] for index in self._held]
                self._given = conditions
            self._inputs.set()
            if self._valid is not None and valid != self._frame_valid:
                self._valid.values[0] = self._frame_valid = valid
                self._valid.set()
            slave = self._slave
            slave.fmi2DoStep(slave.component, self._count * self._period, n * self._period, 1)
            self._count += n
            turn = float(self._turn.get()[0])
            if turn == self._seen:
                return None
            self._seen = turn
            numbers = {
                name: float(value)
                for ports in self._outputs
                for name, value in zip(ports.names, ports.get(), strict=True)
            }
            return numbers, self._read_texts()
        except FMICallException as error:
            raise self._error("failed in a step", error) from None

    def _read_texts(self) -> dict[str, str]:
        if not self._texts:
            return {}
        values = self._slave.getString([v.valueReference for v in self._texts])
        texts = (value.decode("utf-8", "replace") for value in values)
        return dict(zip((v.name for v in self._texts), texts, strict=True))

    def take_messages(self) -> list[str]:
        """Return what the FMU has logged since the last call: errors that did not end it."""
        said, self._messages[:] = list(self._messages), []
        return [in_options_units(text) for text in said]

    def _log(
        self, _component: int, _instance: bytes, _status: int, _category: bytes, message: bytes
    ) -> None:
        """Keep the last messages of the FMU: they name the cause of an error.

        A message is a printf format. FMPy's proxy would fill in its arguments, but knows one logger
        in a process, that of the last wheel, and calls it when that wheel is gone.
        """
        self._messages.append(message.decode("utf-8", "replace").replace("%%", "%").strip())
        del self._messages[:-5]

    def _error(self, what: str, error: Exception) -> FmuError:
        if isinstance(error, FMICallException) and error.status == fmi2Fatal:
            self._slave = None  # FMI allows no call after this, not even to free the instance
        return _fmu_error(self._path, what, error, self._messages)

    def close(self) -> None:
        """Free the instance; calling twice does no harm."""
        slave, self._slave = self._slave, None
        if slave is not None:
            try:
                if self._ready:
                    slave.terminate()
                slave.freeInstance()
            except FMICallException:
                self._messages.append("terminate failed")

    def __enter__(self) -> "FmuModel":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _fmu_error(path: Path, what: str, error: Exception, messages: list[str]) -> FmuError:
    said = "; its message: " + " | ".join(messages) if messages else ""
    cause = str(error) or type(error).__name__
    cause = cause if len(cause) <= LONGEST_CAUSE else cause[:LONGEST_CAUSE] + " ..."
    return FmuError(
        f"{path}: the FMU {what} ({cause}){said}; an FMU of this version of tirelib is "
        "needed; build it again with `tirelib fmu build`, or correct the inputs that it names"
    )
