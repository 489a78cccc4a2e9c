"""What part of an error noise and what plain tires show explain."""

import numpy as np

from tirelib.inference.compare.error import ModelError
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.plain import BASE


def floor_of(error: ModelError, hypothesis: Hypothesis, alpha: float) -> float:
    """Return the part of an error that noise and what plain tires show explain, in its unit.

    It is all of it unless the hypothesis is rejected; then it is what is left when the model takes
    what the largest standard score is of, and its numbers follow, to first order.

    Parameters
    ----------
    error : ModelError
        The error of the model that the hypothesis describes.
    hypothesis : Hypothesis
    alpha : float
        False-alarm probability.
    """
    if hypothesis.p > alpha or error.whiten is None:
        return error.value
    null, rows = hypothesis.null, hypothesis.fit.rows
    blocks, move = null.view.normal.blocks, null.moved(hypothesis.against)
    taken = sum(
        np.tensordot(move[blocks[name]], rows[name], axes=1) for name in (BASE, hypothesis.against)
    )
    left = error.whiten((error.rest - taken)[None])
    return min(error.value, float(np.sqrt(np.mean(left**2))))
