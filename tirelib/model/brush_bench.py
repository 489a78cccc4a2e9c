"""A brush at points that vary everything: what effects of stage brush are registered on."""

from dataclasses import replace
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.effects.brush_state import BrushConditions
from tirelib.model.brush import brush_forces, brush_state
from tirelib.physics.brush.predict import PointParameters

POINTS = 300
REFERENCE = (4000.0, 2.0e5)
"""Load and pressure at which the laws equal the base model, [N] and [Pa]."""
SCALES = {"Fy": 3000.0, "Fx": 3000.0, "Mz": 80.0}
"""Typical forces: what is compared are forces over these."""
COORDINATES = (
    "lateral_stiffness",
    "longitudinal_stiffness",
    "friction",
    "half_length",
    "load_power",
    "slip_angle_offset",
    "slip_ratio_offset",
    "Fx_offset",
    "Fy_offset",
    "Mz_offset",
)
UNITS = {
    "slip_angle_offset": 0.01,
    "slip_ratio_offset": 0.01,
    "Fx_offset": 50.0,
    "Fy_offset": 50.0,
    "Mz_offset": 2.0,
}
"""Sizes of what is moved by addition; the others are moved by a factor."""
COORDINATE_STEP = 1e-5
"""Move of a coordinate by which slopes are taken."""
DEAD = 1e-5


def reference_conditions() -> BrushConditions:
    """Return points spread evenly and at random over what a brush meets."""
    random = np.random.default_rng(2)
    n = POINTS
    speed = random.uniform(5.0, 40.0, n) * np.where(random.uniform(size=n) < 0.2, -1.0, 1.0)
    return BrushConditions(
        load=random.uniform(1500.0, 6500.0, n),
        pressure=random.uniform(1.6e5, 2.6e5, n),
        slip_angle=np.deg2rad(random.uniform(-8.0, 8.0, n)),
        slip_ratio=np.where(np.arange(n) % 3 == 0, random.uniform(-0.1, 0.1, n), 0.0),
        camber=np.deg2rad(random.uniform(-4.0, 4.0, n)),
        speed=speed,
        temperature=random.uniform(300.0, 360.0, n),
        slip_rate=np.deg2rad(random.uniform(-10.0, 10.0, n)),
        order=np.arange(n) / (n - 1.0),
    )


class BrushBench:
    """The brush at these points, and what changes to it do: Fy, Fx and Mz over `SCALES`."""

    dead = DEAD

    def __init__(self) -> None:
        self.conditions = reference_conditions()
        self.base, slopes = self.slopes(np.zeros(len(COORDINATES)))
        self.basis = np.linalg.qr((slopes / np.linalg.norm(slopes, axis=1)[:, None]).T)[0]

    def acts(self, effect: Effect) -> bool:
        """Whether an effect is one of the brush."""
        return effect.hook == "brush"

    def waveform(self, *changes: Any) -> FloatArray:
        """Return the forces with changes, (3, n)."""
        return self.moved(np.zeros(len(COORDINATES)), *changes)

    def moved(self, z: FloatArray, *changes: Any) -> FloatArray:
        """Return the forces with parameters moved by z and changes, (3, n)."""
        at = self.conditions
        by = dict(zip(COORDINATES, z, strict=True))
        power = 0.5 + by["load_power"]
        added = {name: unit * by[name] for name, unit in UNITS.items()}
        parameters = PointParameters(
            lateral_stiffness=9e6 * np.exp(by["lateral_stiffness"]),
            longitudinal_stiffness=1.1e7 * np.exp(by["longitudinal_stiffness"]),
            friction=np.exp(by["friction"]),
            half_length=0.06 * np.exp(by["half_length"]) * (at.load / REFERENCE[0]) ** power,
        )
        parameters = replace(parameters, **added)
        state = brush_state(parameters, at, reference=REFERENCE, ring_flatness=1.0)
        found = brush_forces(state, changes)
        return np.stack([getattr(found, name) / size for name, size in SCALES.items()])

    def slopes(self, z: FloatArray, *changes: Any) -> tuple[FloatArray, FloatArray]:
        """Return the forces with parameters moved by z, and their slopes by them."""
        here = self.moved(z, *changes)
        rows = []
        for step in COORDINATE_STEP * np.eye(z.size):
            rows.append((self.moved(z + step, *changes) - here).ravel() / COORDINATE_STEP)
        return here, np.stack(rows)

    def words(self, size: float) -> str:
        """Return a sentence on the quantities that an effect hardly changes, with the change."""
        return f"Fy, Fx and Mz (rms {100.0 * size:.2g} % of typical forces"
