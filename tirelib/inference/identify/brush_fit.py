"""Brush parameters from the forces of a campaign.

Fy, Fx and Mz over slip angle, slip ratio, load and pressure, by least squares that give single
outliers little weight. The channels are weighed by their own misfit, Fx and Fy together, Mz by a
tenth: enough for the contact length, too little to bend stiffness and friction.
Errors of points in one block (a run, or some seconds of a sweep) may go together; the standard
deviations allow for that. They do not hold the brush's structural misfit that all blocks share.

From Fy alone only c_py a^2 and mu are known; the contact length needs Mz, a tire's ring, or a
measured value.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import Tire
from tirelib.inference.identify.brush_law import SPECS, BrushModel, Reference
from tirelib.inference.identify.brush_problem import ASSUMED_HALF_LENGTH, ROBUST, BrushProblem
from tirelib.inference.identify.error_bands import BandError, band_errors
from tirelib.inference.identify.force_checks import refuse_wrong_forces, slips_vary
from tirelib.inference.identify.force_data import FORCES, ForceData
from tirelib.inference.identify.ring_patch import ring_half

LOAD_RATIO = 1.1
"""Least ratio of the largest load to the smallest from which the power of the load is fitted."""
MOST_STD = 0.5
"""Uncertainty up to which a parameter counts as identified, relative to its size."""
_START_POINTS = 4000


@dataclass(frozen=True, slots=True, eq=False)
class BrushFit:
    """Result of a fit.

    Attributes
    ----------
    problem : BrushProblem
        The problem that was solved; each force has its final scale in it.
    z : shape (p,)
        Its solution.
    covariance : shape (p, p)
        Covariance of z; infinite where the data do not hold a parameter.
    status : tuple of str
        For each fitted parameter: "ok", "at boundary" or "not identifiable from this campaign".
    rmse, r2, peak : mapping of force to float
        Root mean square error, share of variance explained, largest measured size.
    errors : mapping of force to tuple of BandError
        All points, then bands of load, pressure and slip angle.
    """

    problem: BrushProblem
    z: FloatArray
    covariance: FloatArray
    status: tuple[str, ...]
    rmse: Mapping[str, float]
    r2: Mapping[str, float]
    peak: Mapping[str, float]
    errors: Mapping[str, tuple[BandError, ...]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fitted parameters, as in `tirelib.inference.identify.brush_law.SPECS`."""
        return self.problem.names

    @property
    def held(self) -> Mapping[str, tuple[float, str]]:
        """Value and reason of the parameters that were not fitted."""
        return self.problem.fixed

    @property
    def reference(self) -> Reference:
        """Load and pressure of a0."""
        return self.problem.reference

    @property
    def tire(self) -> Tire | None:
        """Gives the half lengths, if any."""
        return self.problem.tire

    @property
    def points(self) -> int:
        """Number of points."""
        return len(self.problem.data)

    @property
    def value(self) -> FloatArray:
        """The fitted parameters in SI, shape (p,)."""
        return self.problem.values_of(self.z)

    @property
    def std(self) -> FloatArray:
        """Their standard deviations; infinite where the data do not hold a parameter."""
        return np.asarray(np.sqrt(np.diag(self.covariance)) * self.problem.slope_of(self.z))

    @property
    def values(self) -> dict[str, float]:
        """Every parameter, fitted or held."""
        return self.problem.at(self.z)

    @property
    def brush(self) -> BrushModel:
        """The brush with these parameters."""
        return BrushModel("fitted", self.values, self.reference, self.tire)


def fit_brush(
    data: ForceData,
    *,
    forces: Sequence[str] | None = None,
    free: Collection[str] = (),
    held: Mapping[str, float] | None = None,
    tire: Tire | None = None,
    robust: float | None = ROBUST,
) -> BrushFit:
    """Fit the brush to measured forces.

    Parameters
    ----------
    forces : sequence of str, optional
        Of Fy, Fx, Mz; by default those that are measured and to which the slips matter.
    free : collection of str
        Parameters fitted besides c_py, c_px, mu, a0, n and the offsets: `pressure_power`,
        `camber_thrust`, `yaw_compliance`, `lateral_compliance`.
    held : mapping of name to value, optional
        Parameters that are known; not fitted.
    tire : Tire, optional
        Its ring gives the half contact length at every load and pressure.
    robust : float or None
        Misfit, in robust standard deviations, from which a point counts less (Huber); None is plain
        least squares.

    Raises
    ------
    CalibrationError
        If the slips do not vary, or the forces are not measured.
    ParameterError
        If a name or an option is not allowed.
    """
    known = dict(held or {})
    wanted = _forces(data, forces)
    refuse_wrong_forces(data, wanted)
    names, fixed = _choose(data, wanted, set(free), known, tire, robust)
    if not names:
        raise ParameterError("brush fit: every parameter is held; leave one free")
    reference = Reference(float(np.median(data.load)), float(np.median(data.pressure)))
    half = ring_half(tire, data)
    problem = BrushProblem(data, wanted, names, fixed, reference, tire, half)
    z = problem.start()
    if len(data) > _START_POINTS:
        z = problem.take(np.arange(0, len(data), len(data) // _START_POINTS)).solve(z, None)
    for loss in (None,) if robust is None and len(wanted) == 1 else (None, robust, robust):
        z = problem.solve(z, loss)
        problem = replace(problem, scale=problem.misfit(z))
    covariance = problem.covariance(z, robust)
    found = problem.predicted(z)
    measured = {name: getattr(data, name) for name in wanted}
    error = {name: getattr(found, name) - measured[name] for name in wanted}
    return BrushFit(
        problem,
        z,
        covariance,
        _status(problem, z, np.sqrt(np.diag(covariance))),
        {name: float(np.sqrt(np.nanmean(e**2))) for name, e in error.items()},
        {name: float(1.0 - np.nanvar(e) / np.nanvar(measured[name])) for name, e in error.items()},
        {name: float(np.nanmax(np.abs(m))) for name, m in measured.items()},
        {name: band_errors(data, e) for name, e in error.items()},
    )


def _forces(data: ForceData, forces: Sequence[str] | None) -> tuple[str, ...]:
    """Return the forces to fit, after a look at what the data can tell."""
    turns, brakes = slips_vary(data)
    useful = {"Fy": turns, "Fx": brakes, "Mz": turns}
    measured = {n: bool(np.isfinite(getattr(data, n)).sum() > 3) for n in FORCES}
    if forces is None:
        chosen = tuple(n for n in FORCES if useful[n] and measured[n])
        if not chosen or chosen == ("Mz",):
            needed = [n for n in ("Fy", "Fx") if useful[n]]
            raise CalibrationError(
                f"brush fit: {' and '.join(needed)} not measured; record what is to be fitted"
            )
        return chosen
    for name in forces:
        if name not in FORCES:
            raise ParameterError(f"brush fit: force {name!r}; allowed are {', '.join(FORCES)}")
        if not measured[name]:
            raise CalibrationError(f"brush fit: {name} is not measured; leave it out of the fit")
        if not useful[name]:
            slip = "slip ratio" if name == "Fx" else "slip angle"
            raise CalibrationError(
                f"brush fit: the {slip} does not vary, so {name} does not determine the brush; "
                f"leave {name} out, or add runs"
            )
    return tuple(dict.fromkeys(forces))


def _choose(
    data: ForceData,
    forces: tuple[str, ...],
    extra: set[str],
    known: dict[str, float],
    tire: Tire | None,
    robust: float | None,
) -> tuple[tuple[str, ...], dict[str, tuple[float, str]]]:
    """Return the parameters to fit, and the others with value and reason."""
    for name in (*extra, *known):
        if name not in SPECS:
            raise ParameterError(
                f"brush fit: {name!r} is no parameter; allowed are {', '.join(SPECS)}"
            )
    for name, value in known.items():
        if not SPECS[name].low <= value <= SPECS[name].high:
            raise ParameterError(
                f"brush fit: held {name} = {value:.6g}; allowed is {SPECS[name].low:g} .. "
                f"{SPECS[name].high:g} {SPECS[name].unit}; give SI"
            )
    if robust is not None and not robust > 0.0:
        raise ParameterError(f"brush fit: robust = {robust:g}; allowed is > 0, or None")
    side, along, yaw = (name in forces for name in ("Fy", "Fx", "Mz"))
    ring = tire is not None
    reasons = {
        "lateral_stiffness": "" if side or yaw else "no slip angle varies",
        "longitudinal_stiffness": "" if along else "no Fx over slip ratio",
        "half_length": "from the ring" if ring else "" if yaw else "assumed: Mz is not fitted",
        "load_power": "from the ring"
        if ring
        else ""
        if data.load.max() > LOAD_RATIO * data.load.min()
        else "one load only",
        "slip_angle_offset": "" if side or yaw else "no slip angle varies",
        "Fy_offset": "" if side else "Fy is not fitted",
        "Mz_offset": "" if yaw else "Mz is not fitted",
        "slip_ratio_offset": "" if along else "Fx is not fitted",
        "Fx_offset": "" if along else "Fx is not fitted",
    }
    if ring:
        extra = extra - {"pressure_power"}
    names: list[str] = []
    held: dict[str, tuple[float, str]] = {}
    for name in SPECS:
        reason = reasons.get(name, "" if name in extra or name == "friction" else "left out")
        if name in known:
            held[name] = (known[name], "given")
        elif not reason or (name in extra and name != "half_length"):
            names.append(name)
        elif name == "half_length" and not ring:
            held[name] = (ASSUMED_HALF_LENGTH, reason)
        elif not SPECS[name].log:
            held[name] = (0.0, reason)
    if "lateral_stiffness" not in (*names, *held):
        # braking alone: one stiffness for both directions
        names = ["lateral_stiffness", *(n for n in names if n != "longitudinal_stiffness")]
    return tuple(names), held


def _status(problem: BrushProblem, z: FloatArray, deviation: FloatArray) -> tuple[str, ...]:
    """Return what can be said of each parameter."""
    low, high = problem.bounds
    bound = np.minimum(z - low, high - z) < 1e-3 * (high - low)
    known = deviation <= MOST_STD
    if problem.fixed.get("half_length", (0.0, ""))[1].startswith("assumed"):
        known &= ~np.isin(problem.names, ("lateral_stiffness", "longitudinal_stiffness"))
    words = np.where(known, "ok", "not identifiable from this campaign")
    return tuple(np.where(bound, "at boundary", words).tolist())
