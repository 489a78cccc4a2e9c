"""Zero of the gage."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "gage_offset",
    stage="strain",
    unit="ustrain",
    low=-1000.0,
    high=1000.0,
    untestable="the mean over the turn is taken off, of measured and modelled strain alike",
    source="zero of the bridge, hoop strain of inflation and speed",
)
def gage_offset(state: State, strength: float) -> State:
    """Offset of the gage's zero.

    s added to the strain everywhere.
    """
    mean = np.arange(state.strain.shape[1]) == 0
    return state.but(strain=state.strain + 1e-6 * strength * mean)
