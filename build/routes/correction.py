"""What large displacements add to the linear ring, held while a fit moves the tire's numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating, State
from tirelib.measured.signal import LowPass
from tirelib.model.base import predict
from tirelib.model.chain import Changes
from tirelib.model.solution import solved
from tirelib.physics.contact.free_boundary import Start


@dataclass(frozen=True, slots=True)
class Correction:
    """Difference between the rolling and the linear ring, at fixed parameters.

    Attributes
    ----------
    waveform : shape (n_points, n_phi), [-]
    deflection : shape (n_points,), [m]
    start : Start or None
        Solution of the linear ring's contact.
    """

    waveform: FloatArray
    deflection: FloatArray
    start: Start | None = None

    def tiled(self, times: int) -> "Correction":
        """Return the correction for points repeated one after the other."""
        return Correction(
            np.tile(self.waveform, (times, 1)),
            np.tile(self.deflection, times),
            self.start.tiled(times) if self.start else None,
        )


def large_displacements(
    values: Mapping[str, float | FloatArray], points: Operating, low_pass: LowPass
) -> Correction:
    """Return the rolling ring less the linear one at a tire's values, both undamped."""
    still = {**values, "damping": 0.0}
    linear = predict(still, points, low_pass=low_pass)
    rolling = solved(still, points, low_pass=low_pass)
    return Correction(
        rolling.waveform - linear.wave,
        rolling.deflection - linear.deflection,
        linear.contact.start if linear.contact else None,
    )


def predict_with(
    correction: Correction | None,
    values: Mapping[str, float | FloatArray],
    points: Operating,
    changes: Changes = (),
    *,
    low_pass: LowPass | None = None,
) -> State:
    """Return the linear ring with a correction added to its filtered waveform and deflection."""
    if correction is None:
        return predict(values, points, changes, low_pass=low_pass)

    def add(state: State) -> State:
        return state.but(waveform=state.wave + correction.waveform)

    state = predict(
        values, points, [("gage", add), *changes], low_pass=low_pass, start=correction.start
    )
    return state.but(deflection=state.deflection + correction.deflection)
