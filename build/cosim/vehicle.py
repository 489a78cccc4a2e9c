"""A third-party vehicle with its wheels laid open: the multi-body model of CommonRoad, RK4.

``vehiclemodels.vehicle_dynamics_mb`` has 29 states and computes load, slip and force of every
wheel, but returns only the right-hand side. Here its own source is parsed, and three things are
changed in the syntax tree before it is compiled: it returns its wheel quantities too; each wheel
has its own tire parameters, so that the road may be slippery under some; the road has a height
under each wheel, which the tire's spring sees. The equations stay those of the installed package.

Axes: the model's are those of SAE J670 (x forward, y right, z down; slip s > 0 brakes), with Fz
positive; everything that leaves this file is ISO 8855.
"""

import ast
import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from vehiclemodels import vehicle_dynamics_mb as model
from vehiclemodels.init_mb import init_mb
from vehiclemodels.vehicle_parameters import setup_vehicle_parameters

from cosim.wheels import OWN_FRICTION, WheelStates
from tirelib.core.arrays import FloatArray
from tirelib.core.axes import sign
from tirelib.core.errors import ParameterError

_PLACES = ("LF", "RF", "LR", "RR")
"""The model's names of `WHEELS`, in this order."""
_WHEEL = ("F_z_{0}", "alpha_{0}", "s_{1}", "u_w_{1}", "gamma_{0}", "F_x_{0}", "F_y_{0}")
"""What is read of each wheel; {0} upper, {1} lower case."""
_DELTA, _SPEED, _YAW, _YAW_RATE, _ROLL, _SIDE, _SPIN = 2, 3, 4, 5, 6, 10, slice(23, 27)
"""Places in the state vector."""
G = 9.81
"""Gravity of the model [m/s^2]."""
SETTLING = 2.0
"""Time in which the springs come to rest before the start [s]."""
PLY_STEER = ("p_hy1", "p_vy1")
"""Tire parameters that are set to zero: the model gives them the sign of the camber, so that the
lateral force jumps where the camber passes zero, and a vehicle that rolls straight never rests."""
_LATERAL, _SLIP = sign("Fy", "sae"), sign("slip_angle", "sae")
_SETTLED: dict[tuple[int, float], FloatArray] = {}
"""States at rest by vehicle and speed: rolling to rest takes as long as a short manoeuvre."""


class _Opened(ast.NodeTransformer):
    """Changes the model's right-hand side as the head of this file says."""

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        """Let the road's height press the tire's spring."""
        self.generic_visit(node)
        target = node.targets[0]
        if isinstance(target, ast.Name) and target.id in (f"F_z_{p}" for p in _PLACES):
            place = _PLACES.index(target.id[-2:])
            lift = ast.parse(f"p.K_zt * p.road[{place}]", mode="eval").body
            node.value = ast.BinOp(node.value, ast.Add(), lift)
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Give every tire formula the parameters of the wheel that its first argument names."""
        self.generic_visit(node)
        match node.args:
            case [ast.Name(id=name), *_, ast.Attribute(attr="tire")]:
                place = _PLACES.index(name[-2:].upper())
                node.args[-1] = ast.parse(f"p.tires[{place}]", mode="eval").body
        return node

    def visit_Return(self, node: ast.Return) -> ast.AST:
        """Return the wheels' quantities beside the derivatives."""
        rows = ", ".join(
            "(" + ", ".join(name.format(p, p.lower()) for name in _WHEEL) + ")" for p in _PLACES
        )
        derivatives = node.value or ast.Constant(None)
        node.value = ast.Tuple([derivatives, ast.parse(f"({rows})", mode="eval").body], ast.Load())
        return node


@cache
def _right_hand_side() -> Callable[..., tuple[list[float], tuple[tuple[float, ...], ...]]]:
    tree = _Opened().visit(ast.parse(inspect.getsource(model.vehicle_dynamics_mb)))
    space = dict(vars(model))
    code = compile(ast.fix_missing_locations(tree), model.__file__, "exec")
    exec(code, space)  # the package's own source
    found: Callable[..., Any] = space["vehicle_dynamics_mb"]
    return found


@dataclass(frozen=True, slots=True)
class Controls:
    """What the driver and the road do, held over a step.

    Attributes
    ----------
    steer_rate : float, [rad/s]
        Rate of the front wheels, to the left positive; the model limits it to 0.4 rad/s.
    torque : sequence of 4 floats, [N m]
        At each wheel in the order of `WHEELS`; driving positive, braking negative. Brakes hold a
        wheel that stands; they do not turn it back.
    friction : sequence of 4 floats, [1]
        Factor on the friction under each wheel.
    road : sequence of 4 floats, [m]
        Height of the road under each wheel above the plane.
    """

    steer_rate: float = 0.0
    torque: Sequence[float] = (0.0,) * 4
    friction: Sequence[float] = (1.0,) * 4
    road: Sequence[float] = (0.0,) * 4


@dataclass(frozen=True, slots=True)
class Motion:
    """Where the vehicle is and what it does; SI, ISO 8855.

    Attributes
    ----------
    time : float, [s]
    speed : float, [m/s]
        Along the vehicle's x axis.
    steer : float, [rad]
        Angle of the front wheels, to the left positive.
    heading, yaw_rate : float, [rad], [rad/s]
        To the left positive.
    roll, side_slip : float, [rad]
        Roll to the right positive; side slip of the centre of mass to the left positive.
    place : tuple of two floats, [m]
        x and y on the road.
    wheels : WheelStates
    fx, fy : array, shape (4,), [N]
        Forces of the vehicle's own tires, in the wheels' axes.
    """

    time: float
    speed: float
    steer: float
    heading: float
    yaw_rate: float
    roll: float
    side_slip: float
    place: tuple[float, float]
    wheels: WheelStates
    fx: FloatArray
    fy: FloatArray


class Vehicle:
    """CommonRoad's multi-body vehicle.

    Parameters
    ----------
    number : int
        Parameter set of the package: 1 (Ford Escort), 2 (BMW 320i), 3 (VW Vanagon).
    speed : float, [m/s]
        At the start, straight ahead.

    Raises
    ------
    ParameterError
        If there is no such set.
    """

    def __init__(self, number: int, speed: float) -> None:
        if number not in (1, 2, 3):
            raise ParameterError(
                f"vehicle {number}; allowed are 1 to 3; 4 has no multi-body model; take another"
            )
        parameters = setup_vehicle_parameters(number)
        self.parameters = SimpleNamespace(**vars(parameters), road=(0.0,) * 4)
        self._tire = vars(parameters.tire) | dict.fromkeys(PLY_STEER, 0.0)
        self.mass = float(parameters.m)
        self._rub(Controls())
        self.time = 0.0
        if (number, speed) not in _SETTLED:
            self.state = np.array(init_mb([0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0], parameters))
            _SETTLED[number, speed] = self._settled(speed)
        self.state = _SETTLED[number, speed].copy()

    def _settled(self, speed: float) -> FloatArray:
        """Roll straight until the springs rest: the package's first state is not quite at rest."""
        for _ in range(round(SETTLING / 2e-3)):
            self.step(2e-3, Controls())
        self.time = 0.0
        state = self.state
        state[[0, 1, _YAW]], state[_SPEED] = 0.0, speed
        state[_SPIN] = speed / self.parameters.R_w
        return state

    def _rub(self, controls: Controls) -> None:
        """Set the friction under each wheel."""
        self._friction = tuple(controls.friction)
        self.parameters.tires = [
            SimpleNamespace(
                **(self._tire | {name: factor * self._tire[name] for name in ("p_dx1", "p_dy1")})
            )
            for factor in controls.friction
        ]

    def static_load(self) -> FloatArray:
        """Return the wheels' loads on a level road at rest, [N]."""
        p = self.parameters
        front = (p.m_s * p.b / (p.a + p.b) + p.m_uf) * G / 2.0
        rear = (p.m_s * p.a / (p.a + p.b) + p.m_ur) * G / 2.0
        return np.array([front, front, rear, rear])

    def _slope(
        self, state: FloatArray, controls: Controls
    ) -> tuple[FloatArray, tuple[tuple[float, ...], ...]]:
        """Return the derivatives, and the wheels in the model's axes."""
        found, wheels = _right_hand_side()(
            state.tolist(), [_LATERAL * controls.steer_rate, 0.0], self.parameters
        )
        slope = np.array(found)
        spin = state[_SPIN]
        slope[_SPIN] += np.asarray(controls.torque) / self.parameters.I_y_w
        slope[_SPIN] = np.where((spin <= 0.0) & (slope[_SPIN] < 0.0), 0.0, slope[_SPIN])
        return slope, wheels

    def _apply(self, controls: Controls) -> None:
        self.parameters.road = tuple(controls.road)
        if tuple(controls.friction) != self._friction:
            self._rub(controls)

    def look(self, controls: Controls | None = None) -> Motion:
        """Return what the vehicle does now."""
        now = controls or Controls()
        self._apply(now)
        _, wheels = self._slope(self.state, now)
        return self._motion(wheels)

    def step(self, step: float, controls: Controls) -> Motion:
        """Go on by a step [s]; return the motion at its start."""
        self._apply(controls)
        x = self.state
        k1, wheels = self._slope(x, controls)
        before = self._motion(wheels)
        k2, _ = self._slope(x + 0.5 * step * k1, controls)
        k3, _ = self._slope(x + 0.5 * step * k2, controls)
        k4, _ = self._slope(x + step * k3, controls)
        self.state = x + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        self.state[_SPIN] = np.maximum(self.state[_SPIN], 0.0)
        self.time += step
        return before

    def _motion(self, wheels: tuple[tuple[float, ...], ...]) -> Motion:
        load, alpha, slip, along, camber, fx, fy = np.array(wheels).T
        x = self.state
        return Motion(
            time=self.time,
            speed=float(x[_SPEED]),
            steer=_LATERAL * float(x[_DELTA]),
            heading=_LATERAL * float(x[_YAW]),
            yaw_rate=_LATERAL * float(x[_YAW_RATE]),
            roll=float(x[_ROLL]),
            side_slip=_LATERAL * math.atan2(x[_SIDE], x[_SPEED]),
            place=(float(x[0]), _LATERAL * float(x[1])),
            wheels=WheelStates(
                load=load,
                alpha=_SLIP * alpha,
                kappa=(1.0 - slip) * np.cos(alpha) - 1.0,
                camber=camber,
                speed=along / np.cos(alpha),
                friction=OWN_FRICTION * np.array(self._friction),
            ),
            fx=fx,
            fy=_LATERAL * fy,
        )
