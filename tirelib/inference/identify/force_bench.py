"""What a brush needs at fixed points, computed once: contact length of the ring, conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.core.parameters import Tire
from tirelib.effects.brush_state import BrushConditions, BrushState
from tirelib.inference.identify.brush_law import BrushModel, Reference, point_parameters
from tirelib.inference.identify.force_points import ForcePoints
from tirelib.inference.identify.ring_patch import half_lengths, ring_contact
from tirelib.model.brush import BrushChange, brush_forces, brush_state
from tirelib.physics.brush.predict import PointForces
from tirelib.physics.brush.shaped import HIGHEST

Changes = Sequence[tuple[str, BrushChange]]
_GRID = (6, 3)
_SHAPE = np.linspace(-0.95, 0.95, 39)


@dataclass(frozen=True, slots=True, eq=False)
class ForceBench:
    """What a brush needs at fixed points, computed once.

    Attributes
    ----------
    law : Reference
        Law of the half length.
    half : shape (n,) or None
        Half contact length of the ring, if it gives it.
    ring_flatness : shape (n,) or float
    reference : (load, pressure)
    """

    points: ForcePoints
    conditions: BrushConditions
    law: Reference
    half: FloatArray | None
    ring_flatness: FloatArray | float
    reference: tuple[float, float]

    @classmethod
    def of(
        cls, brush: BrushModel, points: ForcePoints, reference: tuple[float, float]
    ) -> "ForceBench":
        """Return the bench of a brush at points.

        Raises
        ------
        CalibrationError
            If the ring needs a pressure that is unknown.
        """
        data, tire = points.data, brush.tire
        half: FloatArray | None = None
        flatness: FloatArray | float = 1.0
        if tire is not None:
            if not np.isfinite(data.pressure).all():
                raise CalibrationError(
                    f"model {brush.name}: its ring needs the inflation pressure for the contact "
                    "length, which is unknown at some points; record it or give it as a set point"
                )
            half = half_lengths(tire, data.load, data.pressure)
            flatness = _ring_flatness(tire, data.load, data.pressure)
        return cls(points, points.conditions, brush.reference, half, flatness, reference)

    def state(self, values: Mapping[str, float]) -> BrushState:
        """Return the base brush with parameters `values`."""
        parameters = point_parameters(values, self.points.data, self.law, self.half)
        return brush_state(
            parameters, self.conditions, reference=self.reference, ring_flatness=self.ring_flatness
        )

    def forces(self, values: Mapping[str, float], changes: Changes = ()) -> PointForces:
        """Return the forces with parameters and effects."""
        return brush_forces(self.state(values), changes)

    def take(self, chosen: IntArray | BoolArray) -> "ForceBench":
        """Return the bench of some of the points, by index or mask."""
        flat, half = self.ring_flatness, self.half
        return replace(
            self,
            points=self.points.take(chosen),
            conditions=self.conditions.take(chosen),
            half=None if half is None else half[chosen],
            ring_flatness=flat[chosen] if isinstance(flat, np.ndarray) else flat,
        )


def _ring_flatness(tire: Tire, load: FloatArray, pressure: FloatArray) -> FloatArray:
    """Return the flatness c that fits the ring's pressure best, linear in load and pressure.

    At most half of what the brush allows, so that twice the ring's can be computed.
    """
    side = np.linspace(load.min(), load.max() * (1.0 + 1e-9) + 1e-3, _GRID[0])
    across = np.linspace(pressure.min(), pressure.max() * (1.0 + 1e-9) + 1e-3, _GRID[1])
    f, p = (x.ravel() for x in np.meshgrid(side, across, indexing="ij"))
    contact = ring_contact(tire, f, p)
    lead, trail = contact.edges.T
    phi = 0.5 * (lead + trail)[:, None] + 0.5 * (trail - lead)[:, None] * _SHAPE
    shape = np.maximum(contact.pressure_at(phi), 0.0)
    shape = shape / np.trapezoid(shape, _SHAPE, axis=1)[:, None]
    parabola = 0.75 * (1.0 - _SHAPE**2)
    # shape (1 + c / 5) = parabola (1 + c x^2), linear in c
    column = parabola * _SHAPE**2 - shape / 5.0
    c = np.sum(column * (shape - parabola), axis=1) / np.sum(column**2, axis=1)
    columns = np.stack([np.ones_like(f), f, p], axis=1)
    norm = np.abs(columns).max(axis=0)
    slope = np.linalg.lstsq(columns / norm, c, rcond=1e-6)[0] / norm
    found = slope[0] + slope[1] * load + slope[2] * pressure
    return np.asarray(np.minimum(found, 0.5 * HIGHEST), dtype=np.float64)
