"""Forces of the brush at operating points, with effects that change its state.

An effect of stage brush takes a `BrushState` and returns another; then the forces follow.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.physics.brush.predict import PointConditions, PointForces, PointParameters
from tirelib.physics.brush.shaped import predict_shaped


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


BrushChange = Callable[[BrushState], BrushState]


def brush_state(
    parameters: PointParameters,
    conditions: BrushConditions,
    *,
    reference: tuple[float, float],
    ring_flatness: FloatArray | float = 1.0,
) -> BrushState:
    """Return the base brush at operating points.

    Parameters
    ----------
    parameters : PointParameters
        Each number one for all points or one per point; `sliding_friction` has no part.
    conditions : BrushConditions
    reference : (load, pressure), [N], [Pa]
    ring_flatness : array_like
    """
    n = len(conditions)

    def column(value: Any) -> FloatArray:
        return np.array(np.broadcast_to(np.asarray(value, dtype=np.float64), (n,)))

    p = parameters
    along = p.lateral_stiffness if p.longitudinal_stiffness is None else p.longitudinal_stiffness
    return BrushState(
        conditions,
        *reference,
        c_py=column(p.lateral_stiffness),
        c_px=column(along),
        mu=column(p.friction),
        a=column(p.half_length),
        flatness=np.zeros(n),
        ring_flatness=column(ring_flatness),
        camber_thrust=column(p.camber_thrust),
        slip_angle=conditions.slip_angle + column(p.slip_angle_offset),
        slip_ratio=conditions.slip_ratio + column(p.slip_ratio_offset),
        Fx_offset=column(p.Fx_offset),
        Fy_offset=column(p.Fy_offset),
        Mz_offset=column(p.Mz_offset),
        yaw_compliance=column(p.yaw_compliance),
        lateral_compliance=column(p.lateral_compliance),
    )


def brush_forces(state: BrushState, changes: Sequence[tuple[str, BrushChange]] = ()) -> PointForces:
    """Return the forces of a state after changes, which act in their order.

    Parameters
    ----------
    state : BrushState
    changes : sequence of (hook, change)
        As `Effect.at` gives them; those of other hooks than brush have no part.

    Raises
    ------
    ParameterError, ConvergenceError
        From the effects and the brush.
    """
    for hook, change in changes:
        if hook == "brush":
            state = change(state)
    at = state.conditions
    parameters = PointParameters(
        lateral_stiffness=state.c_py,
        longitudinal_stiffness=state.c_px,
        friction=state.mu,
        half_length=state.a,
        camber_thrust=state.camber_thrust,
        Fx_offset=state.Fx_offset,
        Fy_offset=state.Fy_offset,
        Mz_offset=state.Mz_offset,
        yaw_compliance=state.yaw_compliance,
        lateral_compliance=state.lateral_compliance,
    )
    seen = PointConditions(at.load, state.slip_angle, state.slip_ratio, at.camber)
    return predict_shaped(parameters, seen, state.flatness)
