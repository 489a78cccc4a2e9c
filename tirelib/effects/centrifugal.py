"""Inertia of the rotating belt against the tension that it makes."""

import numpy as np

from tirelib.effects.effect import effect
from tirelib.effects.state import State


@effect(
    "centrifugal",
    stage="inertia",
    unit="1",
    low=-1.0,
    high=0.0,
    varies_with=("speed",),
    source="dissertation, Eq. (85) with the full tension p b R + rho A R^2 Omega^2",
)
def centrifugal(state: State, strength: float) -> State:
    """Rotating inertia of the belt is less than its centrifugal tension implies.

    In steady rolling the inertia and the tension rho A R^2 Omega^2 cancel in every harmonic of the
    inextensible ring. With 1 + s of the inertia the tension -s rho A R^2 Omega^2 is left over,
    which stiffens the belt with speed; s = -1 leaves the whole of it.
    """
    own = state.mass * (state.radius * np.asarray(state.conditions.omega)) ** 2
    return state.but(tension=state.tension - strength * own)
