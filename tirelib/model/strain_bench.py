"""The ring at points that vary everything: what effects of the strain are registered on."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Tire
from tirelib.effects import Effect
from tirelib.effects.state import Operating, State
from tirelib.model.base import FREE, linearised, move, predict, values_of
from tirelib.model.chain import Change, Changes

DEAD = 1e-7
"""Rms strain below which an effect at the end of its range is dead, [-]."""
_SIDE = 0.06


@dataclass(frozen=True, slots=True)
class Plan:
    """Operating points on which effects are compared.

    Attributes
    ----------
    points : Operating
    lateral : shape (n_points,), [m]
        Gage of each point, left positive.
    """

    points: Operating
    lateral: FloatArray

    def changes(self, *more: tuple[str, Change]) -> Changes:
        """Return changes that put the gages in place, then others; points may be repeated."""

        def place(state: State) -> State:
            return state.but(lateral=np.resize(self.lateral, len(state.conditions)))

        return [("constants", place), *more]


def reference_plan(tire: Tire) -> Plan:
    """Return 5 loads x 3 pressures x 4 speeds of free rolling, and slip and camber at the sides."""
    grid = np.meshgrid(
        [1500.0, 2750.0, 4000.0, 5250.0, 6500.0],
        [1.6e5, 2.1e5, 2.6e5],
        [5.0, 15.0, 25.0, 35.0],
        indexing="ij",
    )
    # six runs with slip angle, camber or slip ratio, each seen by the left and the right gage
    slip = np.deg2rad([3.0, -3.0, 0.0, 0.0, 0.0, 0.0])
    camber = np.deg2rad([0.0, 0.0, 4.0, -4.0, 0.0, 0.0])
    ratio = np.array([0.0, 0.0, 0.0, 0.0, 0.03, -0.03])
    twice = [np.repeat(column, 2) for column in (slip, camber, ratio)]
    loads = np.tile([3000.0, 3000.0, 5000.0, 5000.0], 3)
    load = np.concatenate([grid[0].ravel(), loads])
    speed = np.concatenate([grid[2].ravel(), np.full(12, 15.0)])
    alpha, gamma, kappa = (np.concatenate([np.zeros(60), column]) for column in twice)
    n = load.size
    points = Operating(
        load=load,
        pressure=np.concatenate([grid[1].ravel(), np.full(12, 2.1e5)]),
        omega=speed / tire.ring_radius,
        speed=speed,
        camber=gamma,
        slip_angle=alpha,
        slip_ratio=kappa,
        side_force=-load * (10.0 * alpha - 0.5 * gamma),
        drive_force=load * 15.0 * kappa,
        order=(np.arange(n) * 29 % n) / (n - 1.0),
        temperature=np.full(n, np.nan),
    )
    return Plan(points, np.concatenate([np.zeros(60), np.tile([-_SIDE, _SIDE], 6)]))


class StrainBench:
    """The ring on a plan, and what changes to it do."""

    dead = DEAD

    def __init__(self, tire: Tire, plan: Plan) -> None:
        self.values = values_of(tire)
        self.plan = plan
        self.base, slopes = self.slopes(np.zeros(len(FREE)))
        self.basis = np.linalg.qr((slopes / np.linalg.norm(slopes, axis=1)[:, None]).T)[0]

    def acts(self, effect: Effect) -> bool:
        """Whether an effect is one of this chain."""
        return effect.hook != "brush"

    def waveform(self, *changes: tuple[str, Change]) -> FloatArray:
        """Return the waveform with changes."""
        state = predict(self.values, self.plan.points, self.plan.changes(*changes))
        return state.wave

    def slopes(self, z: FloatArray, *changes: Any) -> tuple[FloatArray, FloatArray]:
        """Return the waveform with parameters moved by z, and its slopes by them."""
        linear = linearised(
            move(self.values, z), self.plan.points, FREE, self.plan.changes(*changes)
        )
        return linear.waveform, linear.waveform_slopes.reshape(len(FREE), -1)

    def moved(self, z: FloatArray, *changes: Any) -> FloatArray:
        """Return the waveform with parameters moved by z and changes."""
        return predict(move(self.values, z), self.plan.points, self.plan.changes(*changes)).wave

    def words(self, size: float) -> str:
        """Return a sentence on the quantities that an effect hardly changes, with the change."""
        return f"the strain (rms {1e6 * size:.2g} ustrain"
