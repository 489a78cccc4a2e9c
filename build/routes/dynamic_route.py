r"""Chapter 6: sidewall stiffness of the rolling tire from contact angles and loads.

The contact angles are known from the strain rate, so the ring need not look for them (Fig. 6-17):
`fit_edges` gives the load that belongs to them, and

.. math:: k_u = A_p\,e^{B d_0}, \qquad k_v = k_{v,p}

(one A and one k_v per inflation pressure p, one B) are chosen so that it is the measured one. Loads
weigh with what is known of them and of the edges; literature, modal tests and the rubber's modulus
enter as priors.

Taken as printed (raw angles, fixed tread stiffness) the loads come out wrong at small loads,
Fig. 6-21: the rate peaks lie inside the true edges by an angle that hardly depends on the load, a
fifth of a short contact and a tenth of a long one. Here the angles are corrected by the model's own
bias at every step, with the exact ring's strain where displacements are large, and the tread's
stiffness is free. The distance from the compressive peaks to the rate peaks holds the belt's
bending stiffness and is fitted along.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from routes.dynamic_route_damping import Damping, fit_damping
from routes.dynamic_route_problem import (
    AS_PRINTED,
    LEAST_LOADS,
    DynamicOptions,
    DynamicProblem,
    LoadErrors,
)
from routes.dynamic_route_validation import (
    VerticalStiffness,
    predicted_deflection,
    vertical_stiffness,
)
from routes.edges import Edges
from routes.static_route_fit import Quantity
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, ConvergenceError, ParameterError
from tirelib.core.parameters import TireFile
from tirelib.inference.identify.campaign_data import StraightRuns


@dataclass(frozen=True, slots=True)
class DynamicRoute:
    """Result of the route.

    Attributes
    ----------
    quantities : tuple of Quantity
        radial_stiffness and tangential_stiffness at each pressure, radial_deflection_rate,
        bending_stiffness, tread_stiffness, and the pressure slopes.
    names : tuple of str
        Names of the rows of `correlation`.
    correlation : shape (n, n)
    pressures : shape (n_levels,), [Pa]
    edges : Edges
    loads : LoadErrors
    as_printed : LoadErrors or None
        With the dissertation's choices; None where that fit fails.
    vertical : VerticalStiffness or None
        Validation; None without measured loaded radii.
    damping : Damping or None
        By the law that the options name.
    damping_modal : Damping or None
        The same shift by the modal law, Eq. (107), which the models of `tirelib.model` have.
    turn_rate : float, [rad/s]
        Turn rate of the fastest run.
    reasons : tuple of str
        Why something is missing.
    values : mapping
        Names of `Tire`; sidewall values at the mean pressure with slopes. For `dynamic_pressure`.
    """

    quantities: tuple[Quantity, ...]
    names: tuple[str, ...]
    correlation: FloatArray
    pressures: FloatArray
    edges: Edges
    loads: LoadErrors
    as_printed: LoadErrors | None
    vertical: VerticalStiffness | None
    damping: Damping | None
    damping_modal: Damping | None
    turn_rate: float
    reasons: tuple[str, ...]
    values: Mapping[str, float]

    def quantity(self, name: str) -> Quantity:
        """Return a number by name."""
        return next(q for q in self.quantities if q.name == name)


def dynamic_route(
    runs: StraightRuns, start: TireFile, options: DynamicOptions | None = None
) -> DynamicRoute:
    """Identify sidewall stiffness and damping of the rolling tire.

    Parameters
    ----------
    runs : StraightRuns
        What `straight_runs(waves)` has chosen, which has checked gages and geometry.
    start : TireFile
        Geometry, mass, start values and priors (`start_file`); a bending stiffness from
        `ring.frequency_fit.fit_stiffness` or a tread stiffness E b / tau (Eq. 111) with its
        deviation makes a narrow prior.
    options : DynamicOptions

    Raises
    ------
    CalibrationError
        If there are fewer than three different loads, or a waveform shows no contact.
    ConvergenceError
        If the fit does not settle.
    """
    chosen = options or DynamicOptions()
    problem = DynamicProblem(runs, start, chosen)
    fit = problem.solve()
    reasons: list[str] = []
    try:
        printed = DynamicProblem(runs, start, AS_PRINTED)
        before: LoadErrors | None = printed.load_errors(printed.solve())
    except (ConvergenceError, ParameterError) as error:
        before = None
        reasons.append(f"as printed: {error}")
    values, per_run = problem.values(fit.x_values), problem.summary(fit)
    vertical = None
    if np.isfinite(runs.deflection).sum() >= LEAST_LOADS:
        vertical = vertical_stiffness(runs, predicted_deflection(values, problem.points))
    else:
        reasons.append("vertical stiffness: fewer than three measured loaded radii")
    damping = modal = None
    known = runs, problem.strain, values, problem.relative_std(fit)
    try:
        damping = fit_damping(*known, law=chosen.damping_law)
        modal = damping if chosen.damping_law == "modal" else fit_damping(*known, law="modal")
    except (CalibrationError, ConvergenceError, ParameterError) as error:
        reasons.append(f"damping: {error}")
    return DynamicRoute(
        (*fit.few.quantities(), *problem.slopes(fit.few)),
        tuple(p.name for p in fit.few.parameters),
        fit.few.correlation,
        problem.levels,
        problem.edges(fit),
        problem.load_errors(fit),
        before,
        vertical,
        damping,
        modal,
        float(problem.points.omega.max()),
        tuple(reasons),
        {**per_run, **({"damping": damping.value.value} if damping else {})},
    )
