"""What part of an error noise and the structure of the ring explain.

A ring is no tire, whatever effects it has: variants of the model that differ in structure and lack
no effect (`tirelib.diagnose.ensemble`) tell what that leaves. Only the kind of it is known
beforehand, not how much of it a tire has: the median of the variants is no floor, for half of all
tires leave less. So the floor is conditional on the residual r of the tire itself. By the
covariance of structure and noise,

    r = (best linear prediction of structure and noise, given r) + x,

and the floor is the error that would be left without what of x exceeds the noise: what has a shape
that structure has. Nor does it exceed what 19 of 20 variants leave: a missing effect may have such
a shape, but not such a size. It is at most the error. Where it is the error, nothing but structure
is left; what lies between them is explained by neither.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.error import MICROSTRAIN, NOISE, ModelError
from tirelib.diagnose.ensemble import Variants, variants
from tirelib.diagnose.noise import noise_in, white_noise
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.shape import structure_of
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data

FLOOR_MEMBERS = 20
SIZE = 0.95
"""Share of the variants whose size still counts as structure's: one less the false-alarm rate."""


@dataclass(frozen=True, slots=True)
class MapUnit:
    """How whitened residuals of a fit are drawn: in the noise, in microstrain without repeats.

    Attributes
    ----------
    factor : float
        By which a whitened residual, in units of noise and structural misfit, is multiplied.
    name : str
        noise or ustrain.
    """

    factor: float
    name: str

    @classmethod
    def of(cls, runs: StraightRuns, data: Data) -> "MapUnit":
        """Return the unit that a campaign allows."""
        if runs.noise.known:
            return cls(data.noise / runs.noise.std, NOISE)
        return cls(1e6 * data.noise, MICROSTRAIN)

    @property
    def known(self) -> bool:
        """Whether there are repeats."""
        return self.name == NOISE


def floor_of(
    error: ModelError,
    runs: StraightRuns,
    data: Data,
    model: Refit,
    beyond: FloatArray,
    usual: float,
) -> float:
    """Return the part of an error that noise and structure explain, in the error's unit.

    Parameters
    ----------
    error : ModelError
        Of the fitted model.
    runs : StraightRuns
    data : Data
        Of the runs.
    model : Refit
    beyond : shape (n_runs, n_phi)
        x: whitened part of its residual that neither noise nor structure explains.
    usual : float
        Rms whitened residual that 19 of 20 variants stay below.

    Returns
    -------
    float
        NaN without repeats.
    """
    if not error.known:
        return float("nan")
    noise = white_noise(runs, model, data.strain).sample
    square = float(np.mean(model.whiten(data.strain - model.waveform) ** 2))
    excess = max(float(np.mean(beyond**2)) - noise**2, 0.0)
    explained = min(max(square - excess, 0.0), usual**2)
    return error.value * float(np.sqrt(explained / square))


def usual_size(model: Refit, members: FloatArray) -> float:
    """Return the rms that `SIZE` of the variants' residuals (n, n_runs * n_phi) stay below."""
    white = model.beside_delay(members.reshape(-1, *model.waveform.shape))
    return float(np.quantile(np.sqrt(np.mean(white**2, axis=(1, 2))), SIZE))


def structural_floor(
    error: ModelError,
    runs: StraightRuns,
    data: Data,
    model: Refit,
    *,
    members: int = FLOOR_MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> float:
    """Return the floor of a fitted model by variants of it; parameters as of `floor_of`."""
    if not error.known:
        return float("nan")
    found = Variants(
        variants(data, model, members=members, seed=seed, progress=progress), noise_in(runs)
    )
    level = white_noise(runs, model, data.strain)
    structure = structure_of(data, model, found, level.smooth)
    white = model.whiten(data.strain - model.waveform).reshape(1, -1)
    return floor_of(
        error, runs, data, model, structure.beyond(white), usual_size(model, structure.members)
    )
