"""Random tires of the Magic Formula and their forces: another curve than any brush has."""

from collections.abc import Sequence

import numpy as np

from tests.unit.physics.brush.test_mf import HEAD, PLAIN
from tirelib.core.parameters.tir import parse_tir
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.magic.file import magic_tire
from tirelib.physics.brush.mf import magic_forces
from tirelib.physics.brush.mf_tire import MagicTire

LOADS = (1500.0, 3000.0, 4500.0, 6000.0)
ANGLES = tuple(np.radians(np.arange(-6.0, 6.1, 1.0)))
RATIOS = (-0.15, -0.1, -0.05, -0.02, 0.02, 0.05, 0.1, 0.15)


def magic(rng: np.random.Generator) -> MagicTire:
    """Return a random tire."""
    u = rng.uniform
    values = PLAIN | {
        "PCX1": u(1.4, 1.75),
        "PDX1": u(0.9, 1.3),
        "PDX2": u(-0.2, -0.02),
        "PEX1": u(-1.0, 0.4),
        "PKX1": u(15, 35),
        "PKX2": u(-1.0, 1.0),
        "PKX3": u(-0.2, 0.3),
        "PCY1": u(1.15, 1.6),
        "PDY1": u(0.8, 1.3),
        "PDY2": u(-0.25, -0.02),
        "PEY1": u(-1.5, 0.3),
        "PEY2": u(-0.6, 0.2),
        "PKY1": -u(12, 28),
        "PKY2": u(1.4, 2.5),
        "QBZ1": u(7, 12),
        "QCZ1": u(1.05, 1.3),
        "QDZ1": u(0.08, 0.13),
        "QEZ1": u(-3.0, -0.5),
        "PHY1": u(-2e-3, 2e-3),
        "PVY1": u(-0.02, 0.02),
    }
    lines = "".join(f"{key}={value!r}\n" for key, value in values.items())
    return magic_tire(parse_tir(HEAD.format(fit=52) + lines))


def magic_data(
    tire: MagicTire,
    rng: np.random.Generator,
    ratios: Sequence[float] = (),
    loads: Sequence[float] = LOADS,
    angles: Sequence[float] = ANGLES,
) -> ForceData:
    """Return noisy forces: a slip angle sweep, and a slip ratio sweep if ratios are given."""
    load, angle = (x.ravel() for x in np.meshgrid(loads, angles, indexing="ij"))
    more, kappa = (x.ravel() for x in np.meshgrid(loads, ratios, indexing="ij"))
    load, angle = np.concatenate([load, more]), np.concatenate([angle, np.zeros(more.size)])
    kappa = np.concatenate([np.zeros(load.size - more.size), kappa])
    load = load * (1.0 + 0.005 * rng.standard_normal(load.size))
    found = magic_forces(tire, load, angle, kappa)
    noise = 25.0 * rng.standard_normal((3, load.size))
    n, one = load.size, np.ones(load.size)
    return ForceData(
        load,
        2.2e5 * one,
        angle,
        kappa,
        0 * one,
        59 * one,
        found.Fx + noise[0],
        found.Fy + noise[1],
        found.Mz + 0.02 * noise[2],
        np.arange(n),
    )
