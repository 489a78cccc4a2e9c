"""What each effect would change, what the brush can mimic of it, and who looks alike.

All of this follows from the plan and the model, before any residual is looked at. What the base
brush fits itself: stiffness, friction and the offsets of slip and force; the contact length's law
over load stays as the model has it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from tirelib.arrays import FloatArray
from tirelib.diagnose.diagnose import TWIN_ANGLE
from tirelib.diagnose.forces.fit import ForceFit, Problem
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.infer.forces import LEAST_OWN, LEAST_SIGNAL, blind


@dataclass(frozen=True, slots=True, eq=False)
class ForceCandidate:
    """One effect that the model lacks.

    Attributes
    ----------
    effect : Effect
    rows : shape (components, n)
        Scaled change for a strength of one range, per component.
    own : shape (components, n)
        What of it the fitted coordinates cannot mimic.
    """

    effect: Effect
    rows: FloatArray
    own: FloatArray

    @property
    def signal(self) -> float:
        """Norm of the own part at the end of the range."""
        return float(np.sqrt(np.sum(self.own**2)))


@dataclass(frozen=True, slots=True, eq=False)
class ForceCandidates:
    """The living candidates, and why the others are dead.

    Attributes
    ----------
    living : tuple of ForceCandidate
    dead : mapping of name to reason
    angles : shape (n, n), [rad]
        Smallest principal angle between own signatures.
    """

    living: tuple[ForceCandidate, ...]
    dead: dict[str, str]
    angles: FloatArray

    @property
    def names(self) -> list[str]:
        """Names of the living."""
        return [candidate.effect.name for candidate in self.living]

    def twins(self, index: int) -> list[tuple[str, float]]:
        """Return effects whose signature is near, with the angle [rad], nearest first."""
        found = [
            (self.living[j].effect.name, float(angle))
            for j, angle in enumerate(self.angles[index])
            if j != index and angle < TWIN_ANGLE
        ]
        return sorted(found, key=lambda pair: pair[1])


def force_candidates(
    problem: Problem, model: ForceFit, catalogue: Sequence[Effect]
) -> ForceCandidates:
    """Return what every effect of stage brush would change, at the fitted model.

    Effects that the model has are left out.
    """
    has = {effect.name for effect in model.effects}
    basis = np.linalg.qr((model.slopes / problem.scale).T)[0]
    living: list[ForceCandidate] = []
    dead: dict[str, str] = {}
    for effect in catalogue:
        if effect.hook != "brush" or effect.name in has:
            continue
        reason = blind(problem.bench.conditions, effect)
        if reason:
            dead[effect.name] = reason
            continue
        try:
            rows = _tangents(problem, model, effect)
        except TirelibError as error:
            dead[effect.name] = f"cannot be computed at these conditions: {error}"
            continue
        own = rows - (rows @ basis) @ basis.T
        candidate = ForceCandidate(effect, rows, own)
        if np.sqrt(np.sum(rows**2)) < LEAST_SIGNAL:
            dead[effect.name] = f"changes {problem.quantity} at no point by more than noise"
        elif np.sqrt(np.sum(own**2)) < max(LEAST_SIGNAL, LEAST_OWN * np.sqrt(np.sum(rows**2))):
            dead[effect.name] = (
                "the brush's own parameters change the force alike at these conditions"
                + _with_range(effect)
            )
        else:
            living.append(candidate)
    return ForceCandidates(tuple(living), dead, _angles(living))


def _with_range(effect: Effect) -> str:
    if effect.name == "ply_steer":
        return ": the tire rolls one way only, where it is a shift of the slip angle"
    return ""


def _tangents(problem: Problem, model: ForceFit, effect: Effect) -> FloatArray:
    """Return scaled derivatives at zero strength times the range, one row per component."""
    base = model.predicted
    rows = []
    for trial in effect.trials:
        moved = problem.predict(model.values, [*model.changes, effect.at(trial)])
        rows.append((moved - base) * (effect.scale / effect.step / problem.scale))
    return np.stack(rows)


def _angles(living: Sequence[ForceCandidate]) -> FloatArray:
    n = len(living)
    out = np.full((n, n), 0.5 * np.pi)
    for i in range(n):
        for j in range(i):
            angle = linalg.subspace_angles(living[i].own.T, living[j].own.T).min()
            out[i, j] = out[j, i] = float(angle)
    return out
