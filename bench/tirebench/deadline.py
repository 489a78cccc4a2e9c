"""A moment on the monotonic clock, handed down instead of a number of seconds."""

import time
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Deadline:
    """When to stop waiting; every level below sees the same moment.

    Attributes
    ----------
    at : float, [s]
        On `time.monotonic`; infinite for no end.

    Examples
    --------
    >>> Deadline.never().expired, Deadline.after(-1.0).expired, Deadline.after(-1.0).remaining
    (False, True, 0.0)
    """

    at: float

    @classmethod
    def after(cls, seconds: float) -> "Deadline":
        """Return the moment in `seconds` from now."""
        return cls(time.monotonic() + seconds)

    @classmethod
    def never(cls) -> "Deadline":
        """Return a moment that does not come."""
        return cls(float("inf"))

    @property
    def remaining(self) -> float:
        """Seconds left, never below zero."""
        return max(0.0, self.at - time.monotonic())

    @property
    def expired(self) -> bool:
        """Whether the moment has passed."""
        return time.monotonic() >= self.at

    def sooner(self, seconds: float) -> "Deadline":
        """Return this deadline, or the moment in `seconds` if that comes first."""
        return Deadline(min(self.at, time.monotonic() + seconds))
