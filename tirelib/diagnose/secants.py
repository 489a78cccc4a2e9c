"""Effects whose change is not in proportion to their strength: taken as far as a residual asks.

A gage's length or a belt's shear changes short waves much and then no more: a small step at zero
tells the wrong shape of a large effect. Where an effect alone would take away much, its row is the
whole change at the strength at which it would do so, over that strength.
"""

from dataclasses import replace

import numpy as np
from scipy import optimize

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidate, Candidates, signature
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.structure import Structure
from tirelib.errors import TirelibError
from tirelib.identify.waveform_fit import Data

MUCH = 0.1
"""Share of the squared residual that an effect alone has to take away."""
SMALL = 0.05
"""Strength, in ranges, up to which a tangent serves."""
BEYOND = 2.0
"""Ranges up to which an effect is followed."""
ALIKE = 0.99
"""Cosine between two shapes that are the same."""
CLOSE = 0.02
"""Of the strength that is found, as a part of the largest."""


def with_secants(data: Data, model: Refit, found: Candidates, structure: Structure) -> Candidates:
    """Return the candidates, those that take away much by their change at that strength.

    Parameters
    ----------
    data : Data
    model : Refit
    found : Candidates
        With tangents at zero.
    structure : Structure
        Knows what the fitted numbers can do, which is no effect's.
    """
    rest = structure.projected(model.whiten(data.strain - model.waveform).ravel())
    living = tuple(_followed(data, model, each, structure, rest) for each in found.living)
    return replace(found, living=living)


def _followed(
    data: Data, model: Refit, candidate: Candidate, structure: Structure, rest: FloatArray
) -> Candidate:
    """Return a candidate with its change at the strength that a residual asks for."""
    effect, tangent = candidate.effect, candidate.own[0]
    if effect.components > 1:
        return candidate
    share = float(tangent @ rest) / float(tangent @ tangent)
    end = BEYOND * (effect.high if share > 0.0 else effect.low)
    if share * float(tangent @ rest) < MUCH * float(rest @ rest) or end == 0.0:
        return candidate
    whole: dict[float, tuple[FloatArray, FloatArray]] = {}

    def left(part: float) -> float:
        """Return the squares that the whole change at a part of the way to the end leaves."""
        strength = part * end
        try:
            rows = signature(data, model, effect, [strength], effect.scale)
        except TirelibError:  # at that strength there is no tire
            return np.inf
        whole[part] = rows, structure.projected(rows)
        return float(np.sum((rest - whole[part][1]) ** 2))

    start = min(share * effect.scale / end, 1.0)
    if start * abs(end) < SMALL * effect.scale or not np.isfinite(left(start)):
        return candidate
    if _cosine(whole[start][1][0], tangent) > ALIKE:
        return candidate
    best = float(optimize.minimize_scalar(left, bounds=(0.0, 1.0), options={"xatol": CLOSE}).x)
    if best not in whole or best * abs(end) < SMALL * effect.scale:
        return candidate
    rows, own = whole[best]
    ranges = best * end / effect.scale
    return replace(candidate, rows=rows / ranges, own=own / ranges)


def _cosine(a: FloatArray, b: FloatArray) -> float:
    return float(a @ b) / float(np.linalg.norm(a) * np.linalg.norm(b))
