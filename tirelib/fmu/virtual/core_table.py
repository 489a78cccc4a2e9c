"""The response surface as one array of numbers, which the compiled virtual tire reads."""

from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.fmu.virtual.surface import DEGREE, Surface

FORMAT = 2.0
"""First number of a table: its format."""


def flat_table(surface: Surface) -> FloatArray:
    """Return the surface as ``fmu_src/tire/surface.c`` reads it.

    Sizes (format, gages, inputs, components, grid, points of the interpolation, its monomials),
    then the parts in the order of ``TireSurface``. Coefficients of interpolation and splines are
    solved here, so that the core evaluates only.

    Parameters
    ----------
    surface : Surface
    """
    radial: Any = surface.warm().interpolator  # its coefficients have no public name
    spline = surface.waveforms.spline
    grid, gages, columns = spline.shape
    sizes = [FORMAT, gages, surface.low.size, columns - 1, grid, len(radial.y), len(radial.powers)]
    if radial.powers.max() > DEGREE:
        raise ValueError(f"monomials of degree {radial.powers.max()}; {DEGREE} is known")
    parts = (
        *(sizes, surface.low, surface.high, surface.slip, surface.scales),
        *(radial._shift, radial._scale, radial.powers, radial.y, radial._coeffs),
        *(spline, surface.rolling),
    )
    return np.concatenate([np.asarray(part, dtype=np.float64).ravel() for part in parts])
