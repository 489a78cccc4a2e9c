r"""Chapter 5: bending and sidewall stiffness and contact pressure of one series of loads.

Two routes run side by side, both with the static ring of radial springs (no tension, no tangential
springs: what the inflation tension carries appears in its EI and k_u).

from strain
    The symmetric part of each load's strain gives the belt's deformation in the contact, Eq. (36)
    to (40), between edges known from the strain rate. One EI, k_u = A exp(B d0) and a pressure
    shape (n_p, S_f) of Eq. (53) per load are chosen so that the ring under it deforms alike.
conventional
    The same ring with tread springs is pressed by the measured deflection; EI, k_u and k_t are
    chosen so that it carries the measured load.

The gage's strain has gone through the signal chain's filter, which rounds it at the edges; the
ring's deformation goes through the same filter before both are compared.

The dissertation notes that k_u hardly matters in the first fit. The shape of the deformation alone
indeed leaves it open, because the pressure shape can make up for it; its level, set by the measured
deflection, does not. Intervals of the stiffness numbers are taken from the profile of the cost, and
a number that the cost leaves open is flagged.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from routes.dynamic_route_validation import SAME_SERIES
from routes.edges import Edges, corrected, edge_bias, read_edges
from routes.static_route_fit import FewFit, Quantity
from routes.static_route_problem import Conventional, StrainProblem
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import CalibrationError, ConvergenceError, ParameterError
from tirelib.core.parameters import TireFile
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.model.base import operating_points, values_of
from tirelib.physics.contact.static import StaticContact

LEAST_LOADS = 3


@dataclass(frozen=True, slots=True)
class PressureShape:
    """Pressure over the contact at one load.

    Attributes
    ----------
    load : float, [N]
    x : shape (n,), [m]
        Forward, from trailing to leading edge.
    strain_based, conventional : shape (n,), [N/m]
        Zero outside of each one's contact; the second NaN where the conventional route failed.
    centre_pressure : Quantity, [N/m]
        Strain-based, in the middle.
    n_p, S_f : Quantity
    """

    load: float
    x: FloatArray
    strain_based: FloatArray
    conventional: FloatArray
    centre_pressure: Quantity
    n_p: Quantity
    S_f: Quantity


@dataclass(frozen=True, slots=True)
class ContactLengths:
    """Contact length by method, one row per load (Fig. 5-18), [m].

    Attributes
    ----------
    load : [N]
    read : by the strain-rate peaks as they stand
    corrected, corrected_std : with the reading's bias taken off
    conventional, conventional_std : of the ring pressed by the measured deflection; NaN if that
        failed
    """

    load: FloatArray
    read: FloatArray
    corrected: FloatArray
    corrected_std: FloatArray
    conventional: FloatArray
    conventional_std: FloatArray


@dataclass(frozen=True, slots=True)
class StaticRoute:
    """Result of both routes.

    Attributes
    ----------
    run : shape (n_loads,)
    pressure, speed : float, [Pa], [m/s]
        Condition of the series.
    strain_based : tuple of Quantity
        bending_stiffness, radial_stiffness (A), radial_deflection_rate (B), then n_p and S_f of
        each load; the first three with intervals by profile.
    conventional : tuple of Quantity
        bending_stiffness, radial_stiffness, radial_deflection_rate, tread_stiffness.
    correlation, conventional_correlation : square arrays
        Rows in the order of the quantities.
    misfit : shape (n_loads,), [m]
        Rms difference of the deformations, strain-based.
    load_error : shape (n_loads,)
        Relative error of the load by the conventional route.
    edges : Edges
    lengths : ContactLengths
    pressures : tuple of PressureShape
    reasons : tuple of str
        Why something is missing.
    """

    run: IntArray
    pressure: float
    speed: float
    strain_based: tuple[Quantity, ...]
    conventional: tuple[Quantity, ...]
    correlation: FloatArray
    conventional_correlation: FloatArray
    misfit: FloatArray
    load_error: FloatArray
    edges: Edges
    lengths: ContactLengths
    pressures: tuple[PressureShape, ...]
    reasons: tuple[str, ...]


def static_route(
    runs: StraightRuns, start: TireFile, *, values: Mapping[str, float] | None = None
) -> StaticRoute:
    """Identify belt and pressure from the series with the most loads.

    Parameters
    ----------
    runs : StraightRuns
    start : TireFile
        Geometry, start values and priors.
    values : mapping, optional
        Numbers of a tire known better (the dynamic route's), for the bias of the edges' reading.

    Raises
    ------
    CalibrationError
        If no series holds three different loads with measured loaded radius.
    ConvergenceError
        If the strain-based fit does not settle.
    """
    member = load_series(runs)
    series = replace(
        runs,
        waves=runs.waves.take(member),
        strain=runs.strain[member],
        deflection=runs.deflection[member],
    )
    edges = _edges(series, start, values)
    problem = StrainProblem(series, start, edges.half, edges.middle)
    fit, quantities = problem.solve(edges.half_std)
    reasons: list[str] = []
    conventional = Conventional(series, start)
    try:
        pressed_fit: FewFit | None = conventional.solve()
    except (ConvergenceError, ParameterError) as error:
        pressed_fit = None
        reasons.append(f"conventional: {error}")
    return _result(series, problem, fit, quantities, conventional, pressed_fit, edges, reasons)


def load_series(runs: StraightRuns) -> IntArray:
    """Return the runs of one pressure and speed with the most loads, in order of load.

    Raises
    ------
    CalibrationError
        If none has three loads 4 % apart with measured loaded radius.
    """
    c = runs.waves.conditions
    known = np.isfinite(runs.deflection)
    best = np.zeros(0, dtype=np.int64)
    for first in range(len(runs.waves)):
        member = np.flatnonzero(
            known
            & np.isclose(c["pressure"], c["pressure"][first], rtol=SAME_SERIES)
            & np.isclose(c["speed"], c["speed"][first], rtol=SAME_SERIES)
        )
        member = member[np.argsort(c["Fz"][member])]
        load = c["Fz"][member]
        if load.size:
            member = member[np.concatenate([[True], np.diff(load) > 0.04 * load[1:]])]
        if member.size > best.size:
            best = member
    if best.size < LEAST_LOADS:
        raise CalibrationError(
            f"{runs.waves.header.name}: the largest series of one pressure and speed has "
            f"{best.size} different loads with a measured loaded radius ({int(known.sum())} of "
            f"{len(runs.waves)} runs have one); {LEAST_LOADS} or more are needed; add runs, or "
            "record the loaded radius"
        )
    return best


def _edges(series: StraightRuns, start: TireFile, values: Mapping[str, float] | None) -> Edges:
    waves = series.waves
    noise = waves.scatter / np.sqrt(np.maximum(waves.turns, 1))
    reading = read_edges(
        series.strain, low_pass=waves.low_pass, noise=noise, labels=waves.run.tolist()
    )
    known = dict(values) if values is not None else values_of(start.tire)
    bias = edge_bias(known, operating_points(waves), low_pass=waves.low_pass)
    return corrected(waves.run.astype(float), reading, bias, waves.angle_std)


def _result(
    series: StraightRuns,
    problem: StrainProblem,
    fit: FewFit,
    quantities: tuple[Quantity, ...],
    conventional: Conventional,
    pressed_fit: FewFit | None,
    edges: Edges,
    reasons: list[str],
) -> StaticRoute:
    c = series.waves.conditions
    x = np.array(list(fit.values.values()))
    rolled = 2.0 * c["speed"] / c["omega"]
    missing = np.full(len(series.waves), np.nan)
    half, half_std, load_error, contact = missing, missing, missing, None
    if pressed_fit is not None:
        best = np.array(list(pressed_fit.values.values()))
        contact = conventional.contact(best)
        half, load_error = contact.half_angle, contact.load / conventional.load - 1.0
        half_std = _spread(pressed_fit, lambda v: conventional.contact(v).half_angle)
    shapes = _shapes(problem, fit, quantities, contact, x)
    misfit = np.sqrt(np.mean((problem.deformation(x) - problem.measured) ** 2, axis=1))
    return StaticRoute(
        series.waves.run,
        float(c["pressure"].mean()),
        float(c["speed"].mean()),
        quantities,
        () if pressed_fit is None else pressed_fit.quantities(),
        fit.correlation,
        np.zeros((0, 0)) if pressed_fit is None else pressed_fit.correlation,
        misfit,
        load_error,
        edges,
        ContactLengths(
            c["Fz"],
            rolled * edges.reading.half,
            rolled * edges.half,
            rolled * edges.half_std,
            rolled * half,
            rolled * half_std,
        ),
        shapes,
        tuple(reasons),
    )


def _shapes(
    problem: StrainProblem,
    fit: FewFit,
    quantities: tuple[Quantity, ...],
    contact: StaticContact | None,
    x: FloatArray,
) -> tuple[PressureShape, ...]:
    R = problem.radius
    wide = 1.3 * float(problem.half.max()) * R
    grid = np.linspace(-wide, wide, 121)
    every = np.broadcast_to(grid, (problem.half.size, grid.size))
    strain_based = problem.pressure(x, every)[0]
    middle = np.zeros((problem.half.size, 1))
    centre = problem.pressure(x, middle)[0][:, 0]
    std = _spread(fit, lambda v: problem.pressure(v, middle)[0][:, 0])
    out = []
    for k in range(problem.half.size):
        other = np.full(grid.size, np.nan)
        if contact is not None:
            # the static contact's angle is zero at the road and runs like the wheel angle
            other = np.interp(grid / R, contact.angle[k], contact.pressure[k], left=0.0, right=0.0)
        out.append(
            PressureShape(
                float(problem.load[k]),
                grid,
                strain_based[k],
                other,
                Quantity.of("centre_pressure", "N/m", float(centre[k]), float(std[k])),
                quantities[3 + 2 * k],
                quantities[4 + 2 * k],
            )
        )
    return tuple(out)


def _spread(fit: FewFit, quantity: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return the standard deviation of derived numbers by the fit's covariance."""
    step = 1e-3

    def at(coordinates: FloatArray) -> FloatArray:
        pairs = zip(fit.parameters, coordinates, strict=True)
        inside = [min(max(p.outward(float(v)), p.lowest), p.highest) for p, v in pairs]
        return np.asarray(quantity(np.array(inside)), dtype=float)

    base = at(fit.x)
    columns = []
    for k in range(fit.x.size):
        moved = fit.x.copy()
        moved[k] += step
        columns.append((at(moved) - base) / step)
    slopes = np.stack(columns, axis=-1)
    out: FloatArray = np.sqrt(np.einsum("li,ij,lj->l", slopes, fit.covariance, slopes))
    return out
