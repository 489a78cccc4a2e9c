"""State of a brush at every operating point, on the way from tire to forces.

An effect of stage brush takes a state and a strength and returns a changed state
(`BrushState.but`); it never changes its argument.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

from tirelib.core.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class BrushConditions:
    """Operating points of the brush, arrays of shape (n,), SI, ISO; NaN where unknown.

    Attributes
    ----------
    load, pressure : [N], [Pa]
    slip_angle, slip_ratio, camber : [rad], [-], [rad]
    speed : [m/s]
        Speed of the road under the wheel; negative where the tire rolls the other way round.
    temperature : [K]
        Temperature of the tread.
    slip_rate : [rad/s]
        Rate of the slip angle; zero in steady runs.
    order : [-]
        Place in the campaign, 0 first to 1 last.
    """

    load: FloatArray
    pressure: FloatArray
    slip_angle: FloatArray
    slip_ratio: FloatArray
    camber: FloatArray
    speed: FloatArray
    temperature: FloatArray
    slip_rate: FloatArray
    order: FloatArray

    def __len__(self) -> int:
        return int(self.load.size)

    def take(self, chosen: IntArray | BoolArray) -> "BrushConditions":
        """Return some of the points."""
        return BrushConditions(*(getattr(self, field.name)[chosen] for field in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class BrushState:
    """The brush at operating points; arrays of shape (n,), SI, ISO.

    Attributes
    ----------
    conditions : BrushConditions
    reference_load, reference_pressure : float, [N], [Pa]
        At which laws of load and pressure change nothing.
    c_py, c_px : [N/m^2]
        Bristle stiffness across and along.
    mu : [-]
    a : [m]
        Half the contact length.
    flatness, ring_flatness : [-]
        Flatness of the pressure (`tirelib.physics.brush.shaped`): as it is, and that of the tire's
        ring; 1 where no ring is known.
    camber_thrust : [-]
        Slip angle that a radian of camber is worth.
    slip_angle, slip_ratio : [rad], [-]
        That the bristles see, without camber.
    Fx_offset, Fy_offset, Mz_offset : [N], [N], [N m]
    yaw_compliance, lateral_compliance : [rad/(N m)], [m/N]
    """

    conditions: BrushConditions
    reference_load: float
    reference_pressure: float
    c_py: FloatArray
    c_px: FloatArray
    mu: FloatArray
    a: FloatArray
    flatness: FloatArray
    ring_flatness: FloatArray
    camber_thrust: FloatArray
    slip_angle: FloatArray
    slip_ratio: FloatArray
    Fx_offset: FloatArray
    Fy_offset: FloatArray
    Mz_offset: FloatArray
    yaw_compliance: FloatArray
    lateral_compliance: FloatArray

    def but(self, **values: Any) -> "BrushState":
        """Return the state with some fields replaced."""
        return replace(self, **values)
