"""Wheels that leave the calibrated range, or the virtual tire's: `valid` drops within two turns.

No vehicle drives here: each of four wheels rolls steadily, and at a moment one of its quantities
jumps to a value that nothing was calibrated for.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from cosim.recording import TIME_STEP, follow
from cosim.wheels import WHEELS, FourWheels, WheelStates

CASES: tuple[tuple[str, str, float], ...] = (
    ("load 8.7 kN", "load", 8700.0),
    ("load 0.4 kN", "load", 400.0),
    ("slip angle 7.5 deg", "alpha", np.radians(7.5)),
    ("slip angle 20 deg", "alpha", np.radians(20.0)),
    ("slip ratio -0.11", "kappa", -0.11),
    ("wheel locked", "kappa", -1.0),
    ("camber 6 deg", "camber", np.radians(6.0)),
    ("3 m/s", "speed", 3.0),
)
"""What goes out of range: name, field of `WheelStates`, value."""
BEFORE, AFTER = 0.6, 0.8
"""Duration of the steady part, and of the rest [s]."""
TURNS = 2.0
"""Within which `valid` must have dropped."""
_START = {"load": 4000.0, "alpha": np.radians(1.0), "kappa": 0.0, "camber": 0.0, "speed": 20.0}


def drill(wheels: FourWheels) -> list[dict[str, Any]]:
    """Return, for each case, whether `valid` was true before and when it dropped.

    ``turns`` counts turns of the wheel as it rolled before; NaN: it never dropped.
    """
    found = []
    for first in range(0, len(CASES), len(WHEELS)):
        cases = CASES[first : first + len(WHEELS)]
        steady = WheelStates(
            **{name: np.full(len(WHEELS), value) for name, value in _START.items()}
        )
        out = steady
        for at, (_, name, value) in enumerate(cases):
            changed = getattr(out, name).copy()
            changed[at] = value
            out = replace(out, **{name: changed})
        before = round(BEFORE / TIME_STEP)
        told = follow([steady] * before + [out] * round(AFTER / TIME_STEP), wheels)
        for at, (words, _, _) in enumerate(cases):
            valid = told["valid"][:, at] > 0.0
            dropped = np.flatnonzero(~valid[before:])
            omega = told["tire_omega"][before - 1, at]
            turns = dropped[0] * TIME_STEP * omega / (2.0 * np.pi) if dropped.size else np.nan
            found.append(
                {
                    "case": words,
                    "valid_before": bool(valid[before - 1]),
                    "turns": float(turns),
                    "stays": bool(dropped.size and not valid[before + dropped[0] :].any()),
                    "passed": bool(valid[before - 1] and dropped.size and turns <= TURNS),
                }
            )
    return found
