"""Calls of a slave that end in an FMI error and never in a crash of the importer."""

import ctypes
import functools
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from tirelib.fmu.refusals import StepError


class Model(Protocol):
    """The model that a slave steps; it supplies its output values and its state."""

    def outputs(self) -> tuple[Sequence[float], Sequence[Any]]:
        """Return the values of the Real outputs and of the others, in the table's order."""

    def fault(self, cause: str) -> None:
        """Hold the last values as invalid and start again, after an error."""

    def state(self) -> dict[str, Any]:
        """Return everything that is remembered, as JSON knows it."""

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a state."""


def guarded(method: Callable[..., Any]) -> Callable[..., Any]:
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
            self.complain(str(error) if isinstance(error, StepError) else cause_of(error))
            for kept in (type(self), self, self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))
            raise

    return call


def cause_of(error: Exception) -> str:
    """Return what an error says, with its class."""
    text = str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
