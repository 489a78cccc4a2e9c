"""What errors are counted in, and what error the ring's structure leaves by itself."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tirelib.diagnose.ensemble import structural_ensemble
from tirelib.diagnose.noise import UNKNOWN_NOISE
from tirelib.diagnose.refit import Refit
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data

FLOOR_MEMBERS = 20


@dataclass(frozen=True, slots=True)
class ErrorUnit:
    """How whitened residuals are told.

    A whitened residual is in units of noise and structural misfit together; errors are told in
    units of the noise between repeated runs, in microstrain where there are none.

    Attributes
    ----------
    factor : float
        By which the rms of a whitened residual is multiplied.
    name : str
        noise or ustrain.
    noise : float, [-]
        From repeats; NaN without.
    """

    factor: float
    name: str
    noise: float

    @classmethod
    def of(cls, runs: StraightRuns, data: Data) -> "ErrorUnit":
        """Return the unit that a campaign allows."""
        noise = runs.noise.std
        if np.isfinite(noise):
            return cls(data.noise / noise, "noise", noise)
        return cls(1e6 * data.noise, "ustrain", noise)

    @property
    def known(self) -> bool:
        """Whether there are repeats."""
        return self.name == "noise"


def structural_floor(
    data: Data,
    model: Refit,
    unit: ErrorUnit,
    *,
    members: int = FLOOR_MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> float:
    """Return the error that variants of a model leave, median, in the error's unit.

    The variants differ from the ring in structure and lack no effect; the base is fitted to them.
    """
    noise = unit.noise if unit.known else UNKNOWN_NOISE
    rests = structural_ensemble(
        data, model, noise=noise, members=members, seed=seed, progress=progress
    )
    white = model.beside_delay(rests.reshape(-1, *model.waveform.shape))  # as a fit would
    left = np.sqrt(np.mean(white**2, axis=(1, 2))) if rests.size else np.array([np.nan])
    return unit.factor * float(np.median(left))
