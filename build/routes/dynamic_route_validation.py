"""What the identified tire predicts of stiffness tests, beside the tests (section 6.5.2.1)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.effects.state import Operating, State
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.measured.waveforms import GRID
from tirelib.physics.contact import radial
from tirelib.physics.contact.exact import load_exact
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.frequencies import rim_stiffness

N_MODES = 60
SAME_SERIES = 0.06
"""Relative distance of pressures and speeds within which runs form one load series."""


@dataclass(frozen=True, slots=True)
class VerticalStiffness:
    """Slope of load over loaded radius, one row per load series.

    Attributes
    ----------
    pressure : shape (n,), [Pa]
    speed : shape (n,), [m/s]
    measured, measured_std, predicted : shape (n,), [N/m]
    """

    pressure: FloatArray
    speed: FloatArray
    measured: FloatArray
    measured_std: FloatArray
    predicted: FloatArray

    @property
    def error(self) -> FloatArray:
        """Predicted over measured, less one."""
        out: FloatArray = self.predicted / self.measured - 1.0
        return out


@dataclass(frozen=True, slots=True)
class StiffnessCheck:
    """One stiffness test beside the prediction, [N/m] or, for the torsion, [N m/rad].

    Attributes
    ----------
    name : str
    measured, predicted : float
    """

    name: str
    measured: float
    predicted: float

    @property
    def error(self) -> float:
        """Predicted over measured, less one."""
        return self.predicted / self.measured - 1.0


def predicted_deflection(
    values: Mapping[str, float | FloatArray], points: Operating, *, exact: bool = True
) -> FloatArray:
    """Return the deflection d0 of the undamped model at the points' loads, [m].

    Parameters
    ----------
    exact : bool
        Take large displacements into account (at rest: speed does not matter without damping).
    """
    state = State.of({**values, "damping": 0.0}, points, GRID)
    if exact:
        ring = replace(state.ring, shear_stiffness=np.inf)
        return load_exact(ring, state.tread, points.load).deflection
    ring_linear = compliance(state.ring, points.omega, N_MODES)
    return radial.load(ring_linear, state.tread, points.load, n_nodes=24).deflection


def vertical_stiffness(runs: StraightRuns, predicted: FloatArray) -> VerticalStiffness | None:
    """Compare slopes of load over deflection in every series of three runs or more.

    Parameters
    ----------
    runs : StraightRuns
    predicted : shape (n_runs,), [m]
        Deflections of the model at the measured loads.

    Returns
    -------
    VerticalStiffness or None
        None without such a series.
    """
    c = runs.waves.conditions
    left = np.flatnonzero(np.isfinite(runs.deflection))
    rows: list[tuple[float, ...]] = []
    while left.size:
        first = left[0]
        alike = np.isclose(
            c["pressure"][left], c["pressure"][first], rtol=SAME_SERIES
        ) & np.isclose(c["speed"][left], c["speed"][first], rtol=SAME_SERIES)
        member, left = left[alike], left[~alike]
        load = c["Fz"][member]
        if member.size < 3 or load.max() < 1.25 * load.min():
            continue
        slope, std = _slope(runs.deflection[member], load)
        rows.append(
            (
                c["pressure"][member].mean(),
                c["speed"][member].mean(),
                slope,
                std,
                _slope(predicted[member], load)[0],
            )
        )
    return VerticalStiffness(*np.array(rows).T) if rows else None


def rim_checks(
    values: Mapping[str, float],
    pressure: float,
    *,
    shift: float | None = None,
    turn: float | None = None,
    longitudinal: float | None = None,
    half_angle: float | None = None,
) -> tuple[StiffnessCheck, ...]:
    r"""Compare sidewall and longitudinal stiffness with tests, Eq. (112) corrected.

    S_v = pi R (k_u + k_v) and S_theta = 2 pi R^3 k_v of the sidewall alone; pulled along the road
    the rim moves against a belt that the road holds, which shifts and turns against the rim:

    .. math:: 1/K_x = 1/S_v + R^2/S_\theta + 1/(2 R \varphi_c K_{Gt})

    Parameters
    ----------
    values : mapping
        Numbers of a tire, sidewall at its reference pressure with slopes.
    pressure : float, [Pa]
    shift, turn, longitudinal : float, optional
        Measured S_v [N/m], S_theta [N m/rad], K_x [N/m].
    half_angle : float, optional, [rad]
        Half contact in the longitudinal test, for the tread's part; left out where not given.
    """
    above = pressure - values["pressure"]
    k_u = values["radial_stiffness"] + values["radial_pressure_slope"] * above
    k_v = values["tangential_stiffness"] + values["tangential_pressure_slope"] * above
    R = values["ring_radius"]
    if k_u <= 0 or k_v < 0:
        raise ParameterError(
            f"sidewall at {pressure / 1e5:g} bar: k_u = {k_u:.3g}, k_v = {k_v:.3g} N/m^2; both "
            "must be positive; give a pressure near those of the campaign"
        )
    s_v, s_theta = (float(s) for s in rim_stiffness(R, k_u, k_v))
    softness = 1.0 / s_v + R**2 / s_theta
    if half_angle is not None and values.get("tread_shear_stiffness", 0.0) > 0:
        softness += 1.0 / (2.0 * R * half_angle * values["tread_shear_stiffness"])
    tests = (("S_v", shift, s_v), ("S_theta", turn, s_theta), ("K_x", longitudinal, 1.0 / softness))
    return tuple(
        StiffnessCheck(name, measured, predicted)
        for name, measured, predicted in tests
        if measured is not None
    )


def _slope(deflection: FloatArray, load: FloatArray) -> tuple[float, float]:
    """Return the slope of load over deflection, and its deviation by scatter about a parabola."""
    d = deflection - deflection.mean()
    slope = float(np.sum(d * (load - load.mean())) / np.sum(d**2))
    degree = min(2, d.size - 2)
    rest = load - np.polyval(np.polyfit(d, load, degree), d)
    freedom = max(d.size - degree - 1, 1)
    return slope, float(np.sqrt(np.sum(rest**2) / freedom / np.sum(d**2)))
