"""A solved brush fit with the misfit that its residuals tell, and what the tire has beyond it.

That is its own slope at zero slip, largest force and trail.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.brush_cells import cells_of, slip_stiffnesses
from tirelib.inference.identify.brush_fit import BrushFit
from tirelib.inference.identify.brush_misfit import Misfit, Term, misfit_of
from tirelib.inference.identify.force_data import ForceData

NEAR_ZERO = 0.01
"""Slip, in units of full sliding, between whose signs the slope at zero is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A fit with its misfit: what intervals and advice are computed from.

    Attributes
    ----------
    misfits : tuple of Misfit
        About the brush, and about the curve without a bend.
    stiffness : mapping of slip to float
        2 c a^2 at the reference, [N/rad] and [N].
    """

    fit: BrushFit
    misfits: tuple[Misfit, ...]
    stiffness: Mapping[str, float]

    @property
    def misfit(self) -> Misfit:
        """The likeliest misfit."""
        return max(self.misfits, key=lambda each: each.evidence)

    @property
    def slide(self) -> Mapping[str, float]:
        """Slips at which the whole contact slides, at the reference: [rad] and [-]."""
        size = 3.0 * self.fit.values["friction"] * self.fit.reference.load
        return {
            "slip_angle": float(np.arctan(size / self.stiffness["slip_angle"])),
            "slip_ratio": size / self.stiffness["slip_ratio"],
        }

    def scale_of(self, force: str) -> float | None:
        """Return the scale of a force; None if it was not fitted."""
        forces, scale = self.fit.problem.forces, self.fit.problem.scale
        if force not in forces or scale is None:
            return None
        return float(scale[forces.index(force)])

    @property
    def quantile(self) -> float:
        """Student's factor of a 95 % interval."""
        return float(stdtrit(max(self.misfit.freedom, 1), 0.975))


def study_of(fit: BrushFit) -> Study:
    """Return the study of a fit."""
    stiffness = stiffness_at(fit, np.array([fit.reference.load]))
    at_zero = {name: float(value[0]) for name, value in stiffness.items()}
    cells = cells_of(fit.problem, fit.z)
    pressure = known_pressure(fit.reference.pressure)
    misfits = tuple(
        misfit_of(cells, fit.reference.load, pressure, smooth=smooth) for smooth in (False, True)
    )
    return Study(fit, misfits, at_zero)


def stiffness_at(
    fit: BrushFit, load: FloatArray, pressure: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return 2 c a^2 over slip angle [N/rad] and slip ratio [N], shapes as the load's."""
    where = np.full_like(load, fit.reference.pressure) if pressure is None else pressure
    data = ForceData(load, where, np.zeros_like(load))
    across, along = slip_stiffnesses(fit.brush.parameters(data))
    return {"slip_angle": across, "slip_ratio": along}


def known_pressure(value: float) -> float:
    """Return the pressure, or one for all where none is known."""
    return value if np.isfinite(value) else 1.0


def property_terms(study: Study, name: str) -> list[Term]:
    """Return what the tire's own property has beyond the best brush, for the parameter's z."""
    load, pressure = study.misfit.load, study.misfit.pressure
    forces = set(study.fit.rmse)
    side = "slip_angle" if "Fy" in forces else "slip_ratio"

    def slope(slip: str, factor: float) -> list[Term]:
        return slope_terms(study, slip, factor, load, pressure, study.stiffness[slip])

    def length(factor: float) -> list[Term]:
        """Return ln a = ln 3 + ln (slope of Mz) - ln C."""
        slide = study.slide["slip_angle"]
        moment = study.stiffness["slip_angle"] * study.fit.values["half_length"] / 3.0
        trail = _pair(study, "Mz", (load, pressure), "slip_angle", slide, NEAR_ZERO, moment, factor)
        return [*trail, *slope("slip_angle", -factor)]

    has_length = "half_length" in study.fit.names and {"Fy", "Mz"} <= forces
    if name == "friction":
        force, slide = "Fy" if side == "slip_angle" else "Fx", study.slide[side]
        each = study.fit.values["friction"] * load / slide
        return _pair(study, force, (load, pressure), side, slide, 1.0, each)
    if name == "half_length" and has_length:
        return length(1.0)
    if name in ("lateral_stiffness", "longitudinal_stiffness"):
        along = name == "longitudinal_stiffness" or side == "slip_ratio"
        own = slope("slip_ratio" if along else "slip_angle", 1.0)
        return own + (length(-2.0) if has_length else [])
    return []


def slope_terms(
    study: Study, slip: str, factor: float, load: float, pressure: float, size: float
) -> list[Term]:
    """Return factor times the change of ln C by the misfit's slope at zero slip."""
    slide = 3.0 * study.fit.values["friction"] * load / size
    force, at = "Fy" if slip == "slip_angle" else "Fx", (load, known_pressure(pressure))
    return _pair(study, force, at, slip, slide, NEAR_ZERO, size, factor)


def _pair(
    study: Study,
    force: str,
    at: tuple[float, float],
    slip: str,
    slide: float,
    share: float,
    slope: float,
    factor: float = 1.0,
) -> list[Term]:
    """Return the change of the logarithm of a slope over the slip by the misfit, times a factor.

    The slope is a force's between two slips of opposite sign, at a share of that at which all
    slides, and at a load and pressure. Nothing is returned for a force that was not fitted.
    """
    scale = study.scale_of(force)
    if scale is None:
        return []
    reach, sign = share * slide, -1.0 if force == "Fy" else 1.0
    each = sign * factor * scale / (2.0 * reach * slope)

    def place(slip_there: float) -> tuple[float, ...]:
        if slip == "slip_angle":
            return *at, slip_there, 0.0, 0.0, slide, 1.0
        return *at, 0.0, slip_there, 0.0, 1.0, slide

    return [Term(force, place(s * reach), s * each) for s in (1.0, -1.0)]
