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

import numpy as np

from tirebench.can_batch import CanBatch, same_kind
from tirebench.chain import Turn, quantity_valid
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
            Signal("valid", 56, 8, comment=f"1: may be used; {names}"),
        )
    signed = kind == ESTIMATE
    ending = "" if signed else "_std"
    note = "-32768: not known" if signed else "65535: not known"
    return tuple(
        Signal(f"{name}{ending}", 16 * i, 16, signed, step, unit, comment=note)
        for i, (name, (step, _, unit)) in enumerate(STEPS.items())
    )


def estimate_frames(turn: Turn, wheel: int, number: int) -> CanBatch:
    """Return the three frames of a turn; `number` counts turns."""
    values = [_field(turn.outputs[name], name, signed=True) for name in STEPS]
    stds = [_field(turn.outputs.get(f"{name}_std", math.nan), name) for name in STEPS]
    age = turn.outputs.get("age", math.nan) / AGE_STEP
    valid = sum(quantity_valid(turn, name) << i for i, name in enumerate(STEPS))
    state = bytearray(np.array([number % 2**16, _limited(age, UNKNOWN)], "<u2").tobytes())
    state += (turn.flags & 0xFFFFFF).to_bytes(3, "little") + bytes([valid])
    data = np.stack(
        [
            np.frombuffer(np.array(values, "<i2").tobytes(), np.uint8),
            np.frombuffer(np.array(stds, "<u2").tobytes(), np.uint8),
            np.frombuffer(bytes(state), np.uint8),
        ]
    )
    identifiers = [base + wheel for base in ESTIMATE_BASES.values()]
    return same_kind(np.array(identifiers), data, fd=False)


def _field(value: float, name: str, *, signed: bool = False) -> int:
    step, unit, _ = STEPS[name]
    scaled = value * unit / step
    if signed:
        known = math.isfinite(scaled) and abs(round(scaled)) <= 2**15 - 1
        return round(scaled) if known else UNKNOWN_SIGNED
    return _limited(scaled, UNKNOWN)


def _limited(value: float, unknown: int) -> int:
    known = math.isfinite(value) and 0 <= round(value) < unknown
    return round(value) if known else unknown
