"""Structural variants of the user's own model, with no effect: what the scores do by themselves.

A ring is not a tire, and what it lacks looks to some extent like one effect or another. So the
scores of the data are held against those of waveforms that variants of the model make: a belt that
stretches and shears, a tread that hardens and gains width with load, sections with inertia,
traction that is not as assumed, a smooth misfit that goes with strain, load and pressure, run-out;
measured at the user's plan with the rig's tolerances, delay and noise.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.ranking import Ranking
from tirelib.diagnose.refit import Refit
from tirelib.effects import CATALOGUE
from tirelib.errors import TirelibError
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.identify import FITTED
from tirelib.identify.random_effects import angle_slope
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import move, predict
from tirelib.waveforms import GRID

MEMBERS = 100
REFERENCE_LOAD = 4000.0
MISFIT = Discrepancy(inside=0.01, outside=0.005)
BACK_STEPS = 3
TRACTION = {"trailing_sliding": 0.3, "tread_friction": 0.03}
"""Share of the range by which the traction of a rolling tire may differ from the ring's."""
TIMING = 6e-5
"""Common delay between trigger and gages that a rig may have, [s]."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Scores of the variants.

    Attributes
    ----------
    scores : shape (n_members, n_candidates)
    after : shape (n_members,), [-]
        Rms of the whitened residual after the joint fit.
    """

    scores: FloatArray
    after: FloatArray

    @property
    def threshold(self) -> FloatArray:
        """Largest score of the variants, per candidate."""
        largest: FloatArray = self.scores.max(axis=0)
        return largest


def structural_ensemble(
    data: Data,
    model: Refit,
    ranking: Ranking,
    *,
    noise: float,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Ensemble:
    """Return the scores of variants of a model at the plan of the data.

    Parameters
    ----------
    noise : float, [-]
        Of a run's waveform, from repeats.
    members, seed : int
    progress : callable, optional
        Called after each member.
    """
    random = np.random.default_rng(seed)
    rows = model.whiten(model.slopes[: len(FITTED)]).reshape(len(FITTED), -1)
    normal = rows @ rows.T + 1e-6 * np.eye(len(FITTED))
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    half = 0.6 * np.sqrt(2.0 * model.deflection / float(np.max(model.values["free_radius"])))
    misfit = MISFIT.columns(model.waveform, half, data.points, GRID)
    scores: list[FloatArray] = []
    after: list[float] = []
    attempts = 0
    while len(scores) < members and attempts < 3 * members:
        attempts += 1
        try:
            wave = _variant(data, model, misfit, noise, random)
            rest = np.subtract(wave, _refitted(data, model, wave, rows, inverse))
        except TirelibError:
            continue  # the draw is no tire
        found = ranking.scores(rest)
        scores.append(found.score)
        after.append(found.after)
        if progress is not None:
            progress(f"variant {len(scores)}")
    return Ensemble(np.array(scores), np.array(after))


def _variant(
    data: Data, model: Refit, misfit: FloatArray, noise: float, random: np.random.Generator
) -> FloatArray:
    """Return the waveforms of one variant, measured."""
    points, tolerance = data.points, data.tolerance
    n = len(points)
    values = dict(model.values)
    for name in (
        "bending_stiffness", "radial_stiffness", "tangential_stiffness", "extension_stiffness",
    ):  # fmt: skip
        values[name] = values[name] * float(np.exp(0.1 * random.standard_normal()))
    values["shear_stiffness"] = 1e3 / random.uniform(0.001, 0.03)
    values["tread_hardening"] = random.uniform(0.0, 3.0)
    values["rotary_inertia"] = random.uniform(0.0, 3e-4)
    values["tread_stiffness"] = values["tread_stiffness"] * (
        points.load / REFERENCE_LOAD
    ) ** random.uniform(0.0, 0.4)
    really = replace(
        points,
        load=points.load * (1.0 + tolerance.load * random.standard_normal(n)),
        pressure=points.pressure * (1.0 + tolerance.pressure * random.standard_normal(n)),
    )
    rolling = [
        CATALOGUE[name].at(share * CATALOGUE[name].scale * random.uniform(-1.0, 1.0))
        for name, share in TRACTION.items()
        if name not in {effect.name for effect in model.effects}
    ]
    state = predict(
        values, really, [*model.changes, *rolling], low_pass=data.low_pass,
        correction=model.correction,
    )  # fmt: skip
    wave = state.wave
    wave = wave + np.tensordot(random.standard_normal(len(misfit)), misfit, axes=1)
    wave = wave + random.uniform(0.0, 20e-6) * np.cos(GRID - random.uniform(-np.pi, np.pi))
    wave = wave * (1.0 + tolerance.gain * random.standard_normal(n))[:, None]
    zero = np.minimum(data.angle_std, 0.01) * random.standard_normal(n)
    zero = zero + TIMING * random.uniform(-1.0, 1.0) * points.omega
    wave = wave - angle_slope(wave) * zero[:, None]
    wave = wave - wave.mean(axis=1, keepdims=True)
    measured: FloatArray = wave + noise * random.standard_normal(wave.shape)
    return measured


def _refitted(
    data: Data, model: Refit, wave: FloatArray, rows: FloatArray, inverse: FloatArray
) -> FloatArray:
    """Return the base model brought near a waveform by a few chord steps."""
    z = np.zeros(len(FITTED))
    fitted = model.waveform
    for _ in range(BACK_STEPS):
        step = inverse @ (rows @ model.whiten(wave - fitted).ravel())
        z = z + np.clip(step, -0.4, 0.4)
        state = predict(
            move(model.values, z, FITTED), data.points, model.changes, low_pass=data.low_pass,
            correction=model.correction,
        )  # fmt: skip
        fitted = state.wave
    return fitted
