"""Which effects a plan of straight runs may show at all, and why it cannot show the others."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects import Effect
from tirelib.effects.state import Operating
from tirelib.model.base import coordinates

IN_BASE = {
    "belt_extension": "extension_stiffness",
    "belt_shear": "shear_stiffness",
    "rotary_inertia": "rotary_inertia",
}
"""Effects that the base may have as a number."""
STILL = {"slip_angle": 5e-3, "camber": 5e-3, "slip_ratio": 5e-3}
"""What straight free rolling lacks, and the least that counts, [rad], [rad], [-]."""
LEAST_SIGNAL = 3.0
"""Whitened norm below which an effect at the end of its range is dead."""


def living(
    catalogue: Sequence[Effect], points: Operating, signal: Callable[[Effect], float]
) -> tuple[tuple[Effect, ...], dict[str, str]]:
    """Return the effects that may show, and the reason of each other one by its name.

    Parameters
    ----------
    catalogue : sequence of Effect
        Without those that the model has already.
    points : Operating
    signal : callable
        Whitened norm of what an effect at the end of its range does, [-]; may raise
        `ParameterError`.
    """
    alive, dead = [], {}
    for effect in catalogue:
        if effect.hook == "brush":
            continue
        reason = effect.untestable or _idle(effect, points)
        if not reason:
            try:
                if signal(effect) < LEAST_SIGNAL:
                    reason = "changes nothing that this plan could show"
                    if effect.varies_with:
                        reason += f" (it varies with {', '.join(effect.varies_with)})"
            except ParameterError as error:
                reason = str(error)
        if reason:
            dead[effect.name] = reason
        else:
            alive.append(effect)
    return tuple(alive), dead


def in_base(values: Mapping[str, float | FloatArray]) -> set[str]:
    """Return the effects that a tire's base model fits as numbers."""
    numbers = {coordinate.name for coordinate in coordinates(values)}
    return {effect for effect, number in IN_BASE.items() if number in numbers}


def _idle(effect: Effect, points: Operating) -> str:
    """Return which condition that an effect varies with no run has, or is not measured."""
    still = [
        name
        for name, least in STILL.items()
        if name in effect.varies_with
        and float(np.abs(np.nan_to_num(getattr(points, name))).max()) < least
    ]
    if still:
        return f"no run has a {' or '.join(still).replace('_', ' ')}"
    missing = effect.unknown(points)
    return f"{', '.join(missing)} is not measured in every run" if missing else ""
