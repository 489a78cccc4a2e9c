"""Whether a rival explains the runs so much better that a hypothesis cannot be right.

Two hypotheses of as many effects may both leave nothing that stands out: the error that a law may
have covers what another law explains. Their likelihood ratio tells them apart (Cox, Proc. 4th
Berkeley Symp. 1 (1961) 105). Were the likelihoods exact, a ratio of 1/p in favour of the rival
would have at most the probability p where the hypothesis is true (Royall, Statistical Evidence,
1997). They are not, so plain tires with the hypothesis planted in the user's plan have to agree,
each tire with the likelihoods that families other than its own give it. All of it is of first order
about the two fits.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.statistics.hypothesis import Hypothesis, plain_tires, products
from tirelib.inference.statistics.law_errors import law_errors
from tirelib.inference.statistics.plain import BASE, Family
from tirelib.inference.statistics.posterior import Posterior
from tirelib.inference.statistics.problem import Problem


def p_against(problem: Problem, hypothesis: Hypothesis, rival: Hypothesis) -> float:
    """Return the p-value of the likelihood ratio in favour of a rival.

    The inverse of the ratio, or, if that is larger, the share of a family's tires, with the
    hypothesis planted, in which the rival gains as much or more; the largest over the families.
    What is measured and the tires are weighed by the same laws and the same families.
    """
    ratio = max(rival.likelihood - hypothesis.likelihood, 0.0)
    fit = hypothesis.fit
    modelled = fit.rest - np.tensordot(_coordinates(fit), fit.rows[BASE], axes=1)
    view = hypothesis.null.view
    laws, own = law_errors(fit, hypothesis.errors), view.own
    p = [float(np.exp(-ratio))]
    for family in (null.family for null in hypothesis.nulls):
        # what is measured where the hypothesis is true, less what is measured; first nothing
        moved = plain_tires(problem, fit, family, laws, own) - modelled
        moved = np.concatenate([np.zeros((1, *fit.rest.shape)), moved])
        measured, *gains = _likelihood(problem, rival, family, moved) - _likelihood(
            problem, hypothesis, family, moved
        )
        p.append((1 + int(np.sum(np.array(gains) >= measured))) / (len(gains) + 1))
    return max(p)


def _likelihood(
    problem: Problem, hypothesis: Hypothesis, family: Family, moved: FloatArray
) -> FloatArray:
    """Return the log likelihood by the families but one of the runs moved by waveforms, (k,)."""
    others = [null for null in hypothesis.nulls if null.family is not family]
    turned = products(problem, hypothesis.null.view, hypothesis.fit.rest + moved)
    return np.asarray(np.max([null.likelihood_of(turned) for null in others], axis=0))


def _coordinates(fit: Posterior) -> FloatArray:
    """Return the coordinates of the base and of the model's effects."""
    return fit.point.coordinates[: len(fit.rows[BASE])]
