"""Which conditions the points of a force vary, and so which effects they may show."""

import numpy as np

from tirelib.effects import Effect
from tirelib.effects.brush_state import BrushConditions

SPANS = {
    "load": 0.1,
    "pressure": 0.03,
    "speed": 0.1,
    "slip_angle": np.deg2rad(1.0),
    "slip_ratio": 0.01,
    "camber": np.deg2rad(0.5),
    "temperature": 5.0,
}
"""Least range of a condition: relative for load, pressure and speed, else [rad], [-], [K]."""
_WORDS = {
    "slip_angle": "slip angle",
    "slip_ratio": "slip ratio",
    "temperature": "tread temperature",
    "slip_rate": "rate of the slip angle",
}


def blind(at: BrushConditions, effect: Effect) -> str:
    """Return why a plan cannot show an effect, or an empty text."""
    if effect.untestable:
        return effect.untestable
    unknown = [_WORDS.get(name, name) for name in effect.unknown(at)]
    if unknown:
        return f"{' and '.join(unknown)} is not measured at every point"
    if effect.varies_with and not any(varies(at, name) for name in effect.varies_with):
        if effect.lacking:
            return effect.lacking
        names = [_WORDS.get(name, name) for name in effect.varies_with]
        return f"no run varies {' or '.join(names)}"
    return ""


def varies(at: BrushConditions, name: str) -> bool:
    """Return whether a condition has a range in which an effect could show."""
    if name not in SPANS:
        return True
    values = getattr(at, name)
    if not np.isfinite(values).all():
        return False
    relative = name in ("load", "pressure", "speed")
    return bool(np.ptp(values) > SPANS[name] * (np.abs(values).max() if relative else 1.0))
