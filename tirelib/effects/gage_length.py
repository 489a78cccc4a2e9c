"""Length of the gage."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.harmonics import orders, with_gain
from tirelib.effects.state import State


@effect(
    "gage_length",
    stage="gage",
    unit="mm^2",
    low=0.0,
    high=3600.0,
    source="mean over the gage's length; gages are up to 20 mm long, piezoelectric films 60 mm",
)
def gage_length(state: State, strength: float) -> State:
    """Mean of the strain over the gage's length.

    s is the length squared, L^2: harmonic n becomes sin(x) / x of itself, x = n L / (2 R). A fit
    that tries s < 0 on its way finds sinh(x) / x there, which continues it smoothly.
    """
    half = 0.5e-3 * np.sqrt(np.abs(strength)) / state.radius[:, None]
    x = orders(state) * half
    grown = np.sinh(x) / np.where(x > 0.0, x, 1.0) + (x == 0.0)
    return with_gain(state, np.sinc(x / np.pi) if strength >= 0.0 else grown)
