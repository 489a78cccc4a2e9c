"""Waveforms that the model itself makes, with the random effects of a rig. For tests of the fit."""

from dataclasses import replace

import numpy as np

from tests.synthetic import LATERAL, header
from tirelib.campaign import Tolerance
from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Tire
from tirelib.effects.state import Operating
from tirelib.inference.identify.random_effects import angle_slope
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import CONDITIONS, Waveforms
from tirelib.model.base import values_of
from tirelib.model.solution import solved

TIRE = Tire(
    ring_radius=0.302,
    free_radius=0.3155,
    belt_width=0.165,
    tread_thickness=0.012,
    innerliner_offset=-0.0033,
    bending_stiffness=2.4,
    mass=3.3,
    pressure=2.1e5,
    radial_stiffness=4.6e5,
    radial_pressure_slope=1.1,
    tangential_stiffness=1.9e5,
    tangential_pressure_slope=0.4,
    tread_stiffness=5.6e7,
    extension_stiffness=4.5e6,
)
"""Not the start of a fit; its mass is, for a campaign does not tell it."""
TOLERANCE = Tolerance(0.005, 0.002, 0.001, 0.003)
ANGLE_STD = 5e-4
LOADS = (2400.0, 3600.0, 4800.0, 6000.0, 7200.0)
PRESSURES = (1.7e5, 2.1e5, 2.5e5)


def operating(load: FloatArray, pressure: FloatArray, speed: float = 18.0) -> Operating:
    """Return straight, free rolling."""
    n = load.size
    zero, none = np.zeros(n), np.full(n, np.nan)
    turn = np.full(n, speed / TIRE.ring_radius)
    return Operating(
        load,
        pressure,
        turn,
        np.full(n, speed),
        zero,
        zero,
        zero,
        zero,
        zero,
        np.arange(n) / max(n - 1, 1),
        none,
    )


def exact_waveform(tire: Tire, points: Operating) -> tuple[FloatArray, FloatArray]:
    """Return waveform and deflection of the model."""
    found = solved(values_of(tire), points, low_pass=LowPass())
    return found.waveform, found.deflection


def made_waves(
    tire: Tire = TIRE,
    loads: tuple[float, ...] = LOADS,
    pressures: tuple[float, ...] = PRESSURES,
    *,
    repeats: int = 2,
    noise: float = 4e-6,
    seed: int = 0,
    random: bool = True,
    radius: bool = True,
) -> Waveforms:
    """Return runs over loads and pressures, the first ones repeated; all gages alike but noise.

    The set points that the file tells are kept; what the rig really did differs by the tolerance.
    """
    rng = np.random.default_rng(seed)
    grid = np.array([(load, p) for p in pressures for load in loads])
    group = np.r_[np.arange(len(grid)), np.arange(repeats)]
    load, pressure = grid[group].T
    n = group.size
    share = (1.0 if random else 0.0) * rng.standard_normal((4, n))
    real = operating(
        load * (1.0 + TOLERANCE.load * share[0]), pressure * (1.0 + TOLERANCE.pressure * share[1])
    )
    wave, deflection = exact_waveform(tire, real)
    wave = wave * (1.0 + TOLERANCE.gain * share[2])[:, None]
    wave = wave + ANGLE_STD * share[3][:, None] * angle_slope(wave)
    strain = wave[:, None] + noise * rng.standard_normal((n, len(LATERAL), wave.shape[1]))
    said = operating(load, pressure)
    given = {
        "Fz": load,
        "pressure": pressure,
        "omega": said.omega,
        "speed": said.speed,
        "slip_angle": np.zeros(n),
        "camber": np.zeros(n),
        "slip_ratio": np.zeros(n),
        "loaded_radius": tire.free_radius - deflection if radius else np.full(n, np.nan),
    }
    return Waveforms(
        header=replace(header(), tolerance=TOLERANCE),
        strain=strain,
        run=np.arange(n),
        turns=np.full(n, 4),
        scatter=np.full(n, noise),
        angle_std=np.full(n, ANGLE_STD),
        start=12.0 * np.arange(n),
        group=group,
        conditions={name: given.get(name, np.full(n, np.nan)) for name in CONDITIONS},
        extra={},
        low_pass=LowPass(),
        left_out={},
    )
