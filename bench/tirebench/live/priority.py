"""Priorities of the processes: reader, estimators and recorder before page and terminal."""

import os

from tirebench.errors import DeviceError

PRIORITY = 5
"""Real-time priority of a run."""
RIGHT = (
    f"it needs a permission, such as the line '* - rtprio {PRIORITY}' in /etc/security/limits.conf "
    "(then log in again)"
)
BELOW = 5
"""Niceness of page and terminal."""


def realtime(asked: bool | None) -> str:
    """Ask for real-time priority. Processes that this one starts begin without (`as_parent`).

    Parameters
    ----------
    asked : bool or None
        None: where the system has it and this user may.

    Returns
    -------
    What it is, in words.

    Raises
    ------
    DeviceError
        If it was asked for and is not to be had.
    """
    if asked is False:
        return "ordinary, as asked for"
    try:
        _set()
    except AttributeError:
        if asked:
            raise DeviceError(
                "--realtime: this system offers programs no real-time priority; Linux is needed; "
                "leave the option out"
            ) from None
        return "ordinary; this system offers programs no real-time priority"
    except PermissionError:
        if asked:
            raise DeviceError(
                f"--realtime: this user may not use real-time priority; {RIGHT}; add it, or leave "
                "--realtime out"
            ) from None
        return f"ordinary; for real-time priority: {RIGHT}"
    return f"real-time {PRIORITY}"


def ordinary(said: str) -> bool:
    """Return whether a run has ordinary priority, from the answer of `realtime`."""
    return said.startswith("ordinary")


def as_parent() -> None:
    """Take over real-time priority of the process that started this one, which has loaded by now.

    To load takes a second of processor, and nothing should wait for that.
    """
    try:
        if os.sched_getscheduler(os.getppid()) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR:
            _set()
    except (AttributeError, OSError):
        return  # another system, a parent that is gone, no right to it: it goes on as it is


def own_share() -> None:
    """Give this process a share of the processor of its own, unless it goes before others anyway.

    Linux shares the processor between sessions first (autogroup), so that a session of its own gets
    as much as all jobs of another together.
    """
    try:
        if os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK != os.SCHED_RR:
            os.setsid()
    except (AttributeError, OSError):
        return  # another system, or it has a session already


def _set() -> None:
    os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))


def below() -> None:
    """Let all others go first: this process only shows what they do."""
    if hasattr(os, "nice"):
        os.nice(BELOW)
