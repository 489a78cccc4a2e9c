"""Who goes first where processors are short: reader, estimators and recorder before what shows."""

import os

from bench.errors import DeviceError

PRIORITY = 5
"""Real-time priority of a run that asks for it."""
BELOW = 5
"""Niceness of what only shows."""


def realtime() -> None:
    """Ask for real-time priority, for this process and those that it starts from now on.

    Raises
    ------
    DeviceError
        If the system has none, or does not allow it.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    except AttributeError:
        raise DeviceError(
            "--realtime: this system has no real-time priority that a program may ask for; Linux "
            "is needed; leave it out"
        ) from None
    except PermissionError:
        raise DeviceError(
            "--realtime: this user may not have real-time priority; the right to it is needed, "
            f"such as a line '* - rtprio {PRIORITY}' in /etc/security/limits.conf (then log in "
            "anew); add it, or leave --realtime out"
        ) from None


def below() -> None:
    """Let all others go first: this process only shows what they do."""
    if hasattr(os, "sched_setscheduler"):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    if hasattr(os, "nice"):
        os.nice(BELOW)
