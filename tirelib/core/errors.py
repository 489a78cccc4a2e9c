"""Errors of the library.

Each class is also the builtin that it resembles. A message says where, what was given,
what is allowed and what to do. An error that is raised with a `Fault` carries these four parts as
fields, so that whoever catches it may state them at another place.
"""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong, in four parts.

    Attributes
    ----------
    where : str
        File, line or channel, and sample or time where that helps; empty where only the caller
        knows the place.
    given, allowed, remedy : str
        Parts of a sentence, without a full stop.
    """

    where: str
    given: str
    allowed: str
    remedy: str

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        return f"{place}{self.given}; {self.allowed}; {self.remedy}"


class TirelibError(Exception):
    """Base of every error that the library raises on purpose.

    Attributes
    ----------
    faults : tuple of Fault
        The faults among the arguments; empty where an error was raised with a text alone.
    point : int or None
        Index of the operating point that the message names; None where it names none.
    """

    def __init__(self, *said: object, point: int | None = None) -> None:
        self.point = point
        self.faults = tuple(each for each in said if isinstance(each, Fault))
        super().__init__(*map(str, said))


class ParameterError(TirelibError, ValueError):
    """A number or an option lies outside what is allowed."""


class UnitError(TirelibError, ValueError):
    """A unit is missing, unknown, or of another dimension."""


class ShapeError(TirelibError, ValueError):
    """Arrays that must match do not."""


class FormatError(TirelibError, ValueError):
    """A file is not what its format says.

    Attributes
    ----------
    problems : tuple of str
        Every fault that was found, in reading order.
    """

    def __init__(self, problems: str | Fault | Sequence[str | Fault]) -> None:
        found = (problems,) if isinstance(problems, str | Fault) else tuple(problems)
        self.problems = tuple(map(str, found))
        super().__init__("\n".join(self.problems))
        self.faults = tuple(each for each in found if isinstance(each, Fault))


class CalibrationError(TirelibError, ValueError):
    """A calibration cannot be made from these data, or does not fit them."""


class ConvergenceError(TirelibError, RuntimeError):
    """An iteration ended without a solution.

    Attributes
    ----------
    iterate : object
        The last iterate, for inspection.
    residual : float
        What is left of the equations there, in their own unit (the message names it).
    """

    def __init__(
        self, message: str, iterate: object, residual: float, point: int | None = None
    ) -> None:
        self.iterate = iterate
        self.residual = residual
        super().__init__(message, point=point)

    def __reduce__(self) -> tuple[type["ConvergenceError"], tuple[str, object, float, int | None]]:
        return type(self), (str(self), self.iterate, self.residual, self.point)
