"""The base model and the parameters that a campaign may inform."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import FIELDS, Tire
from tirelib.effects.state import Operating, State
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID, Waveforms
from tirelib.model.chain import Changes, waveform
from tirelib.physics.contact.free_boundary import Start


@dataclass(frozen=True, slots=True)
class Coordinate:
    """How a parameter moves: by a factor exp(z), or by z times a unit.

    Attributes
    ----------
    name : str
        Field name of `Tire`.
    unit : float
        Change for z = 1; zero means that the parameter is scaled by exp(z).
    """

    name: str
    unit: float = 0.0

    def moved(self, value: float | FloatArray, z: float | FloatArray) -> float | FloatArray:
        """Return the parameter's value after a move."""
        return value * np.exp(z) if self.unit == 0.0 else value + self.unit * z

    def distance(self, value: float | FloatArray, other: float | FloatArray) -> float | FloatArray:
        """Return the move z from a value to another."""
        return np.log(other / value) if self.unit == 0.0 else (other - value) / self.unit

    def ends(self, value: float) -> tuple[float, float]:
        """Return the moves z from a value to the ends of the parameter's range (`FIELDS`)."""
        field = FIELDS[self.name]
        if self.unit == 0.0:  # a factor keeps the sign
            side = (field.lowest, field.highest) if value > 0.0 else (-field.highest, -field.lowest)
            with np.errstate(divide="ignore"):
                low, high = np.log(np.maximum(side, 0.0) / abs(value))
        else:
            low, high = ((x - value) / self.unit for x in (field.lowest, field.highest))
        return min(float(low), 0.0), max(float(high), 0.0)

    def spread(self, value: float, std: float) -> float:
        """Return a standard deviation of z as one of the value."""
        return abs(value) * std if self.unit == 0.0 else self.unit * std


FREE: tuple[Coordinate, ...] = (
    Coordinate("bending_stiffness"),
    Coordinate("radial_stiffness"),
    Coordinate("radial_pressure_slope", 1.0),
    Coordinate("tangential_stiffness"),
    Coordinate("tangential_pressure_slope", 1.0),
    Coordinate("tread_stiffness"),
    Coordinate("innerliner_offset"),
)
"""Parameters of the linear ring that strain waveforms of a campaign may inform."""
BARE: tuple[Coordinate, ...] = (*FREE, Coordinate("extension_stiffness"))
"""Those of the dissertation's ring, whose belt does not shear: an inextensible one would put the
belt's stretch into all other numbers."""
PLAIN: tuple[Coordinate, ...] = (
    *BARE,
    Coordinate("shear_stiffness"),
    Coordinate("rotary_inertia"),
    Coordinate("tread_shear_stiffness"),
    Coordinate("tread_hardening"),
    Coordinate("section_pull", 0.03),
    Coordinate("liner_share", 0.4),
    Coordinate("offset_pressure_slope", 0.02),
    Coordinate("tread_poisson", 0.3),
    Coordinate("contact_crown"),
    Coordinate("creep"),
    Coordinate("tread_spread"),
    Coordinate("centrifugal_tension"),
)
"""Those of the plain tire: every belt shears and has section inertia, and sidewalls that spin with
it, every gage sits on layers that the shear force leaves alone and whose distance to the neutral
line changes with the pressure, every tread holds on to the road
with a friction that grows with slip, hardens and grows wider when it is pressed, spreads the
pressure over its thickness, and its strips meet the road one after the other."""


def coordinates(values: Mapping[str, float | FloatArray]) -> tuple[Coordinate, ...]:
    """Return what a fit to strain moves: of the plain tire, or of a belt that does not shear."""
    return PLAIN if bool(np.isfinite(values["shear_stiffness"]).all()) else BARE


def values_of(tire: Tire) -> dict[str, float | FloatArray]:
    """Return a tire's values by name."""
    return asdict(tire)


def move(
    values: Mapping[str, float | FloatArray], z: FloatArray, free: tuple[Coordinate, ...] = FREE
) -> dict[str, float | FloatArray]:
    """Return the values after moving the free coordinates by z, shape (n_free,)."""
    out = dict(values)
    for coordinate, step in zip(free, z, strict=True):
        out[coordinate.name] = coordinate.moved(values[coordinate.name], float(step))
    return out


def operating_points(waves: Waveforms) -> Operating:
    """Return the conditions of a campaign's runs, as measured."""
    c = waves.conditions
    n = len(waves)
    order = np.argsort(np.argsort(waves.start, kind="stable"), kind="stable") / max(n - 1, 1)
    unknown = np.full(n, np.nan)
    return Operating(
        load=c["Fz"],
        pressure=c["pressure"],
        omega=c["omega"],
        speed=c["speed"],
        camber=c["camber"],
        slip_angle=c["slip_angle"],
        slip_ratio=c["slip_ratio"],
        side_force=c["Fy"],
        drive_force=c["Fx"],
        order=order.astype(float),
        temperature=waves.extra.get("temperature", waves.extra.get("tread_temperature", unknown)),
    )


def predict(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    changes: Changes = (),
    *,
    low_pass: LowPass | None = None,
    phi: FloatArray = GRID,
    start: Start | None = None,
) -> State:
    """Return the linear ring at operating points, solved; a contact nearby as start saves time."""
    return waveform(State.of(values, points, phi).but(start=start), changes, low_pass=low_pass)


def smoothed(strain: FloatArray, points: Operating, low_pass: LowPass) -> FloatArray:
    """Return whole-turn waveforms (..., n_points, n_phi) as the filter gives them, mean off."""
    n = strain.shape[-1]
    order = np.fft.rfftfreq(n, 1.0 / n)
    if low_pass.cut_off is None:
        sigma = np.full(len(points), low_pass.sigma(1.0))
    else:
        sigma = np.array([low_pass.sigma(rate / (2.0 * np.pi)) for rate in points.omega])
    gain = np.exp(-0.5 * (sigma[:, None] * order) ** 2) * (order > 0)
    out: FloatArray = np.fft.irfft(np.fft.rfft(strain) * gain, n=n)
    return out


@dataclass(frozen=True, slots=True)
class Linear:
    """The model at its parameters and its slopes by the free coordinates.

    Attributes
    ----------
    waveform : shape (n_points, n_phi), [-]
    deflection : shape (n_points,), [m]
    waveform_slopes : shape (n_free, n_points, n_phi)
    deflection_slopes : shape (n_free, n_points)
    """

    waveform: FloatArray
    deflection: FloatArray
    waveform_slopes: FloatArray
    deflection_slopes: FloatArray


def linearised(
    values: Mapping[str, float | FloatArray],
    points: Operating,
    free: tuple[Coordinate, ...] = FREE,
    changes: Changes = (),
    *,
    low_pass: LowPass | None = None,
    step: float = 1e-4,
) -> Linear:
    """Return the model and its slopes: one shifted copy per free coordinate, all in one batch."""
    n, k = len(points), len(free)
    columns = dict(values)
    for j, coordinate in enumerate(free):
        z = np.zeros((k + 1, 1))
        z[j + 1] = step
        value = np.broadcast_to(np.asarray(values[coordinate.name], dtype=float), (n,))
        moved = np.broadcast_to(coordinate.moved(value, z), (k + 1, n))
        columns[coordinate.name] = np.ascontiguousarray(moved).ravel()
    state = predict(columns, points.tiled(k + 1), changes, low_pass=low_pass)
    waves = state.wave.reshape(k + 1, n, -1)
    depth = state.deflection.reshape(k + 1, n)
    by_wave, by_depth = (waves[1:] - waves[0]) / step, (depth[1:] - depth[0]) / step
    return Linear(waves[0], depth[0], by_wave, by_depth)
