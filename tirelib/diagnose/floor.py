"""What part of an error noise and what plain tires show explain."""

import numpy as np

from tirelib.compare.error import ModelError
from tirelib.identify.span import span
from tirelib.infer.hypothesis import Hypothesis
from tirelib.infer.plain import BASE


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
    more, _ = hypothesis.null.beside(hypothesis.against)
    rows = hypothesis.fit.rows
    further = np.tensordot(more, rows[hypothesis.against], axes=1)[None]
    taken, *own = error.whiten(np.concatenate([further, rows[BASE]])).reshape(
        1 + len(rows[BASE]), -1
    )
    basis = span(np.array(own).T)
    left = error.whiten(error.rest).ravel() - taken + basis @ (basis.T @ taken)
    return min(error.value, float(np.sqrt(np.mean(left**2))))
