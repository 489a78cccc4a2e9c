r"""What a gage on the innerliner shows.

The belt's section turns by psi, its line by psi + gamma, gamma the shear. Sections of belt and
liner stay plane only as far as the shear force takes hold of them: the liner below the belt carries
none, so that its fibres turn with the line. With the share s of the gage's lever that lies there

.. math:: \varepsilon = \frac{R\,\Gamma_1 - y\,(\psi' + s\,\gamma')}{R + y}.

Shear that is spread over a homogeneous belt of thickness t as a parabola gives
s = 1 - 5 t / (12 |y|).

The tread spreads the road's pressure over its own thickness before the belt feels it. In a ring
that is linear, each harmonic n of the pressure, and with it of the strain, is less by

.. math:: \exp(-(n \sigma / R)^2 / 2)

with the standard deviation :math:`\sigma` of what a line load becomes below the tread. Here the
strain alone is spread: pressure and length of the contact are those of a tread that stands like a
brush.

Sources: Reddy, J. Appl. Mech. 51 (1984), for the parabola; Murakami, J. Appl. Mech. 53 (1986), for
layers that shear one more than the other.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.physics.rolling import belt
from tirelib.physics.rolling.constants import Constants
from tirelib.physics.rolling.mesh import to_grid, to_grid_slope


@dataclass(frozen=True, slots=True, eq=False)
class Gage:
    """Where a gage sits at every operating point.

    Attributes
    ----------
    offset : shape (n_points,), [m]
        y < 0 from the neutral line.
    liner : shape (n_points,), [-]
        Share of the offset that lies in layers which carry no shear force.
    spread : shape (n_points,), [m]
        sigma over which the tread spreads the pressure.
    """

    offset: FloatArray
    liner: FloatArray
    spread: FloatArray


def same_place(a: Gage, b: Gage) -> bool:
    """Return whether two gages sit alike."""
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in Gage.__slots__)


def strain(z: FloatArray, k: Constants, gage: Gage, size: tuple[int, int], n: int) -> FloatArray:
    """Return the strain at gages over n angles from -pi, (n_points, n).

    Parameters
    ----------
    z : shape (6, n_points, n_elements, n_gauss)
        Fields of the belt at its points.
    k : Constants
    gage : Gage
    size : (fine, coarse)
        Numbers of elements in the mesh.
    """
    turned = belt.shear_angle(z, k) if gage.liner.any() else None
    return _on_turn(belt.strain(z, k, gage.offset), turned, k, gage, size, n)


def strain_along(
    z: FloatArray, dz: FloatArray, k: Constants, gage: Gage, size: tuple[int, int], n: int
) -> FloatArray:
    """Return how the strain moves as the fields move, (n_directions, n_points, n).

    Parameters are those of `strain`, and dz of shape (n_directions, 6, n_points, ...).
    """
    stretch, turned = belt.gage_slopes(z, dz, k, gage.offset)
    return _on_turn(stretch, turned if gage.liner.any() else None, k, gage, size, n)


def _on_turn(
    stretch: FloatArray,
    turned: FloatArray | None,
    k: Constants,
    gage: Gage,
    size: tuple[int, int],
    n: int,
) -> FloatArray:
    """Return the gage's strain for values (..., n_points, n_elements, n_gauss) at the belt."""
    shape = stretch.shape[:-2]
    out: FloatArray = stretch.reshape(*shape, -1) @ to_grid(*size, n).T
    if turned is not None:
        lever = gage.liner * gage.offset / (k.radius + gage.offset)
        out -= lever[:, None] * (turned.reshape(*shape, -1) @ to_grid_slope(*size, n).T)
    if gage.spread.any():
        order = np.fft.rfftfreq(n, 1.0 / n)
        gain = np.exp(-0.5 * ((gage.spread / k.radius)[:, None] * order) ** 2)
        out = np.fft.irfft(np.fft.rfft(out) * gain, n=n)
    return out
