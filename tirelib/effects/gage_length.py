"""Length of the gage."""

import numpy as np

from tirelib.effects.effect import State, effect


@effect(
    "gage_length", stage="strain", unit="mm^2", low=0.0, high=400.0,
    source="mean over the gage's length; gages are up to 20 mm long",
)  # fmt: skip
def gage_length(state: State, strength: float) -> State:
    """Mean of the strain over the gage's length.

    s is the length squared, L^2: harmonic n becomes sin(x) / x of itself, x = n L / (2 R).
    """
    n = np.arange(state.strain.shape[1])
    half = 0.5e-3 * np.sqrt(strength) / state.radius[:, None]
    return state.but(strain=state.strain * np.sinc(n * half / np.pi))
