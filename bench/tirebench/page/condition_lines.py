"""Which conditions are in use for a wheel, and where each comes from."""

import math
from typing import Any

from tirebench.estimator.wheels import Wheel
from tirebench.wire.conditions import UNITS, Conditions
from tirelib.core.held import HELD
from tirelib.core.units import from_si

ALWAYS = tuple(name for name in HELD if name != "omega")
"""Shown also where they are not known."""


def in_use(wheel: Wheel, conditions: Conditions, origin: str) -> dict[str, dict[str, Any]]:
    """Return value, unit and source of each condition; null where it is not known.

    The source is empty unless a bus sent the condition and is silent about it now.

    Parameters
    ----------
    wheel : Wheel
    conditions : Conditions
        Conditions that are known besides those from a bus.
    origin : str
        Where those come from, in words.
    """
    beside = conditions.at(wheel.newest_us)
    found: dict[str, dict[str, Any]] = {}
    for name, value in zip(HELD, beside, strict=True):
        bus_conditions = wheel.bus_conditions.get(name, math.nan)
        used, source = (bus_conditions, "bus") if name in wheel.bus_conditions else (value, origin)
        if math.isfinite(used):
            unit, dimension = UNITS[name]
            found[name] = {"value": from_si(used, unit, dimension), "unit": unit, "source": source}
        elif name in wheel.bus_conditions or name in ALWAYS:
            silent = "the bus is silent" if name in wheel.bus_conditions else ""
            found[name] = {"value": None, "unit": UNITS[name][0], "source": silent}
    return found
