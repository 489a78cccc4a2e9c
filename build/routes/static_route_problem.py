"""The two fits of `routes.static_route`: from strain, and by pressing the tire."""

import numpy as np

from routes.static_route_fit import FewFit, Parameter, Quantity, fit_few, profile
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import TireFile
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.physics.contact.profiles import convex_concave
from tirelib.physics.contact.static import StaticContact, StaticTire, press_to_deflection
from tirelib.physics.ring.green import modal_response
from tirelib.physics.strain.deformation import (
    arc_nodes,
    contact_deformation,
    series_strain,
    symmetric_series,
)

TERMS = 60
"""Harmonics of strain and of the ring's deformation."""
SMALL = 1e-5
"""Amplitude of a harmonic for which the deformation is asked, [m]."""
NODES = 41
"""Nodes of the finite differences over the contact."""
COMPARED = 9
"""Nodes in half a contact at which deformations are compared; the filter leaves no more."""
DEFLECTION_STD = 3e-4
"""Standard deviation of the measured deflection's zero, [m]."""
OFFSET_STD = 0.05
"""Relative, of the gages' distance from the neutral line, unless the tire file knows better."""
UNIT = 1e-4
"""Scale of deformation residuals, [m]; their true deviation is estimated from the fit."""
STATIC_NODES = 81


class StrainProblem:
    """Deformation by finite differences against that of the ring under a pressure shape."""

    def __init__(
        self,
        series: StraightRuns,
        start: TireFile,
        half: FloatArray,
        middle: FloatArray,
        *,
        zero: float = 0.0,
        offset_factor: float = 1.0,
    ) -> None:
        tire = start.tire
        self.series, self.start, self.half, self.middle = series, start, half, middle
        self.load = series.waves.conditions["Fz"]
        self.deflection = series.deflection + zero
        self.radius, self.offset = tire.ring_radius, tire.innerliner_offset * offset_factor
        coefficients = symmetric_series(GRID, series.strain, middle, TERMS)
        angle = arc_nodes(-half, half, NODES)
        strain = series_strain(coefficients, angle)
        found = contact_deformation(
            strain,
            -half,
            half,
            deflection=self.deflection,
            ring_radius=self.radius,
            free_radius=tire.free_radius,
            liner_offset=self.offset,
        )
        pick = np.linspace(NODES // 2, NODES - 1, COMPARED).round().astype(int)
        self.measured = found.deformation[:, pick]
        self.shape = self._ring_at(angle, pick, series.waves.low_pass)
        self.parameters = self._parameters()

    def _ring_at(self, angle: FloatArray, pick: IntArray, low_pass: LowPass) -> FloatArray:
        """Return deformation at nodes per harmonic of u, filter included, (n, nodes, terms)."""
        n = np.arange(1.0, TERMS + 1.0)
        tire = self.start.tire
        wave = np.cos(angle[..., None] * n)
        gain = np.exp(-0.5 * (low_pass.sigma(1.0) * n) ** 2) - 1.0
        lost = wave * gain * (-self.offset / self.radius**2 * (1.0 - n**2))
        out = []
        for k, half in enumerate(self.half):
            # linear in the strain: what the filter takes from it, with edges that stay; small
            # amplitudes, since a strain of one is refused
            unit = np.concatenate([np.zeros((1, NODES)), SMALL * lost[k].T])
            solved = contact_deformation(
                unit,
                -half,
                half,
                deflection=self.deflection[k],
                ring_radius=self.radius,
                free_radius=tire.free_radius,
                liner_offset=self.offset,
            ).deformation
            out.append(wave[k] + (solved[1:] - solved[0]).T / SMALL)
        return np.stack(out)[:, pick]

    def _parameters(self) -> tuple[Parameter, ...]:
        tire = self.start.tire
        # no prior: the dissertation's fit has none, and the profile shall show what the strain says
        ring = (
            Parameter("bending_stiffness", "N m^2", tire.bending_stiffness, 0.05, 100.0),
            Parameter("radial_stiffness", "N/m^2", 1.5 * tire.radial_stiffness, 5e4, 1e7),
            Parameter("radial_deflection_rate", "1/m", -2.0, -40.0, 20.0, scaled=False),
        )
        shapes: list[Parameter] = []
        for load, half in zip(self.load, self.half, strict=True):
            crown = 5000.0 * (half * self.radius) ** 2
            shapes += [
                Parameter(f"n_p at {load:.0f} N", "-", 3.0, 0.5, 30.0, prior_std=1.0),
                Parameter(
                    f"S_f at {load:.0f} N", "-", crown, 1e-2 * crown, 1e2 * crown, prior_std=1.5
                ),
            ]
        return (*ring, *shapes)

    def pressure(self, x: FloatArray, at: FloatArray | None = None) -> tuple[FloatArray, ...]:
        """Return nodes, weights and pressures (n_loads, n), or pressures at `at`."""
        edge = self.half * self.radius
        found = convex_concave(self.load, -edge, edge, x[3::2], x[4::2], nodes=48)
        vertical = np.sum(found.weight * found.pressure * np.cos(found.x / self.radius), axis=1)
        factor = (self.load / vertical)[:, None]
        if at is not None:
            return (found.pressure_at(at) * factor,)
        return found.x, found.weight, found.pressure * factor

    def deformation(self, x: FloatArray) -> FloatArray:
        """Return the ring's deformation at the compared nodes, (n_loads, COMPARED), [m]."""
        place, weight, pressure = self.pressure(x)
        n = np.arange(1.0, TERMS + 1.0)
        wave = np.cos(place[..., None] / self.radius * n)
        harmonics = np.einsum("li,lin->ln", weight * pressure, wave) / (np.pi * self.radius)
        k_u = x[1] * np.exp(x[2] * self.deflection)
        answer = modal_response(
            n, ring_radius=self.radius, bending_stiffness=x[0], radial_stiffness=k_u[:, None]
        )
        out: FloatArray = np.einsum("lpn,ln->lp", self.shape, answer * harmonics)
        return out

    def residual(self, x: FloatArray) -> FloatArray:
        """Differences of deformation in units of `UNIT`."""
        out: FloatArray = ((self.deformation(x) - self.measured) / UNIT).ravel()
        return out

    def solve(self, half_std: FloatArray) -> tuple[FewFit, tuple[Quantity, ...]]:
        """Fit, widen by the inputs' deviations, and profile the three stiffness numbers."""
        name = f"{self.series.waves.header.name}, static route"
        fit = fit_few(self.residual, self.parameters, where=name, free_scale=True)
        x = np.array(list(fit.values.values()))
        common = np.stack(
            [
                self._moved(half=self.half + half_std).residual(x),
                self._moved(zero=DEFLECTION_STD).residual(x),
                self._moved(offset_factor=1.0 + self._offset_std()).residual(x),
            ]
        ) - self.residual(x)
        scale = max(float(np.sum(fit.residual**2)) / max(fit.residual.size - x.size, 1), 1e-4)
        widened = fit.widened(common)
        quantities = list(widened.quantities())
        for k in range(3):
            # inputs that all loads share count as further variance of the residuals
            shared = float(widened.covariance[k, k] / max(fit.covariance[k, k], 1e-30))
            quantities[k] = profile(
                widened,
                self.residual,
                self.parameters[k].name,
                scale=scale * max(shared, 1.0),
                where=name,
            )
        return widened, tuple(quantities)

    def _offset_std(self) -> float:
        number = self.start.numbers["innerliner_offset"]
        return number.std / abs(number.value) if np.isfinite(number.std) else OFFSET_STD

    def _moved(
        self, half: FloatArray | None = None, zero: float = 0.0, offset_factor: float = 1.0
    ) -> "StrainProblem":
        return StrainProblem(
            self.series,
            self.start,
            self.half if half is None else half,
            self.middle,
            zero=zero,
            offset_factor=offset_factor,
        )


class Conventional:
    """Ring with tread springs pressed by the measured deflection."""

    def __init__(self, series: StraightRuns, start: TireFile) -> None:
        tire = start.tire
        self.series, self.start = series, start
        self.load = series.waves.conditions["Fz"]
        self.deflection = series.deflection
        tolerance = series.waves.header.tolerance
        own = max(tolerance.load if tolerance else 0.005, 2e-3) * self.load
        stiffness = float(np.mean(self.load / self.deflection))
        self.sigma = np.hypot(own, stiffness * 1e-4)
        self.common = (1.5 * stiffness * DEFLECTION_STD / self.sigma)[None, :]
        self.parameters = (
            Parameter(
                "bending_stiffness", "N m^2", tire.bending_stiffness, 0.05, 100.0, prior_std=0.5
            ),
            Parameter(
                "radial_stiffness", "N/m^2", 1.5 * tire.radial_stiffness, 5e4, 1e7, prior_std=1.0
            ),
            Parameter(
                "radial_deflection_rate", "1/m", -1.0, -40.0, 0.0, scaled=False, prior_std=4.0
            ),
            Parameter("tread_stiffness", "N/m^2", tire.tread_stiffness, 5e6, 2e9, prior_std=0.5),
        )

    def contact(self, x: FloatArray) -> StaticContact:
        """Return the contact at the measured deflections."""
        tire = StaticTire(
            ring_radius=self.start.tire.ring_radius,
            free_radius=self.start.tire.free_radius,
            bending_stiffness=float(x[0]),
            radial_stiffness=float(x[1]),
            softening=min(float(x[2]), 0.0),
            tread_stiffness=float(x[3]),
        )
        return press_to_deflection(tire, self.deflection, nodes=STATIC_NODES)

    def residual(self, x: FloatArray) -> FloatArray:
        """Errors of load in standard deviations."""
        try:
            out: FloatArray = (self.contact(x).load - self.load) / self.sigma
        except (ParameterError, ConvergenceError):
            return np.full(self.load.size, 1e3)
        return out

    def solve(self) -> FewFit:
        """Fit the loads."""
        name = f"{self.series.waves.header.name}, conventional route"
        return fit_few(self.residual, self.parameters, where=name, common=self.common)
