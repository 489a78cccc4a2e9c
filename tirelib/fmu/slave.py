"""Common base of the slaves: variables by reference, guarded calls, refused steps, exact states.

A slave that pythonfmu exports derives from `GuardedSlave` first and from ``Fmi2Slave`` second::

    class StrainTire(GuardedSlave, Fmi2Slave):
        fmi = pythonfmu
        ...

and gives `table`, `started` and `advance`. This module knows pythonfmu only through `fmi`, so that
it can be checked and used where pythonfmu is not installed.
"""

import hashlib
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NoReturn

from tirelib.core.errors import FormatError, ParameterError, TirelibError
from tirelib.fmu.guarded import Model, cause_of, guarded
from tirelib.fmu.journal import Journal
from tirelib.fmu.refusals import STEP_REFUSED, StepError, status_entry
from tirelib.fmu.variables import Variable


class GuardedSlave:
    """Reals live in one list by value reference, so that a frame is one slice of it.

    The folder of resources holds ``settings.json`` with ``guid``, ``version``, ``description`` and
    ``step_size`` [s], written by `tirelib.fmu.export.export`, and whatever the slave needs.
    """

    fmi: ClassVar[Any]
    """The module pythonfmu."""
    log: Callable[..., None]
    register_variable: Callable[..., None]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.journal = Journal()
        self._remarked: set[str] = set()
        self.folder = Path(kwargs["resources"])
        _once_in_path(str(kwargs["resources"]))
        self.settings = json.loads((self.folder / "settings.json").read_text(encoding="utf-8"))
        self.guid = self.settings["guid"]
        self.version = self.settings["version"]
        self.description = self.settings["description"]
        self.author, self.license = "The tirelib developers", "MIT"
        self.default_experiment = self.fmi.default_experiment.DefaultExperiment(
            start_time=0.0, stop_time=1.0, step_size=self.settings["step_size"]
        )
        self._variables = table = self.table()
        self.reference = {v.name: number for number, v in enumerate(table)}
        self.real: list[Any] = [v.start if v.kind == "Real" else None for v in table]
        self.other: dict[str, Any] = {v.name: v.start for v in table if v.kind != "Real"}
        for variable in table:
            self.register_variable(self._scalar(variable))
        self._fixed = self._of(table, "parameter")
        self._inputs = self._of(table, "input")
        self._allow(self._inputs | self._fixed)
        self._get_last: list[int] | None = None
        self._get_place: slice | None = None
        given = [v for v in table if v.causality == "output"]
        reals = [self.reference[v.name] for v in given if v.kind == "Real"]
        self._results = slice(reals[0], reals[-1] + 1)
        self._names = [v.name for v in given if v.kind != "Real"]
        self._truths = [v.name for v in given if v.kind == "Boolean"]
        self._results_first = {v.name: v.start for v in given}
        self._foreseen: Any = None
        self.model: Any = None
        self._phase = "instantiated"
        self._refused = False

    def _allow(self, references: frozenset[int]) -> None:
        """Let these be set from now on."""
        self._settable = references
        self._set_last: list[int] | None = None
        self._set_place: slice | None = None

    def _of(self, table: Iterable[Variable], causality: str) -> frozenset[int]:
        return frozenset(self.reference[v.name] for v in table if v.causality == causality)

    def table(self) -> list[Variable]:
        """Return the variables: parameters, inputs, outputs; outputs with all Reals first."""
        raise NotImplementedError

    def started(self) -> Model:
        """Return a new model with the parameters as they are set now."""
        raise NotImplementedError

    def advance(self, step: float) -> bool:
        """Go on by a step [s]; return whether the outputs have changed.

        Raises
        ------
        StepError
            If the step cannot be done; nothing may have changed.
        """
        raise NotImplementedError

    def _scalar(self, variable: Variable) -> Any:
        """Return the variable as pythonfmu declares it.

        Its own getters would hold on to this instance: a freed one would then wait for the garbage
        collector, with all its memory.
        """
        name, fixed = variable.name, variable.causality == "parameter"
        variability = self.fmi.Fmi2Variability
        options: dict[str, Any] = {
            "causality": self.fmi.Fmi2Causality[variable.causality],
            "variability": variability.fixed if fixed else variability.discrete,
            "description": variable.description,
            "getter": _unread,
        }
        return getattr(self.fmi, variable.kind)(name, **options)

    def _check(self, references: Iterable[int]) -> None:
        """Refuse to set an output, or a parameter that is fixed by now."""
        if not self._settable.issuperset(references):
            names = [self._variables[r].name for r in references if r not in self._settable]
            raise ParameterError(
                f"{', '.join(names)}: cannot be set now; inputs can be set at any time, parameters "
                "before initialisation only, outputs never"
            )

    def _named(self, vrs: Iterable[int], kind: str) -> list[Variable]:
        found = [self._variables[reference] for reference in vrs]
        for variable in found:
            if variable.kind != kind:
                raise TypeError(f"{variable.name} is not of type {kind}")
        return found

    def _read(self, vrs: Iterable[int], kind: str) -> list[Any]:
        if self.model is None:
            self._foresee()
        return [self.other[variable.name] for variable in self._named(vrs, kind)]

    def _write(self, vrs: Sequence[int], values: Iterable[Any], kind: str) -> None:
        found = self._named(vrs, kind)
        self._check(vrs)
        self.other.update(zip((variable.name for variable in found), values, strict=True))

    @guarded
    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return Integers by value reference."""
        return self._read(vrs, "Integer")

    @guarded
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Return Booleans by value reference."""
        return self._read(vrs, "Boolean")

    @guarded
    def get_string(self, vrs: list[int]) -> list[str]:
        """Return Strings by value reference."""
        return self._read(vrs, "String")

    @guarded
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set Integers by value reference."""
        self._write(vrs, values, "Integer")

    @guarded
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Booleans by value reference."""
        self._write(vrs, values, "Boolean")

    @guarded
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Set Strings by value reference."""
        self._write(vrs, values, "String")

    @guarded
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Reals by value reference; a frame, set again and again, is one slice."""
        if vrs != self._set_last:
            self._named(vrs, "Real")
            self._check(vrs)
            self._set_last, self._set_place = vrs, _place(vrs)
        if self._set_place is not None and len(values) == len(vrs):
            self.real[self._set_place] = values
            return
        for reference, value in zip(vrs, values, strict=True):
            self.real[reference] = value

    @guarded
    def get_real(self, vrs: list[int]) -> list[float]:
        """Return Reals by value reference."""
        if self.model is None:
            self._foresee()
        if vrs != self._get_last:
            self._named(vrs, "Real")
            self._get_last, self._get_place = vrs, _place(vrs)
        if self._get_place is not None:
            return self.real[self._get_place]
        return [self.real[reference] for reference in vrs]

    def _foresee(self) -> None:
        """Before the start, show what the outputs would be if it came now.

        Importers that connect several FMUs read outputs while they initialise them, and set them as
        inputs of others. Parameters that cannot be leave the start values; a refused step is
        reported until the start.
        """
        if self._refused or self._foreseen == (self.real, self.other):
            return
        try:
            self.model = self.started()
        except Exception:  # the start reports the reason
            first = [float(self._results_first[v.name]) for v in self._variables[self._results]]
            self.real[self._results] = self.shown(first)
            self.other.update((name, self._results_first[name]) for name in self._names)
        else:
            self.publish()
        self.model = None
        self._foreseen = list(self.real), dict(self.other)

    def shown(self, values: Sequence[float]) -> Sequence[float]:
        """Return the Real outputs as an importer is to see them."""
        return values

    @guarded
    def setup_experiment(self, *_: float | None) -> None:
        """Pass over the times; refuse them once the FMU is initialised."""
        self._check_unstarted()

    @guarded
    def enter_initialization_mode(self) -> None:
        """Wait for the end of the initialisation."""
        self._check_unstarted()

    def _check_unstarted(self) -> None:
        if self._phase != "instantiated":
            raise StepError("the FMU is initialised; reset it before you initialise it again")

    @guarded
    def exit_initialization_mode(self) -> None:
        """Take up the parameters."""
        self._check_unstarted()
        self.model = self.started()
        self._allow(self._inputs)
        self._phase = "stepping"
        self.publish()

    @guarded
    def terminate(self) -> None:
        """Take no further steps; the outputs stay."""
        if self._phase == "terminated":
            raise StepError(_PHASES[self._phase])
        self._phase = "terminated"

    @guarded
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Do a step. A refused one is an FMI error; any other holds the last values as invalid.

        A discarded step would be quieter: pythonfmu 0.7.0 says with it that the slave wants the
        simulation to end, and importers end it without a word.
        """
        if self._phase != "stepping":
            self._refuse(_PHASES[self._phase])
        try:
            changed = self.advance(step_size)
        except StepError as error:
            self._refuse(str(error))
        except Exception as error:  # nothing may reach the importer
            cause = cause_of(error)
            self.complain(cause)
            self.model.fault(cause)
            changed = True
        if changed or self._refused:
            self.publish()
        return True

    def publish(self) -> None:
        """Write the outputs."""
        values, others = self.model.outputs()
        self.real[self._results] = self.shown(values)
        self.other.update(zip(self._names, others, strict=True))
        self._refused = False

    def _refuse(self, cause: str) -> NoReturn:
        """Make every output invalid until a step is done: time does not advance.

        Raises
        ------
        StepError
            Always, with the cause.
        """
        self._refused = True
        self.other.update(dict.fromkeys(self._truths, False))
        if "status" in self.other:
            self.other["status"] = status_entry(STEP_REFUSED, cause)
        raise StepError(cause)

    def complain(self, cause: str) -> None:
        """Log an error, unless its like was logged."""
        line = self.journal.line(cause)
        if line is not None:
            self.log(line, self.fmi.enums.Fmi2Status.error)

    def remark(self, kind: str, text: str) -> None:
        """Log a warning, once for each kind."""
        if kind not in self._remarked:
            self._remarked.add(kind)
            self.log(text, self.fmi.enums.Fmi2Status.warning, "logStatusWarning")

    @guarded
    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "guid": self.guid,
            "real": [None if value is None else float(value).hex() for value in self.real],
            "other": dict(self.other),
            "phase": self._phase,
            "refused": self._refused,
            "model": None if self.model is None else self.model.state(),
        }

    @guarded
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        before = self._get_fmu_state()
        try:
            self._take_up(state)
        except (KeyError, TypeError, ValueError, AttributeError, TirelibError):
            self._take_up(before)
            raise FormatError(
                "the bytes are not a saved state of this FMU; save the state again"
            ) from None

    def _take_up(self, state: Mapping[str, Any]) -> None:
        if state["guid"] != self.guid:
            raise FormatError("a state of another FMU")
        self.real[:] = [None if value is None else float.fromhex(value) for value in state["real"]]
        self.other.update(state["other"])
        self._allow(self._inputs | self._fixed)
        self.model, self._phase = None, "instantiated"
        if state["model"] is not None:
            model = self.started()
            model.restore(state["model"])
            self._allow(self._inputs)
            self.model = model
        self._phase, self._refused = state["phase"], state["refused"]

    @staticmethod
    def _fmu_state_to_bytes(state: Mapping[str, Any]) -> bytes:
        text = json.dumps(state).encode()
        return _sum(text) + text

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """Return a state; an empty one, which is refused as it is set, of damaged bytes."""
        size = len(_sum(b""))
        if state[:size] != _sum(state[size:]):
            return {}
        found: dict[str, Any] = json.loads(state[size:])
        return found


def _sum(text: bytes) -> bytes:
    """Return what stands before the bytes of a state, so that damage is seen."""
    return hashlib.sha256(text).hexdigest().encode()


_PHASES = {
    "instantiated": "the FMU is not initialised; call exitInitializationMode first",
    "terminated": "the FMU is terminated; reset it and initialise it again",
}


def _unread() -> None:
    """Replace a getter: values are read by reference, from the slave."""


def _once_in_path(folder: str) -> None:
    """Undo that every instance of pythonfmu 0.7.0 puts its folder on the path again."""
    while sys.path.count(folder) > 1:
        sys.path.remove(folder)


def _place(references: list[int]) -> slice | None:
    """Return the slice that references are, if they are one."""
    if not references:
        return None
    found = slice(references[0], references[0] + len(references))
    return found if references == list(range(found.start, found.stop)) else None
