"""What part of a force's error noise and what plain tires show explain."""

import numpy as np

from tirelib.inference.diagnose.forces.fit import ForceFit, MeasuredForce
from tirelib.inference.identify.span import span
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.null import PRIOR
from tirelib.inference.statistics.plain import BASE, ROUGHLY


def force_floor(
    problem: MeasuredForce, fit: ForceFit, hypothesis: Hypothesis, alpha: float
) -> float:
    """Return the part of a fitted brush's rms that noise and what plain tires show explain, SI.

    It is all of it unless the hypothesis is rejected; then it is what is left when the model takes
    what stands out most, and laws of its effects that are off by as much as themselves.

    Parameters
    ----------
    problem : MeasuredForce
    fit : ForceFit
    hypothesis : Hypothesis
        That the fit's effects and no other are there.
    alpha : float
        False-alarm probability.
    """
    if hypothesis.p > alpha:
        return fit.error
    blocks = hypothesis.fit.rows
    more = [rows for name, rows in blocks.items() if name.startswith(ROUGHLY)]
    if not hypothesis.against.startswith(ROUGHLY):
        more.append(PRIOR * blocks[hypothesis.against])
    basis = span(blocks[BASE].T)
    rows = np.concatenate(more) / problem.scale
    rows = rows - (rows @ basis) @ basis.T
    left = (problem.measured - fit.predicted) / problem.scale
    taken = np.linalg.solve(rows @ rows.T + np.eye(len(rows)), rows @ left) @ rows
    return min(fit.error, problem.scale * float(np.sqrt(np.mean((left - taken) ** 2))))
