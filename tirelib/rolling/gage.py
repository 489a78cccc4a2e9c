r"""What a gage on the innerliner shows.

The belt's section turns by psi, its line by psi + gamma, gamma the shear. Sections of belt and
liner stay plane only as far as the shear force takes hold of them: the liner below the belt carries
none, so that its fibres turn with the line. With the share s of the gage's lever that lies there

.. math:: \varepsilon = \frac{R\,\Gamma_1 - y\,(\psi' + s\,\gamma')}{R + y}.

Shear that is spread over a homogeneous belt of thickness t as a parabola gives
s = 1 - 5 t / (12 |y|).

Sources: Reddy, J. Appl. Mech. 51 (1984), for the parabola; Murakami, J. Appl. Mech. 53 (1986), for
layers that shear one more than the other.
"""

from dataclasses import dataclass

from tirelib.arrays import FloatArray
from tirelib.rolling import belt
from tirelib.rolling.constants import Constants
from tirelib.rolling.mesh import to_grid, to_grid_slope


@dataclass(frozen=True, slots=True, eq=False)
class Gage:
    """Where a gage sits at every operating point.

    Attributes
    ----------
    offset : shape (n_points,), [m]
        y < 0 from the neutral line.
    liner : shape (n_points,), [-]
        Share of the offset that lies in layers which carry no shear force.
    """

    offset: FloatArray
    liner: FloatArray


def strain(z: FloatArray, k: Constants, gage: Gage, size: tuple[int, int], n: int) -> FloatArray:
    """Return the strain at gages over n angles from -pi, (n_points, n).

    Parameters
    ----------
    z : shape (6, n_points, n_elements, n_gauss)
        Fields of the belt at its points.
    k : Constants
    gage : Gage
    size : (fine, coarse)
        Of the mesh.
    """
    rows = len(k)
    out: FloatArray = belt.strain(z, k, gage.offset).reshape(rows, -1) @ to_grid(*size, n).T
    if not gage.liner.any():
        return out
    turned = belt.shear_angle(z, k).reshape(rows, -1) @ to_grid_slope(*size, n).T
    lever = gage.liner * gage.offset / (k.radius + gage.offset)
    return out - lever[:, None] * turned
