"""The type in which the measured and the modelled chain meet: strain over wheel angle."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ShapeError


@dataclass(frozen=True, slots=True)
class TraceConditions:
    """Operating conditions, one value per trace; NaN where unknown.

    Axes: ISO 8855. All arrays have shape (n_traces,).

    Attributes
    ----------
    omega : [rad/s]
        Turn rate of the wheel.
    speed : [m/s]
        Travel speed.
    pressure : [Pa]
        Inflation pressure (gauge).
    camber : [rad]
        Inclination of the wheel plane.
    """

    omega: FloatArray
    speed: FloatArray
    pressure: FloatArray
    camber: FloatArray

    def __post_init__(self) -> None:
        shapes = {
            name: getattr(self, name).shape for name in ("omega", "speed", "pressure", "camber")
        }
        if len(set(shapes.values())) != 1:
            raise ShapeError(f"conditions differ in shape: {shapes}; all need (n_traces,)")


@dataclass(frozen=True, slots=True)
class StrainTrace:
    """Strain of several gages over wheel angle, for several turns or operating points.

    Wheel angle grows with time at a given gage; the leading edge is at negative, the trailing edge
    at positive angle. Strain is positive in tension and free of the gage's offset.

    Attributes
    ----------
    phi : shape (n_phi,), [rad]
        Wheel angle, uniform grid. Zero is the middle of the centre gage's contact pulse; add
        `axis_shift` for the angle from the wheel axis' normal.
    strain : shape (n_traces, n_gages, n_phi), [-]
        NaN where unknown.
    rate : shape (n_traces, n_gages, n_phi), [1/rad]
        Slope of strain over wheel angle.
    pulse : shape (n_traces,), [rad]
        Half-width of the centre gage's contact pulse.
    lateral : shape (n_gages,), [m]
        Lateral gage position, ISO (left positive).
    axis_shift : shape (n_traces,), [rad]
        Wheel angle of the pulse's middle, from a trigger; NaN where unknown.
    conditions : TraceConditions
    """

    phi: FloatArray
    strain: FloatArray
    rate: FloatArray
    pulse: FloatArray
    lateral: FloatArray
    axis_shift: FloatArray
    conditions: TraceConditions

    def __post_init__(self) -> None:
        wanted = (self.pulse.shape[0], self.lateral.shape[0], self.phi.shape[0])
        for name in ("strain", "rate"):
            given = getattr(self, name).shape
            if given != wanted:
                raise ShapeError(
                    f"{name} has shape {given}; (n_traces, n_gages, n_phi) = {wanted} is needed"
                )

    def __len__(self) -> int:
        return int(self.pulse.shape[0])

    @property
    def spacing(self) -> float:
        """Step of the angle grid, [rad]."""
        return float(self.phi[1] - self.phi[0])

    @property
    def centre_gage(self) -> int:
        """Index of the gage nearest to the equator."""
        return int(np.argmin(np.abs(self.lateral)))
