"""Parameters, data and residuals of the fit of `routes.dynamic_route`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from routes.correction import Correction, large_displacements
from routes.dynamic_route_validation import predicted_deflection
from routes.edges import STRUCTURE, Edges, corrected, edge_bias, model_edges, read_edges
from routes.static_route_fit import FewFit, Parameter, Quantity, fit_few
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import CalibrationError, ConvergenceError, ParameterError
from tirelib.core.parameters import TireFile
from tirelib.effects.state import State
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.measured.waveforms import GRID
from tirelib.model.base import operating_points, values_of
from tirelib.physics.contact import radial
from tirelib.physics.ring.compliance import compliance

N_MODES = 60
OUTER = 2
LEAST_LOADS = 3
LEVEL = 0.04
"""Relative distance of inflation pressures that makes two levels."""
PEAK_STD = 0.04
"""Relative deviation of the peaks' distance: what a ring does not know of it."""
OWN = 0.3
"""Share of the edges' structural deviation that differs from run to run; the rest is common."""
EDGE_NOISE = 2e-4
"""Least deviation of one run's half angle, [rad]."""
TYPICAL_BIAS = 0.025
"""Size of the half angle's bias, [rad], for the deviation of what no ring knows of it."""
B_STD = 4.0
"""Prior deviation of B about zero, [1/m]."""


@dataclass(frozen=True, slots=True)
class DynamicOptions:
    """Choices of the route.

    Attributes
    ----------
    gage : str
        "belt" takes the mean over the working gages (the ring is as wide as the belt), "centre"
        the centre gage alone, as the dissertation.
    correct_edges : bool
        Take the reading's bias off.
    free_tread : bool
        Let the tread's stiffness move within its prior.
    use_peaks : bool
        Fit the compressive peaks' distance, which informs the bending stiffness.
    damping_law : str
        "sidewall" dashpots or the dissertation's "modal" ratio.
    """

    gage: Literal["belt", "centre"] = "belt"
    correct_edges: bool = True
    free_tread: bool = True
    use_peaks: bool = True
    damping_law: Literal["sidewall", "modal"] = "sidewall"


AS_PRINTED = DynamicOptions("centre", False, False, False, "modal")
"""The dissertation's own choices, for comparison (Fig. 6-21)."""


@dataclass(frozen=True, slots=True)
class LoadErrors:
    """Loads of the runs and what the contact angles make of them, shape (n_runs,), [N].

    Attributes
    ----------
    run, measured, estimated, std : arrays
        std is the expected error of `estimated - measured`.
    """

    run: IntArray
    measured: FloatArray
    estimated: FloatArray
    std: FloatArray

    @property
    def relative(self) -> FloatArray:
        """Estimated over measured, less one."""
        out: FloatArray = self.estimated / self.measured - 1.0
        return out

    @property
    def rms(self) -> float:
        """Rms of the relative errors."""
        return float(np.sqrt(np.mean(self.relative**2)))


@dataclass(frozen=True, slots=True)
class Solved:
    """A settled fit.

    Attributes
    ----------
    few : FewFit
    x_values : shape (n_parameters,)
        Values in the order of the parameters.
    correction : Correction or None
        For large displacements, at the solution.
    load, load_std : shape (n_runs,), [N]
        Loads that belong to the contact angles, and their expected errors.
    """

    few: FewFit
    x_values: FloatArray
    correction: Correction | None
    load: FloatArray
    load_std: FloatArray


class DynamicProblem:
    """Parameters, data and residuals of one fit."""

    def __init__(self, runs: StraightRuns, start: TireFile, options: DynamicOptions) -> None:
        self.runs, self.start, self.options = runs, start, options
        waves = runs.waves
        centre = int(np.argmin(np.abs(np.array(waves.header.gage_lateral))))
        self.strain = waves.strain[:, centre] if options.gage == "centre" else runs.strain
        points = operating_points(waves)
        self.points = points
        noise = waves.scatter / np.sqrt(np.maximum(waves.turns, 1))
        self.reading = read_edges(
            self.strain, low_pass=waves.low_pass, noise=noise, labels=waves.run.tolist()
        )
        self.levels, self.level = pressure_levels(points.pressure)
        self._check_loads()
        self.base = values_of(start.tire)
        # the dissertation's ring: inextensible, Euler-Bernoulli; damping comes last
        self.base |= {"damping": 0.0, "extension_stiffness": np.inf, "shear_stiffness": np.inf}
        self.deflection = self._typical_deflection()
        self.parameters = self._parameters()
        tolerance = waves.header.tolerance
        self.load_std = max(tolerance.load if tolerance else 0.005, 1e-3) * points.load
        self.correction: Correction | None = None

    def _check_loads(self) -> None:
        loads = np.sort(self.points.load)
        distinct = 1 + int(np.sum(np.diff(loads) > 0.04 * loads[1:]))
        if distinct < LEAST_LOADS:
            raise CalibrationError(
                f"{self.runs.waves.header.name}: {distinct} different loads from {loads[0]:.0f} to "
                f"{loads[-1]:.0f} N; A, B and k_v need {LEAST_LOADS} or more, 4 % apart; add runs "
                "at other loads"
            )

    def _typical_deflection(self) -> FloatArray:
        """Deflection by the start values: B only needs where the loads lie against each other."""
        return predicted_deflection(self.base, self.points, exact=False)

    def _parameters(self) -> tuple[Parameter, ...]:
        tire, numbers = self.start.tire, self.start.numbers

        def spread(name: str, usual: float) -> float:
            number = numbers.get(name)
            if number is None or not np.isfinite(number.std) or number.std <= 0:
                return usual
            return number.std / abs(number.value)

        out = []
        for p in self.levels:
            above = float(p) - tire.pressure
            for side, usual, low, high in (
                ("radial", 0.4, 2e4, 5e6),
                ("tangential", 0.5, 5e3, 3e6),
            ):
                name = f"{side}_stiffness"
                slope = getattr(tire, f"{side}_pressure_slope")
                value = float(np.clip(getattr(tire, name) + slope * above, 2 * low, high / 2))
                out.append(
                    Parameter(
                        f"{name} at {p / 1e5:.2f} bar",
                        "N/m^2",
                        value,
                        low,
                        high,
                        prior_std=spread(name, usual),
                    )
                )
        out.append(
            Parameter(
                "radial_deflection_rate",
                "1/m",
                tire.radial_deflection_rate,
                -30.0,
                20.0,
                scaled=False,
                prior_std=B_STD,
            )
        )
        if self.options.use_peaks:
            out.append(
                Parameter(
                    "bending_stiffness",
                    "N m^2",
                    tire.bending_stiffness,
                    0.1,
                    50.0,
                    prior_std=spread("bending_stiffness", 0.5),
                )
            )
        if self.options.free_tread:
            out.append(
                Parameter(
                    "tread_stiffness",
                    "N/m^2",
                    tire.tread_stiffness,
                    5e6,
                    2e9,
                    prior_std=spread("tread_stiffness", 0.5),
                )
            )
        return tuple(out)

    def values(self, x: FloatArray) -> dict[str, float | FloatArray]:
        """Return a tire's values with one sidewall stiffness per run."""
        named = dict(zip([p.name for p in self.parameters], x, strict=True))
        n = self.levels.size
        rate = named["radial_deflection_rate"]
        out = dict(self.base)
        out["radial_stiffness"] = x[0 : 2 * n : 2][self.level] * np.exp(rate * self.deflection)
        out["tangential_stiffness"] = x[1 : 2 * n : 2][self.level]
        out["radial_pressure_slope"] = out["tangential_pressure_slope"] = 0.0
        for name in ("bending_stiffness", "tread_stiffness"):
            if name in named:
                out[name] = float(named[name])
        return out

    def estimate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the load that belongs to each run's contact angles, and the peaks' distance."""
        values = self.values(x)
        half, distance = self.reading.half, self.reading.peak_distance
        if self.options.correct_edges or self.options.use_peaks:
            model = model_edges(
                values, self.points, low_pass=self.runs.waves.low_pass, correction=self.correction
            )
            distance = model.reading.peak_distance
            if self.options.correct_edges:
                half = half - 0.5 * (model.bias[:, 1] - model.bias[:, 0])
        return self.load_of(values, half), distance

    def load_of(self, values: Mapping[str, float | FloatArray], half: FloatArray) -> FloatArray:
        """Return the loads of symmetric contacts of given half angles."""
        state = State.of(values, self.points, GRID)
        ring = compliance(state.ring, self.points.omega, N_MODES)
        edges = np.stack([-half, half], axis=1)
        return radial.fit_edges(ring, state.tread, edges, n_nodes=24).load

    def _slope(self, values: Mapping[str, float | FloatArray]) -> FloatArray:
        """Change of load by half angle, [N/rad]."""
        half = self.reading.half + 0.02
        step = 1e-3
        upper = self.load_of(values, half + step)
        slope: FloatArray = (upper - self.load_of(values, half - step)) / (2.0 * step)
        return slope

    def residual(self, x: FloatArray) -> FloatArray:
        """Errors of load and peak distance in standard deviations."""
        try:
            load, distance = self.estimate(x)
        except (ParameterError, ConvergenceError):
            return np.full(self._size, 1e3)
        out: FloatArray = (load - self.points.load) / self.sigma
        if self.options.use_peaks:
            measured = self.reading.peak_distance
            out = np.concatenate([out, (distance / measured - 1.0) / PEAK_STD])
        return out

    @property
    def _size(self) -> int:
        return len(self.points) * (2 if self.options.use_peaks else 1)

    def solve(self) -> Solved:
        """Fit; the correction for large displacements follows the parameters."""
        x = np.array([p.start for p in self.parameters])
        for _ in range(OUTER):
            values = self.values(x)
            if self.options.correct_edges:
                self.correction = large_displacements(values, self.points, self.runs.waves.low_pass)
            slope = self._slope(values)
            structure = STRUCTURE * TYPICAL_BIAS
            self.sigma = np.hypot(self.load_std, slope * np.hypot(EDGE_NOISE, OWN * structure))
            common = np.zeros((2, self._size))
            common[0, : len(self.points)] = slope * structure / self.sigma
            common[1, len(self.points) :] = 1.0
            few = fit_few(
                self.residual,
                self.parameters,
                where=self.runs.waves.header.name,
                common=common,
                begin=x,
            )
            x = np.array(list(few.values.values()))
            self.deflection = predicted_deflection(self.values(x), self.points, exact=False)
        return Solved(few, x, self.correction, self.estimate(x)[0], self.sigma)

    def load_errors(self, fit: Solved) -> LoadErrors:
        """Return loads by the contact angles beside the measured ones."""
        return LoadErrors(self.runs.waves.run, self.points.load, fit.load, fit.load_std)

    def relative_std(self, fit: Solved) -> dict[str, float]:
        """Return relative deviations for what depends on the parameters."""
        wide = {"bending_stiffness": 0.3, "tread_stiffness": 0.3}
        for name in wide:
            names = [p.name for p in fit.few.parameters]
            if name in names:
                k = names.index(name)
                wide[name] = float(np.sqrt(fit.few.covariance[k, k]))
        deviation = np.sqrt(np.diag(fit.few.covariance))
        n = self.levels.size
        wide["radial_stiffness"] = float(deviation[0 : 2 * n : 2].mean())
        wide["tangential_stiffness"] = float(deviation[1 : 2 * n : 2].mean())
        mass = self.start.numbers.get("mass")
        known = mass is not None and np.isfinite(mass.std)
        wide["mass"] = mass.std / mass.value if mass is not None and known else 0.1
        return wide

    def edges(self, fit: Solved) -> Edges:
        """Return contact angles, corrected with the fitted tire."""
        plausible = {k: v for k, v in self.relative_std(fit).items() if k != "mass"}
        bias = edge_bias(
            self.values(fit.x_values),
            self.points,
            plausible=plausible,
            low_pass=self.runs.waves.low_pass,
            correction=fit.correction,
        )
        waves = self.runs.waves
        return corrected(waves.run.astype(float), self.reading, bias, waves.angle_std)

    def slopes(self, few: FewFit) -> tuple[Quantity, ...]:
        """Return stiffness over pressure; with one pressure it cannot be identified."""
        out = []
        p = self.levels
        for offset, side in ((0, "radial"), (1, "tangential")):
            name, unit = f"{side}_pressure_slope", "N/m^2/Pa"
            if p.size < 2:
                start = float(getattr(self.start.tire, name))
                out.append(
                    Quantity(name, unit, start, np.inf, -np.inf, np.inf, ("not_identifiable",))
                )
                continue
            rows = np.arange(offset, 2 * p.size, 2)
            k = np.array(list(few.values.values()))[rows]
            weight = (p - p.mean()) / np.sum((p - p.mean()) ** 2)
            scale = weight * k
            std = float(np.sqrt(scale @ few.covariance[np.ix_(rows, rows)] @ scale))
            slope = float(weight @ k)
            flags = ("not_identifiable",) if 1.96 * std > abs(slope) else ()
            out.append(Quantity.of(name, unit, slope, std, *flags))
        return tuple(out)

    def summary(self, fit: Solved) -> dict[str, float]:
        """Return values of `Tire` at the campaign's mean pressure."""
        x = np.array(list(fit.few.values.values()))
        n, p = self.levels.size, self.levels
        out = {name: float(np.mean(value)) for name, value in self.values(x).items()}
        for offset, side in ((0, "radial"), (1, "tangential")):
            k = x[offset : 2 * n : 2]
            slope = float(np.polyfit(p, k, 1)[0]) if n > 1 else 0.0
            out[f"{side}_stiffness"] = float(k.mean())
            out[f"{side}_pressure_slope"] = slope
        out["pressure"] = float(p.mean())
        out["radial_deflection_rate"] = fit.few.values["radial_deflection_rate"]
        return out


def pressure_levels(pressure: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the mean of each level of inflation pressure, and every run's level."""
    order = np.argsort(pressure)
    jump = np.diff(pressure[order]) > LEVEL * pressure[order][1:]
    level = np.empty(pressure.size, dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(jump)])
    means = np.array([pressure[level == k].mean() for k in range(int(level.max()) + 1)])
    return means, level
