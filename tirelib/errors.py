"""Errors of the library.

Each class is also the builtin that it resembles. A message says where, what was given,
what is allowed and what to do.
"""

from collections.abc import Sequence


class TirelibError(Exception):
    """Base of every error that the library raises on purpose."""


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

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))


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

    def __init__(self, message: str, iterate: object, residual: float) -> None:
        self.iterate = iterate
        self.residual = residual
        super().__init__(message)
