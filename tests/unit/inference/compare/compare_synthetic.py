"""Waveforms that a model itself has made, with set-point errors, noise and planted differences."""

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from tests.synthetic import header
from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import TireFile, read_tire
from tirelib.inference.identify.random_effects import angle_slope
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import CONDITIONS, GRID, Waveforms
from tirelib.model.base import Operating, smoothed, values_of
from tirelib.model.solution import Solution, solved

TOLERANCE = (0.005, 0.002, 0.003)
"""Load, pressure and gain, as in the header."""
ANGLE = 5e-4
Condition = tuple[float, float, float]


def model_file() -> TireFile:
    return read_tire("table-6-2-195-65r15")


def plan() -> list[Condition]:
    """Five loads, two pressures, two speeds, and eight repeats."""
    grid = [
        (load, pressure, speed)
        for load in (1500.0, 2700.0, 3900.0, 5100.0, 6300.0)
        for pressure in (1.9e5, 2.3e5)
        for speed in (10.0, 25.0)
    ]
    return grid + grid[1:17:2]


def points_of(conditions: Sequence[Condition]) -> Operating:
    load, pressure, speed = np.array(conditions).T
    n = load.size
    nothing, unknown = np.zeros(n), np.full(n, np.nan)
    return Operating(
        load=load,
        pressure=pressure,
        omega=speed / 0.302,
        speed=speed,
        camber=nothing,
        slip_angle=nothing,
        slip_ratio=nothing,
        side_force=nothing,
        drive_force=nothing,
        order=np.linspace(0.0, 1.0, n),
        temperature=unknown,
    )


@cache
def off_by(
    conditions: tuple[Condition, ...],
    load: tuple[float, ...],
    pressure: tuple[float, ...],
    low_pass: LowPass,
) -> tuple[Solution, Operating]:
    """Return what the model shows where set points are off by so many tolerances, and those."""
    true = points_of(
        [
            (
                each[0] * (1.0 + TOLERANCE[0] * more),
                each[1] * (1.0 + TOLERANCE[1] * higher),
                each[2],
            )
            for each, more, higher in zip(conditions, load, pressure, strict=True)
        ]
    )
    start = of_the_plan().rolling if conditions == tuple(plan()) else None
    return solved(values_of(model_file().tire), true, low_pass=low_pass, start=start), true


@cache
def of_the_plan() -> Solution:
    """Return what the model shows at the plan's set points."""
    return solved(values_of(model_file().tire), points_of(plan()), low_pass=LowPass())


def waveforms(
    conditions: Sequence[Condition] | None = None,
    *,
    noise: float = 3e-6,
    spread: float = 1.0,
    plant: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
    seed: int = 0,
) -> Waveforms:
    """Return what the model shows at set points that are off by `spread` tolerances.

    `plant(load, phi)` is added to every gage, shape (n_runs, n_phi).
    """
    rng = np.random.default_rng(seed)
    conditions = plan() if conditions is None else list(conditions)
    nominal = points_of(conditions)
    n = len(nominal)
    off = spread * rng.standard_normal((4, n))
    low_pass = LowPass()
    shown, true = off_by(tuple(conditions), tuple(off[0]), tuple(off[1]), low_pass)
    strain, depth = shown.waveform * (1.0 + TOLERANCE[2] * off[2])[:, None], shown.deflection
    strain = strain + ANGLE * off[3][:, None] * angle_slope(shown.waveform)
    if plant is not None:
        strain = strain + plant(nominal.load, GRID)
    gages = strain[:, None, :] + np.zeros((1, 5, 1))
    white = smoothed(rng.standard_normal((n, GRID.size)), true, low_pass)
    white *= noise / np.sqrt(np.mean(white**2)) if noise else 0.0
    gages = gages + white[:, None, :]
    _, group = np.unique(np.array(conditions), axis=0, return_inverse=True)
    unknown = np.full(n, np.nan)
    given = {
        "Fz": nominal.load,
        "pressure": nominal.pressure,
        "omega": nominal.omega,
        "speed": nominal.speed,
        "slip_angle": np.zeros(n),
        "camber": np.zeros(n),
        "slip_ratio": np.zeros(n),
    }
    return Waveforms(
        header=header(),
        strain=gages - gages.mean(axis=2, keepdims=True),
        run=np.arange(n),
        turns=np.full(n, 3),
        scatter=np.full(n, noise),
        angle_std=np.full(n, ANGLE),
        start=np.arange(n) * 12.0,
        group=np.asarray(group).ravel(),
        conditions={
            **{name: given.get(name, unknown) for name in CONDITIONS},
            "loaded_radius": header().tire.free_radius - depth,
        },
        extra={},
        low_pass=low_pass,
        left_out={},
    )


def bump(
    start: float, stop: float, size: float, least_load: float = 0.0
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Return a plateau of strain over some angles, above some load, for `plant`."""

    def plant(load: FloatArray, phi: FloatArray) -> FloatArray:
        inside = (phi >= start) & (phi < stop)
        return np.asarray(size * np.outer(load >= least_load, inside))

    return plant
