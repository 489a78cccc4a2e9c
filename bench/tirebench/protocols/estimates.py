"""Estimates out on CAN, so that a dyno or a rapid-prototyping system reads them. Pure.

Three frames of 8 bytes a turn and wheel, little-endian, see the published DBC:

===============  =============  ===========================================================
frame            identifier     data
===============  =============  ===========================================================
ESTIMATE         0x140 + wheel  Fz i16 0.5 N, Fy i16 0.5 N, alpha i16 0.001 deg, kappa i16 1e-4
ESTIMATE_STD     0x148 + wheel  the standard deviations, u16 in the same steps
ESTIMATE_STATE   0x150 + wheel  turn u16, age u16 0.1 ms, flags u24, valid bits u8
===============  =============  ===========================================================

The lowest i16 and the highest u16 mean "not known" and are also what a value beyond the field
becomes, never a number that looks true. Axes are ISO 8855.
"""

import math
from collections.abc import Mapping

from tirebench.protocols.signals import Signal

ESTIMATE, ESTIMATE_STD, ESTIMATE_STATE = "ESTIMATE", "ESTIMATE_STD", "ESTIMATE_STATE"
ESTIMATE_BASES: Mapping[str, int] = {ESTIMATE: 0x140, ESTIMATE_STD: 0x148, ESTIMATE_STATE: 0x150}
STEPS = {
    "Fz": (0.5, 1.0, "N"),
    "Fy": (0.5, 1.0, "N"),
    "alpha": (0.001, 180.0 / math.pi, "deg"),
    "kappa": (1e-4, 1.0, ""),
}
"""Step on the bus in the unit of the bus, that unit in SI, its name."""
AGE_STEP = 1e-4
UNKNOWN_SIGNED, UNKNOWN = -(2**15), 2**16 - 1


def estimate_signals(kind: str) -> tuple[Signal, ...]:
    """Return the signals of one of the three frames."""
    if kind == ESTIMATE_STATE:
        names = ", ".join(f"bit {i}: {name}" for i, name in enumerate(STEPS))
        return (
            Signal("turn", 0, 16),
            Signal("age", 16, 16, factor=AGE_STEP * 1e3, unit="ms"),
            Signal("flags", 32, 24, comment="as the output flags of the FMU"),
            Signal("valid", 56, 8, comment=f"1: the value is valid; {names}"),
        )
    signed = kind == ESTIMATE
    ending = "" if signed else "_std"
    note = "-32768: no value" if signed else "65535: no value"
    return tuple(
        Signal(f"{name}{ending}", 16 * i, 16, signed, step, unit, comment=note)
        for i, (name, (step, _, unit)) in enumerate(STEPS.items())
    )
