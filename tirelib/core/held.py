"""Conditions that are held while samples are taken: one list for batch, stream, FMU and bench.

A condition that is added here, to `Turn` and to the inputs of the FMU reaches an estimate from
every source: a campaign's rig channels, frames of a stream, an FMU's inputs, the bench's options,
files and buses.
"""

from typing import TypedDict

from tirelib.core.arrays import FloatArray


class Held(TypedDict, total=False):
    """Conditions beside the strain, SI, ISO 8855; each is held until changed, NaN where unknown.

    An array has a value for each sample.
    """

    speed: FloatArray | float
    """Travel speed, [m/s]."""
    pressure: FloatArray | float
    """Inflation pressure (gauge), [Pa]."""
    camber: FloatArray | float
    """Inclination of the wheel plane, [rad]."""
    omega: FloatArray | float
    """Measured turn rate of the wheel, [rad/s]."""
    friction: FloatArray | float
    """Coefficient of friction between tread and road, [1]."""
    tread_depth: FloatArray | float
    """Depth of the tread's grooves that is left, [m]."""
    tread_temperature: FloatArray | float
    """Temperature of the tread's rubber, [K]."""


HELD = tuple(Held.__annotations__)
"""Names of the conditions in their order: rows of a buffer, inputs of an FMU, columns of a file."""
