"""One fault of a campaign: an error or a warning."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from tirelib.core.errors import Fault, FormatError

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class CampaignFault(Fault):
    """A fault with its severity.

    Attributes
    ----------
    severity : str
        ``error`` (the data cannot be used as they stand) or ``warning``.
    """

    severity: Severity = "error"

    @classmethod
    def at(cls, where: str, fault: Fault) -> "CampaignFault":
        """Return a fault that was found at a place which its finder did not know."""
        return cls(where, fault.given, fault.allowed, fault.remedy)


def errors_of(problems: Iterable[CampaignFault]) -> list[CampaignFault]:
    """Return the problems that are errors, in their order."""
    return [problem for problem in problems if problem.severity == "error"]


def raise_errors(problems: Iterable[CampaignFault], prefix: str = "") -> None:
    """Raise one FormatError that holds every error among `problems`; warnings pass."""
    errors = [replace(problem, where=f"{prefix}{problem.where}") for problem in errors_of(problems)]
    if errors:
        raise FormatError(errors)
