"""What part of a force's error noise and the structure of the brush explain.

With V the residuals of m measured variants that lack no
effect and s the noise, the best linear prediction of a residual r by structure is

    V' (V V' + m s^2 I)^-1 V r,

and the floor is the rms of r without what the rest of it exceeds the noise by, and no more than 19
of 20 variants leave.
"""

import numpy as np
from scipy import linalg

from tirelib.arrays import FloatArray
from tirelib.diagnose.forces.fit import ForceFit, Problem

SIZE = 0.95
"""Share of the variants whose size still counts as the brush's: one less the false-alarm rate."""


def force_floor(problem: Problem, fit: ForceFit, rests: FloatArray, noise: float) -> float:
    """Return the part of a fitted brush's rms that noise and structure explain, SI.

    Parameters
    ----------
    problem : Problem
    fit : ForceFit
    rests : shape (n_members, n)
        Residuals of variants over the problem's scale.
    noise : float, [N] or [N m]
        Of a point; NaN without repeats.

    Returns
    -------
    float
        NaN without repeats or variants.
    """
    if not np.isfinite(noise) or not len(rests):
        return float("nan")
    left = (problem.measured - fit.predicted) / problem.scale
    level = (noise / problem.scale) ** 2
    inner = rests @ rests.T + len(rests) * level * np.eye(len(rests))
    beyond = left - rests.T @ linalg.solve(inner, rests @ left, assume_a="pos")
    excess = max(float(np.mean(beyond**2)) - level, 0.0)
    usual = float(np.quantile(np.mean(rests**2, axis=1), SIZE))
    return problem.scale * float(np.sqrt(min(max(float(np.mean(left**2)) - excess, 0.0), usual)))
