"""A turn's estimates as the three CAN frames of `tirebench.protocols.estimates`."""

import math

import numpy as np

from tirebench.estimator.chain import Turn, quantity_valid
from tirebench.protocols.estimates import (
    AGE_STEP,
    ESTIMATE_BASES,
    STEPS,
    UNKNOWN,
    UNKNOWN_SIGNED,
)
from tirebench.wire.can_batch import CanBatch, same_kind


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
