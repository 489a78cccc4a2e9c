"""Length of the gage."""

import numpy as np

from tirelib.effects.effect import State, effect
from tirelib.effects.harmonics import orders, with_gain


@effect(
    "gage_length", stage="gage", unit="mm^2", low=0.0, high=400.0,
    source="mean over the gage's length; gages are up to 20 mm long",
)  # fmt: skip
def gage_length(state: State, strength: float) -> State:
    """Mean of the strain over the gage's length.

    s is the length squared, L^2: harmonic n becomes sin(x) / x of itself, x = n L / (2 R).
    """
    half = 0.5e-3 * np.sqrt(strength) / state.radius[:, None]
    return with_gain(state, np.sinc(orders(state) * half / np.pi))
