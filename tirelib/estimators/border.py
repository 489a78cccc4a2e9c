r"""Where the data of a calibration end, and how the variance grows beyond.

The variance that uncertain coefficients leave in a value, :math:`u = x^T C x` (the leverage), says
how far a turn lies from everything that was calibrated, in all regressors at once: a combination
that was never measured has a large one even where each regressor lies in its range (Montgomery,
Peck and Vining, *Introduction to Linear Regression Analysis*, "hidden extrapolation").

It is too small beyond the data, because there the form of the polynomial errs as well. The variance
grows as

.. math:: u + g\,\max(u - u_{near}, 0),

with the growth g that data left out at the ends of the calibration show
(`tirelib.estimators.ends`). Predicting needs numpy only.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Border:
    """Where the calibrated data of a polynomial end, and what is lost beyond.

    Attributes
    ----------
    near : float, unit of y squared
        Leverage up to which a turn lies among the data.
    growth : float
        Further variance for each unit of leverage beyond `near`.
    far : float, unit of y squared
        Leverage of nearly every condition, or load between others, that was held out. Nothing was
        checked beyond.
    """

    near: float
    growth: float
    far: float

    def grown(self, uncertain: FloatArray) -> FloatArray:
        """Return the variance at a leverage, shape (n,), unit of y squared.

        Examples
        --------
        >>> Border(near=1.0, growth=3.0, far=4.0).grown(np.array([0.5, 1.0, 2.0])).tolist()
        [0.5, 1.0, 5.0]
        """
        return uncertain + self.growth * np.maximum(uncertain - self.near, 0.0)
