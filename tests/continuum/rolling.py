"""Tires and states that several tests of the rolling continuum share."""

from dataclasses import replace
from functools import cache

import numpy as np
from continuum.balance import Balance, balance, sidewall_force
from continuum.elements import fields
from continuum.polar import radial
from continuum.solve import Model, State, model, solve
from continuum.tire import Condition, Tire

TIRE = Tire()
COARSE = 0.023
"""Elements in the contact twice as long as the default: laws hold on any mesh [rad]."""
COND = Condition(4000.0, 2.1e5, 18.0)


@cache
def plain(fine: float = COARSE) -> Model:
    return model(TIRE, fine)


@cache
def state(fine: float = COARSE, **change: float) -> State:
    """Solve the tire at `COND`; `change` replaces constants of the tire or the condition."""
    of_cond = {k: v for k, v in change.items() if k in ("load", "pressure", "speed")}
    of_tire = {k: v for k, v in change.items() if k not in of_cond}
    start = state(fine) if change else None
    base = replace(plain(fine), tire=replace(TIRE, **of_tire))
    return solve(base, replace(COND, **of_cond), start)


def rim_force(s: State) -> tuple[np.ndarray, float]:
    """Force (x, z) of the sidewalls on the belt, and their moment about the axle."""
    b = s.balance
    line = b.mesh.carcass
    force = sidewall_force(b.tire, b.law, b.cond, b.mesh, b.u, b.omega)[0]
    weight = line.weight * b.tire.ring_radius * b.mesh.of_strip(b.tire.sidewall_share, line)
    x = line.radius[..., None] * radial(line.phi) + fields(line, b.u)[0]
    turning = x[..., 1] * force[..., 0] - x[..., 0] * force[..., 1]
    return np.einsum("eqi,eq->i", force, weight), float(np.sum(turning * weight))


def hanging(tire_model: Model, pressure: float, omega: float) -> Balance:
    """Inflate and spin a tire that touches nothing, by Newton's method."""
    u = np.zeros((tire_model.mesh.n, 2))
    for _ in range(20):
        cond = Condition(0.0, pressure, 1.0)
        now = balance(tire_model.tire, tire_model.law, cond, tire_model.mesh, u, 1.0, 1.0, omega)
        step = now.factor.solve(now.residual).reshape(-1, 2)
        if np.abs(step).max() < 1e-12:
            return now
        u = u - step
    raise AssertionError("a hanging tire has no balance")
