"""A solved brush fit with the misfit that its residuals tell."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.brush_cells import cells_of, slip_stiffnesses
from tirelib.inference.identify.brush_fit import BrushFit
from tirelib.inference.identify.brush_misfit import Misfit, misfit_of
from tirelib.inference.identify.brush_problem import BrushProblem
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.ring_patch import ring_half

ROBUST = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A solved problem with its misfit: what intervals and advice are computed from."""

    fit: BrushFit
    problem: BrushProblem
    z: FloatArray
    covariance: FloatArray
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

    @property
    def quantile(self) -> float:
        """Student's factor of a 95 % interval."""
        return float(stdtrit(max(self.misfit.freedom, 1), 0.975))


def study_of(fit: BrushFit, data: ForceData) -> Study:
    """Return the study of a fit to data."""
    half = ring_half(fit.tire, data)
    problem = BrushProblem(data, tuple(fit.rmse), fit.names, fit.held, fit.reference, half)
    z = problem.z_of(fit.value)
    problem = problem.weighed(problem.misfit(z))
    stiffness = stiffness_at(fit, np.array([fit.reference.load]))
    at_zero = {name: float(value[0]) for name, value in stiffness.items()}
    cells = cells_of(problem, z, ROBUST)
    pressure = known_pressure(fit.reference.pressure)
    misfits = tuple(
        misfit_of(cells, fit.reference.load, pressure, smooth=smooth) for smooth in (False, True)
    )
    return Study(fit, problem, z, problem.covariance(z, ROBUST), misfits, at_zero)


def stiffness_at(
    fit: BrushFit, load: FloatArray, pressure: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return 2 c a^2 over slip angle [N/rad] and slip ratio [N], shapes as the load's."""
    zero, none = np.zeros_like(load), np.full_like(load, np.nan)
    where = np.full_like(load, fit.reference.pressure) if pressure is None else pressure
    data = ForceData(load, where, zero, zero, zero, none, none, none, none, zero.astype(np.int64))
    across, along = slip_stiffnesses(fit.parameters(data))
    return {"slip_angle": across, "slip_ratio": along}


def known_pressure(value: float) -> float:
    """Return the pressure, or one for all where none is known."""
    return value if np.isfinite(value) else 1.0
