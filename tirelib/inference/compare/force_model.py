"""A model file as something that predicts forces: its brush, with the effects that it has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, FormatError
from tirelib.core.parameters import TireFile
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.model import TireModel, UsedEffect, effects_of
from tirelib.inference.identify.brush_law import BrushModel, brush_of
from tirelib.inference.identify.force_bench import Changes, ForceBench
from tirelib.inference.identify.force_checks import ANGLE_SPAN, RATIO_SPAN
from tirelib.inference.identify.force_data import FORCES, ForceData
from tirelib.inference.identify.force_points import ForcePoints
from tirelib.physics.brush.predict import PointForces

REFERENCE_LOAD, REFERENCE_PRESSURE = 4000.0, 2.0e5
"""Where laws of load and pressure change nothing, if the model does not say it, [N] and [Pa]."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceModel:
    """A brush with its effects.

    Attributes
    ----------
    used : tuple of UsedEffect
        Effects of stage brush.
    reference : (load, pressure), [N], [Pa]
        At which laws of load and pressure change nothing.
    """

    name: str
    brush: BrushModel
    used: tuple[UsedEffect, ...]
    reference: tuple[float, float]
    history: tuple[Mapping[str, Any], ...]

    @property
    def values(self) -> dict[str, float]:
        """Parameters of the brush by name, c_px stated."""
        values = dict(self.brush.values)
        values.setdefault("longitudinal_stiffness", values["lateral_stiffness"])
        return values

    @property
    def changes(self) -> Changes:
        """What the effects change."""
        return [used.effect.at(used.strength) for used in self.used]

    def fitted(
        self,
        values: Mapping[str, float],
        effects: Sequence[Effect],
        strengths: Sequence[FloatArray],
    ) -> "ForceModel":
        """Return the model with the parameters and effects of a fit."""
        used = TireModel.fitted({}, effects, strengths).used
        return replace(self, brush=replace(self.brush, values=values), used=used)

    def predict(self, points: ForcePoints) -> PointForces:
        """Return the forces at points.

        Raises
        ------
        CalibrationError
            If the ring needs a pressure that is unknown.
        ParameterError, ConvergenceError
            If an effect needs what is not measured, or the brush has no solution.
        """
        return self.bench(points).forces(self.values, self.changes)

    def bench(self, points: ForcePoints) -> ForceBench:
        """Return what the brush needs at points; raises CalibrationError as `ForceBench.of`."""
        return ForceBench.of(self.brush, points, self.reference)


def force_model_of(file: TireFile, effects: Mapping[str, Effect] = CATALOGUE) -> ForceModel:
    """Return the brush of a file with its effects of stage brush.

    Raises
    ------
    CalibrationError
        If the file states no brush.
    FormatError
        If an effect is unknown or without strength; with every fault.
    """
    used, faults = effects_of(file, effects)
    if faults:
        raise FormatError(faults)
    brush = brush_of(file)
    pressure = file.numbers["pressure"].value if "pressure" in file.numbers else np.nan
    return ForceModel(
        file.name,
        brush,
        tuple(each for each in used if each.effect.hook == "brush"),
        (
            _first(brush.reference.load, REFERENCE_LOAD),
            _first(brush.reference.pressure, pressure, REFERENCE_PRESSURE),
        ),
        tuple(item for item in file.extra.get("history", []) if isinstance(item, dict)),
    )


def _first(*values: float) -> float:
    return next(value for value in values if np.isfinite(value))


def quantities_of(campaign: Campaign, points: ForcePoints, quantity: str | None) -> list[str]:
    """Return the forces to look at: the one that is asked for, else those with slip.

    Raises
    ------
    CalibrationError
        If it is not measured.
    """
    data = points.data
    measured = [name for name in FORCES if np.isfinite(getattr(data, name)).any()]
    slipping = [name for name in measured if slips(data, name)]
    wanted = (slipping or measured) if quantity is None else [quantity]
    if not wanted or wanted[0] not in measured:
        raise CalibrationError(
            f"{campaign.header.name}: {quantity or 'Fy, Fx and Mz'} is not measured; there is "
            f"{', '.join(measured) or 'no force at all'}; choose another --quantity"
        )
    return wanted


def usable_points(campaign: Campaign, model: ForceModel, points: ForcePoints) -> ForcePoints:
    """Return the points at which the model's contact is known.

    Raises
    ------
    CalibrationError
        If there is none.
    """
    if model.brush.tire is None and not model.values.get("pressure_power"):
        return points
    known = np.isfinite(points.data.pressure)
    if not known.any():
        raise CalibrationError(
            f"{campaign.header.name}: the inflation pressure is unknown in every run; the model "
            "needs it for the contact length; record it or give it as a set point"
        )
    return points.take(known)


def strain_effects(file: TireFile, model: ForceModel) -> list[str]:
    """Return the names of a file's effects that forces do not show."""
    mine = {used.effect.name for used in model.used}
    named = [entry["effect"] for entry in file.extra.get("effects", []) if isinstance(entry, dict)]
    return [name for name in named if name not in mine]


def slip_of(quantity: str) -> str:
    """Return the slip that a force comes from."""
    return "slip_ratio" if quantity == "Fx" else "slip_angle"


def slips(data: ForceData, name: str) -> bool:
    """Whether the slip that a force comes from varies."""
    span = RATIO_SPAN if name == "Fx" else ANGLE_SPAN
    return bool(np.ptp(getattr(data, slip_of(name))) >= span)
