"""Length of the contact from the angle that is read between the strain-rate peaks.

The belt bends before it leaves the road, so the strain rate peaks inside the true edges: the angle
read is too short by `BIAS`, less where the contact is so short that both edges run into each other.
The length is the angle times the effective rolling radius, which holds under slip as well.

The correction is that of the rig's tires (`reference`, `soft` and `stiff` over the plans `set1` and
`set3`): 1.7 mm rms are left of 4,440 lengths. Nobody measures a length of contact on a road, so it
is not fitted to a tire. ``python build/signal_constants.py`` fits the constants anew, tire by tire,
and shows half and double of each; ``docs/theory/signal_numbers.md`` has the table.
"""

import numpy as np

from tirelib.core.arrays import FloatArray

BIAS = 0.051
"""True less read contact angle, [rad]."""
MIDDLE, WIDTH = 0.167, 0.023
"""Angle read at which half of it is seen, and over which it comes in, [rad]."""
LEAST_STD = 0.0075
"""Standard deviation of a corrected angle of a long contact, [rad]."""
SHORT_STD, SHORT_WIDTH = 0.04, 0.15
"""What a short contact adds: at an angle of 0, and the angle over which that falls by e, [rad]."""


def contact_lengths(
    angle: FloatArray, radius: FloatArray, angle_std: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return corrected contact lengths and their standard deviation, each shape (n, g), [m].

    Parameters
    ----------
    angle : array, shape (n, g), [rad]
        Contact angles read at the gages.
    radius : array, shape (n,), [m]
        Effective rolling radius.
    angle_std : array, shape (n,), [1]
        Relative standard deviation of the turn's angles.

    Examples
    --------
    >>> length, std = contact_lengths(np.array([[0.4]]), np.array([0.31]), np.zeros(1))
    >>> float(length[0, 0].round(4)), float(std[0, 0].round(4))
    (0.1398, 0.0025)
    """
    true = angle + BIAS / (1.0 + np.exp((MIDDLE - angle) / WIDTH))
    read = np.hypot(LEAST_STD, SHORT_STD * np.exp(-angle / SHORT_WIDTH))
    std = np.hypot(read, angle * angle_std[:, None])
    return true * radius[:, None], std * radius[:, None]
