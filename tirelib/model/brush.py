"""Forces of the brush at operating points, with effects that change its state.

An effect of stage brush takes a `BrushState` and returns another; then the forces follow.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.brush_state import BrushConditions, BrushState
from tirelib.physics.brush.predict import PointConditions, PointForces, PointParameters
from tirelib.physics.brush.shaped import predict_shaped

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
        return np.full(n, value, dtype=np.float64)

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
