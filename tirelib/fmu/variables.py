"""What an FMU says of one of its variables."""

import math
from dataclasses import dataclass

from tirelib.core.rates import RATES

RIGHT = 0.5 * math.pi


@dataclass(frozen=True, slots=True)
class Variable:
    """One scalar variable.

    `kind` is ``Real``, ``Integer``, ``Boolean`` or ``String``; `causality` ``parameter``, ``input``
    or ``output``. Only a Real has units; its value is in `unit`, tools may show `display`. `type`
    names the declared type (`tirelib.fmu.describe.TYPES`) that a unit belongs to.
    """

    name: str
    kind: str
    causality: str
    description: str
    start: float | int | bool | str
    unit: str | None = None
    display: str | None = None
    nominal: float | None = None
    low: float | None = None
    high: float | None = None
    type: str | None = None


def sample_rate(start: float) -> Variable:
    """Return the parameter of every FMU that takes or gives samples of strain."""
    return Variable(
        "sample_rate",
        "Real",
        "parameter",
        "sample rate of the gages",
        start,
        "Hz",
        "kHz",
        1e4,
        *RATES,
        type="Frequency",
    )
