"""Radial tread springs between belt and road, Eq. (48), (78), (80).

The tread's outer surface has the free radius; the road lies at the loaded radius. Along the radius
through phi the road leaves the tread the compression

    delta(phi) = d0 - R0 (1 - cos phi) + u(phi),

with the deflection d0 under the axle and the belt's outward displacement u. The tread answers with
an inward pressure q = k_t delta (1 + c delta / h), c its hardening; it can only push.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire


def numbers(where: str, value: Any, name: str) -> FloatArray:
    """Return an array of floats, or refuse the value."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"{where}: {name} is {value!r:.60}; a number or an array of numbers in SI units is "
            "needed; convert texts and fill gaps first"
        ) from error


@dataclass(frozen=True, slots=True)
class Tread:
    """Constants of the tread, one value per operating point (or one for all).

    Attributes
    ----------
    free_radius : [m]
        R0, of the unloaded tire.
    normal_stiffness : [N/m^2]
        k_t per length of circumference.
    thickness : [m]
        h, of the rubber between belt and road.
    hardening : [-]
        c: relative growth of the stiffness when the whole thickness is pressed; 0 is linear.
    """

    free_radius: float | FloatArray
    normal_stiffness: float | FloatArray
    thickness: float | FloatArray = 0.0125
    hardening: float | FloatArray = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = numbers("tread", getattr(self, field.name), field.name)
            zero = field.name == "hardening"
            good = np.isfinite(value) & ((value >= 0) if zero else (value > 0))
            if not good.all():
                raise ParameterError(
                    f"tread: {field.name} = {value[~good].flat[0] if value.ndim else value:.6g}; "
                    f"a finite number {'>=' if zero else '>'} 0 is needed; check the tire's value"
                )

    @classmethod
    def of(cls, tire: Tire) -> "Tread":
        """Return the tread of a tire."""
        return cls(
            tire.free_radius, tire.tread_stiffness, tire.tread_thickness, tire.tread_hardening
        )

    def __len__(self) -> int:
        return max(np.size(getattr(self, field.name)) for field in fields(self))

    def spread(self, n_points: int) -> "Tread":
        """Return the tread with one value per point in every field."""
        return self._with(lambda value: np.broadcast_to(value, (n_points,)))

    def take(self, index: IntArray | slice) -> "Tread":
        """Return the tread of some points (of a tread with one value per point)."""
        return self._with(lambda value: np.asarray(value)[index])

    def _with(self, change: Callable[[float | FloatArray], FloatArray]) -> "Tread":
        """Return the tread with every field rearranged; its numbers are checked already."""
        out = object.__new__(Tread)
        for name in _NAMES:
            object.__setattr__(out, name, change(getattr(self, name)))
        return out

    @property
    def linear(self) -> bool:
        """Whether the stiffness does not depend on the compression."""
        return not np.any(self.hardening)

    def force(self, compression: FloatArray) -> FloatArray:
        """Return q for compressions (n_points, ...), [N/m], as if the tread could pull."""
        k, s = self._columns(compression.ndim)
        q: FloatArray = k * compression * (1.0 + s * np.maximum(compression, 0.0))
        return q

    def pressure(self, compression: FloatArray) -> FloatArray:
        """Return q, [N/m]; zero where the tread is off the road."""
        return self.force(np.maximum(compression, 0.0))

    def tangent(self, compression: FloatArray) -> FloatArray:
        """Return dq/ddelta of the pressed tread, [N/m^2]."""
        k, s = self._columns(compression.ndim)
        t: FloatArray = k * (1.0 + 2.0 * s * np.maximum(compression, 0.0))
        return t

    def _columns(self, ndim: int) -> tuple[FloatArray, FloatArray]:
        shape = (-1, *([1] * (ndim - 1)))
        k = np.reshape(np.asarray(self.normal_stiffness, dtype=float), shape)
        s = np.reshape(np.asarray(self.hardening / np.asarray(self.thickness), dtype=float), shape)
        return k, s


_NAMES = tuple(field.name for field in fields(Tread))
