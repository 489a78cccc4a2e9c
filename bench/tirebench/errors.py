"""Errors of the bench.

::

    BenchError
    +-- DeviceError        (ValueError)       a device file, an option or a setting
    +-- RecordingError     (ValueError)       a file that is no recording, or is damaged
    +-- FmuError           (ValueError)       an FMU that is refused, or that failed in a step
    +-- LinkError          (ConnectionError)  a port that cannot be opened
    |   +-- UnpluggedError                    a port that went away while it was read
    +-- LinkTimeoutError   (TimeoutError)     nothing came before the deadline

A message says where, what was given, what is allowed and what to do.
"""

from collections.abc import Sequence


class BenchError(Exception):
    """Base of every error that the bench raises on purpose."""


class DeviceError(BenchError, ValueError):
    """A device file, an option or a setting is not what it must be.

    Attributes
    ----------
    problems : tuple of str
        Every fault that was found, in reading order.
    """

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))


class RecordingError(BenchError, ValueError):
    """A file is no recording of this program, or of another version."""


class FmuError(BenchError, ValueError):
    """An FMU is refused before it is unpacked, cannot be loaded, or failed in a step."""


class LinkError(BenchError, ConnectionError):
    """A port cannot be opened: it is not there, in use, or not allowed."""


class UnpluggedError(LinkError):
    """A port went away while it was read. Example: the cable is pulled."""


class LinkTimeoutError(BenchError, TimeoutError):
    """Nothing came before the deadline. Example: the transmitter is off."""


def cause(error: Exception) -> str:
    """Return what an error says, without number and path where it comes from the system."""
    return getattr(error, "strerror", None) or str(error)
