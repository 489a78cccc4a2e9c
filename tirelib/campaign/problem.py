"""One fault of a campaign, in the four parts that every error of the library has."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from tirelib.errors import FormatError

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Problem:
    """A fault: where it is, what was given, what is allowed, what to do.

    Attributes
    ----------
    where : str
        File, line or channel, and sample or time where that helps.
    given, allowed, remedy : str
        Halves of a sentence, without a full stop.
    severity : str
        ``error`` (the data cannot be used as they stand) or ``warning``.
    """

    where: str
    given: str
    allowed: str
    remedy: str
    severity: Severity = "error"

    def __str__(self) -> str:
        return f"{self.where}: {self.given}; {self.allowed}; {self.remedy}"


def errors_of(problems: Iterable[Problem]) -> list[Problem]:
    """Return the problems that are errors, in their order."""
    return [problem for problem in problems if problem.severity == "error"]


def raise_errors(problems: Iterable[Problem], prefix: str = "") -> None:
    """Raise one FormatError that holds every error among `problems`; warnings pass."""
    errors = [f"{prefix}{problem}" for problem in errors_of(problems)]
    if errors:
        raise FormatError(errors)
