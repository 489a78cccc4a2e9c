"""Slopes of a force of the brush by the fields of its state.

Every point's force is a function of the state there. With tau = Y M the turn of the contact on its
carcass and M its moment,

    dF = F_q dq + F_tau dtau,   dtau = (M dY + Y M_q dq) / (1 - Y M_tau),

so that the balance with the carcass is not solved again.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.brush_state import BrushState
from tirelib.model.brush import brush_forces
from tirelib.physics.brush.predict import PointForces

STATE_STEP = 1e-6
"""Step of a derivative, over the size of what it moves."""
SIZES = {"flatness": 1.0, "slip_angle": 0.1, "slip_ratio": 0.1}
"""Sizes of fields that may be zero everywhere."""


def moment_of(state: BrushState, found: PointForces) -> FloatArray:
    """Return the moment about the contact's middle, [N m], which turns the carcass."""
    shift = (found.Fx - state.Fx_offset) * (found.Fy - state.Fy_offset)
    out: FloatArray = found.Mz - state.Mz_offset + state.lateral_compliance * shift
    return out


class StateSlopes:
    """Slopes of one force about a state, each computed when it is first asked for.

    Parameters
    ----------
    state : BrushState
    turn : shape (n,), [rad]
        Turn of the contact on its carcass: yaw compliance times moment.
    quantity : str
        Fx, Fy or Mz.
    """

    def __init__(self, state: BrushState, turn: FloatArray, quantity: str) -> None:
        self.state, self.turn, self.quantity = state, turn, quantity
        self._kept: dict[str, FloatArray] = {}
        self._here = self._rigid(state, turn)
        self._by_turn = (self._rigid(state, turn + STATE_STEP) - self._here) / STATE_STEP
        self._give = 1.0 - state.yaw_compliance * self._by_turn[1]

    def toward(self, other: BrushState) -> FloatArray:
        """Return the change of the force to a state nearby, shape (n,)."""
        out = np.zeros(len(self.state.conditions))
        for name in BrushState.__dataclass_fields__:
            old, new = getattr(self.state, name), getattr(other, name)
            if isinstance(old, np.ndarray) and new is not old and np.any(new != old):
                out = out + self.by(name) * (new - old)
        return out

    def by(self, name: str) -> FloatArray:
        """Return the slope by a field, shape (n,)."""
        if name not in self._kept:
            self._kept[name] = self._slope(name)
        return self._kept[name]

    def _slope(self, name: str) -> FloatArray:
        if name == "yaw_compliance":
            return np.asarray(self._by_turn[0] * self._here[1] / self._give)
        old: FloatArray = getattr(self.state, name)
        size = max(float(np.abs(old).max()), SIZES.get(name, 0.0)) or 1.0
        # toward zero: a field may be at the end of what is allowed
        step = STATE_STEP * size * np.where(old > 0.0, -1.0, 1.0)
        moved = self._rigid(self.state.but(**{name: old + step}), self.turn)
        force, moment = (moved - self._here) / step
        turned = self.state.yaw_compliance * moment / self._give
        return np.asarray(force + self._by_turn[0] * turned)

    def _rigid(self, at: BrushState, turn: FloatArray) -> FloatArray:
        """Return the force and the moment at a given turn of the contact, (2, n)."""
        thrust = at.camber_thrust * at.conditions.camber
        tangent = np.tan(at.slip_angle + thrust) - (1.0 + at.slip_ratio) * turn
        found = brush_forces(
            at.but(slip_angle=np.arctan(tangent) - thrust, yaw_compliance=np.zeros_like(turn))
        )
        return np.stack([getattr(found, self.quantity), moment_of(at, found)])
