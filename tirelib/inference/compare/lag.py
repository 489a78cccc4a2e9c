"""The common delay of the gages against the trigger, counted out of a comparison.

It is a number of the day (`tirelib.inference.identify.delay`), neither the tire's nor the model's,
so it is fitted to the waveforms beside the set points and taken as part of what the model predicts.
Damping of the sidewall or sliding comes late as well: a little of them goes with it.
"""

from dataclasses import replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.compare.model import Prediction
from tirelib.inference.identify.delay import STD, UNIT, by_delay, earlier
from tirelib.inference.identify.random_effects import Whitening, angle_slope

PASSES = 3
SEEN = 3.0
"""Standard deviations of a delay from which it is reported."""


def fitted_delay(
    measured: FloatArray,
    predicted: FloatArray,
    omega: FloatArray,
    whiten: Whitening,
    independent: float,
) -> tuple[float, float]:
    """Return the delay [s] and its standard deviation, by what of it goes with the speed.

    A zero of the wheel angle that is the same in all runs stands beside it, free: at one speed it
    is all, and no delay is reported.

    Parameters
    ----------
    measured, predicted : shape (n_runs, n_phi), [-]
    omega : shape (n_runs,), [rad/s]
    whiten : Whitening
        By set points and what a good model leaves.
    independent : float
        Samples in a turn of what is left that tell something of their own.
    """
    delay, information = 0.0, np.eye(2)
    share = independent / measured.shape[1]
    prior = np.array([(UNIT / STD) ** 2, 0.0])
    for _ in range(PASSES):
        late = earlier(predicted, omega, -delay)
        slopes = np.stack([by_delay(late, omega), angle_slope(late)])
        rows = whiten(slopes).reshape(2, -1)
        rest = whiten(measured - late).ravel()
        information = share * rows @ rows.T + np.diag(prior)
        # the prior holds the whole delay near zero, not the step
        gain = share * rows @ rest - prior * np.array([delay / UNIT, 0.0])
        delay += UNIT * float(np.linalg.solve(information, gain)[0])
    return delay, UNIT * float(np.sqrt(np.linalg.inv(information)[0, 0]))


def late_prediction(prediction: Prediction, omega: FloatArray, delay: float) -> Prediction:
    """Return what gages that come later by a delay show."""

    def late(waves: FloatArray) -> FloatArray:
        return earlier(waves, omega, -delay)

    gages = prediction.gages
    return replace(
        prediction,
        strain=late(prediction.strain),
        gages=np.stack([late(gages[:, k]) for k in range(gages.shape[1])], axis=1),
        by_load=late(prediction.by_load),
        by_pressure=late(prediction.by_pressure),
    )


def lag_message(delay: float, std: float, omega: FloatArray) -> tuple[str, ...]:
    """Say a delay that is more than chance."""
    if abs(delay) < SEEN * std:
        return ()
    side = "after" if delay > 0.0 else "before"
    turn = np.rad2deg(abs(delay) * float(np.max(np.abs(omega))))
    return (
        f"The gages come {1e6 * abs(delay):.0f} microseconds {side} the trigger in all runs "
        f"({turn:.2g} deg of the wheel in the fastest): it is counted out of all errors. Effects "
        "that act late as well are weighed against it by `tirelib diagnose`.",
    )
