"""An effect of your own: change name, law and range, save the file, and drop it on the page.

A law takes the state of the tire and a strength, and returns `state.but(name=new value)`; strength
0 changes nothing. It is computed for all runs at once, so that what it reads is an array with one
number for each run, in SI units and ISO 8855 axes; it uses numpy functions and no `if`.

state.conditions: load [N], pressure [Pa], speed [m/s], omega [rad/s], slip_angle [rad], camber
    [rad], slip_ratio [1], side_force [N], drive_force [N], temperature [K] of the tread, order
    (0 for the first run to 1 for the last). Where one was not measured it is NaN: name those that
    the law reads in `needs`.
state, for strain, with stage "stiffness", "inertia" or "tread": k_u and k_v [N/m^2] (radial and
    tangential stiffness of the sidewall), EI [N m^2], EA [N], GA [N] (belt: bending, stretching,
    shear), k_t [N/m^2] (tread), tension [N], mass [kg/m], damping [1], deflection [m].
state, for forces, with stage "brush": mu [1], c_py and c_px [N/m^2] (stiffness of the bristles
    across and along), a [m] (half the contact length), slip_angle [rad], slip_ratio [1],
    Fx_offset [N], Fy_offset [N], Mz_offset [N m].

One effect in a file is enough: take out the one that is not needed.
"""

from tirelib.effects import effect
from tirelib.model.brush import BrushState
from tirelib.model.state import State


@effect(
    "soft_tread",
    stage="tread",
    unit="1",
    low=0.0,
    high=0.5,  # plausible range of the strength
    varies_with=("pressure",),
    needs=("pressure",),
    source="my own guess",
)
def soft_tread(state: State, strength: float) -> State:
    """Tread that softens with inflation pressure."""
    above = state.conditions.pressure / 2.0e5 - 1.0
    return state.but(k_t=state.k_t * (1.0 - strength * above))


@effect(
    "wet_road",
    stage="brush",
    unit="1",
    low=0.0,
    high=0.9,
    varies_with=("speed",),
    needs=("speed",),
    source="my own guess",
)
def wet_road(state: BrushState, strength: float) -> BrushState:
    """Friction that falls with the square of the speed on a wet road."""
    share = (state.conditions.speed / 30.0) ** 2
    return state.but(mu=state.mu * (1.0 - strength * share / (1.0 + share)))
