"""What each candidate effect would change, what the base can mimic of it, and who looks alike.

All of this follows from the plan and the model, before any residual is looked at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.effects import Effect
from tirelib.effects.effect import Strength
from tirelib.errors import ParameterError
from tirelib.identify.span import span
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import coordinates, predict

TWIN_ANGLE = np.deg2rad(30.0)
"""Signatures closer than this are called twins."""
_AS_NUMBER = {
    "belt_extension": "extension_stiffness",
    "belt_shear": "shear_stiffness",
    "rotary_inertia": "rotary_inertia",
}
"""Effects that a base model may have as a fitted parameter."""
LEAST_SIGNAL = 3.0
"""An effect at the end of its range that changes whitened waveforms by less is dead."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect that the model lacks.

    Attributes
    ----------
    effect : Effect
    rows : shape (components, n_runs * n_phi)
        Whitened change for a strength of one range, per component.
    own : shape (components, n_runs * n_phi)
        What of it the fitted coordinates cannot mimic.
    """

    effect: Effect
    rows: FloatArray
    own: FloatArray

    @property
    def signal(self) -> float:
        """Norm of the own part at the end of the range."""
        return float(np.sqrt(np.sum(self.own**2)))

    def alone(self, data: Data, model: Refit) -> tuple[FloatArray, float]:
        """Return what this effect alone does best beside the delay, to first order.

        Returns
        -------
        strength : shape (components,)
            In its unit.
        error : float
            Rms of the whitened residual that is left.
        """
        shape = (-1, *model.waveform.shape)
        rest = model.beside_delay(model.whiten(data.strain - model.waveform)).ravel()
        own = model.beside_delay(self.own.reshape(shape)).reshape(len(self.own), -1)
        weights = np.linalg.lstsq(own.T, rest, rcond=None)[0]
        left = float(np.sqrt(np.mean((rest - weights @ own) ** 2)))
        return np.asarray(weights * self.effect.scale), left


@dataclass(frozen=True, slots=True)
class Candidates:
    """The living candidates and why the others are dead.

    Attributes
    ----------
    living : tuple of Candidate
    dead : mapping of name to reason
    angles : shape (n, n), [rad]
        Smallest principal angle between own signatures.
    """

    living: tuple[Candidate, ...]
    dead: dict[str, str]
    angles: FloatArray

    def twins(self, index: int) -> list[tuple[str, float]]:
        """Return effects whose signature is near, with the angle [rad], nearest first."""
        found = [
            (self.living[j].effect.name, float(angle))
            for j, angle in enumerate(self.angles[index])
            if j != index and angle < TWIN_ANGLE
        ]
        return sorted(found, key=lambda pair: pair[1])


def in_base(values: Mapping[str, float | FloatArray]) -> set[str]:
    """Return the effects that a tire's base model fits as numbers."""
    free = {coordinate.name for coordinate in coordinates(values)}
    return {effect for effect, number in _AS_NUMBER.items() if number in free}


def candidates(data: Data, model: Refit, catalogue: Sequence[Effect]) -> Candidates:
    """Return what every effect of a catalogue would change, at the fitted model.

    Effects that the model has, and those of the brush, are left out.
    """
    has, numbers = {effect.name for effect in model.effects}, in_base(model.values)
    nuisance = model.whiten(model.own_slopes).reshape(len(model.own_slopes), -1)
    basis = span(nuisance.T)
    living: list[Candidate] = []
    dead: dict[str, str] = {}
    for effect in catalogue:
        if effect.name in has | numbers or effect.hook == "brush":
            continue
        if effect.untestable:
            dead[effect.name] = effect.untestable
            continue
        still = [name for name, least in _LATERAL.items() if _still(data, name, least)]
        idle = [name for name in effect.varies_with if name in still]
        if idle:
            dead[effect.name] = f"no run has a {' or '.join(idle).replace('_', ' ')}"
            continue
        missing = effect.unknown(data.points)
        if missing:
            dead[effect.name] = f"{', '.join(missing)} is not measured in every run"
            continue
        try:
            rows = signature(data, model, effect, effect.trials, effect.step)
        except ParameterError as error:
            dead[effect.name] = str(error)
            continue
        own = rows - (rows @ basis) @ basis.T
        if np.sqrt(np.sum(own**2)) < LEAST_SIGNAL:
            varies = f" (it varies with {', '.join(effect.varies_with)})" * bool(effect.varies_with)
            dead[effect.name] = f"changes nothing that this plan could show{varies}"
            continue
        living.append(Candidate(effect, rows, own))
    return Candidates(tuple(living), dead, _angles(living))


_LATERAL = {"slip_angle": 5e-3, "camber": 5e-3, "slip_ratio": 5e-3}
"""What straight free rolling lacks, and the least that counts, [rad], [rad], [-]."""


def _still(data: Data, name: str, least: float) -> bool:
    values = np.nan_to_num(getattr(data.points, name))
    return bool(np.abs(values).max() < least)


def signature(
    data: Data, model: Refit, effect: Effect, trials: Sequence[Strength], size: float
) -> FloatArray:
    """Return the whitened change per trial and range, (n_trials, n_runs * n_phi).

    Parameters
    ----------
    trials : sequence of strength
    size : float
        Of each of them, in the effect's unit.
    """
    rows = []
    for trial in trials:
        state = predict(
            model.values,
            data.points,
            [*model.changes, effect.at(trial)],
            low_pass=data.low_pass,
            correction=model.correction,
        )
        change = (state.wave - model.waveform) * (effect.scale / size)
        rows.append(model.whiten(change).ravel())
    return np.array(rows)


def _angles(living: Sequence[Candidate]) -> FloatArray:
    size = len(living)
    spans = [linalg.orth(candidate.own.T) for candidate in living]
    angles = np.zeros((size, size))
    for i in range(size):
        for j in range(i):
            cosine = np.linalg.svd(spans[i].T @ spans[j], compute_uv=False)[0]
            angles[i, j] = angles[j, i] = np.arccos(min(1.0, float(cosine)))
    return angles
