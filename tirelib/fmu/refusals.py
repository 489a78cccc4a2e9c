"""Refused steps of a slave: an error class, and their entry in ``status``."""

from tirelib.core.errors import ParameterError

STEP_REFUSED = "step_refused"
"""Word of ``status`` after a communication step that was not done."""
FAULT = "fault"
"""Word of ``status`` after an unexpected error; the name of `TurnFlag.FAULT`."""


class StepError(ParameterError):
    """A communication step that cannot be done; time does not advance."""


def status_entry(word: str, cause: str) -> str:
    """Return a word of the status with its cause, without the semicolon that parts words.

    Examples
    --------
    >>> status_entry(FAULT, "ZeroDivisionError: a; b")
    'fault: ZeroDivisionError: a, b'
    """
    return f"{word}: {cause.replace(';', ',')}"
