"""What a ring's structure may do to waveforms, as unknowns with a prior.

Two parts. Known ways in which a tire departs from the fitted ring (a belt that shears, a tread that
hardens or gains width with load, sections with inertia, traction of the rolling tire, a crown,
layers of a belt that smear the strain, run-out, delay of the gages) have tangents as effects have.
The rest is smooth in the angle over the half contact angle, in proportion to the strain
(`tirelib.identify.discrepancy`), and goes with load, pressure and speed. Sizes of the first part
are as in the variants of a diagnosis; that of the smooth part is fitted.
"""

from collections.abc import Collection, Mapping

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import CATALOGUE
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.random_effects import angle_slope
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import predict
from tirelib.model.chain import Change, Changes
from tirelib.model.state import Operating
from tirelib.waveforms import GRID

Values = Mapping[str, float | FloatArray]

MISFIT = Discrepancy(inside=0.01, outside=0.005)
"""Smooth misfit of size 1."""
BY_SPEED = 0.5
"""Smooth misfit that goes with relative speed, over the constant one."""
HALF = 0.6
"""Half contact angle over sqrt(2 d0 / R0)."""
REFERENCE_LOAD = 4000.0
STEP = 0.01
"""Trial step over a standard deviation."""
CONSTANTS: Mapping[str, tuple[str, float]] = {
    "belt_shear": ("shear_stiffness", 1.5e-5),
    "tread_hardening": ("tread_hardening", 1.5),
    "rotary_inertia": ("rotary_inertia", 1.5e-4),
}
"""Constants that the fitted ring lacks: standard deviation, of 1 / GA for the shear, SI."""
TREAD_POWER = 0.15
"""Standard deviation of the power of the load with which the tread stiffens."""
ACTING: Mapping[str, float] = {"trailing_sliding": 0.03, "tread_friction": 0.0045,
                               "roughness": 0.2}  # fmt: skip
"""Standard deviation of effects that any tire has a little of, in their units."""
SMEARED = 4e-4
"""Standard deviation of the square of the length over which strain is smeared, [m^2]."""
RUN_OUT = 1e-5
"""Standard deviation of a strain that comes once per turn, [-]."""
DELAY = 3.5e-5
"""Standard deviation of the common delay between trigger and gages, [s]."""
SMOOTH = 4 * MISFIT.knots
"""Unknowns of the smooth part; they stand last."""


def structure_shapes(
    values: Values,
    changes: Changes,
    data: Data,
    points: Operating,
    waveform: FloatArray,
    deflection: FloatArray,
    barred: Collection[str],
) -> FloatArray:
    """Return the change of waveforms for one standard deviation of every unknown.

    Parameters
    ----------
    values : mapping
        Of the tire.
    changes : sequence of (stage, change)
        Effects of the model.
    data : Data
        The present runs.
    points : Operating
    waveform : shape (n_points, n_phi), [-]
        Of the model at the points.
    deflection : shape (n_points,), [m]
    barred : collection of str
        Effects on trial or in the model: what would do the same is left out.

    Returns
    -------
    shape (n_unknowns, n_points, n_phi)
    """
    plain = predict(values, points, changes, low_pass=data.low_pass).wave
    rows = [
        (predict(moved, points, [*changes, *more], low_pass=data.low_pass).wave - plain) / STEP
        for moved, more in _departures(values, points, barred)
    ]
    if not {"gage_length", "low_pass"} & set(barred):
        rows.append(_smearing(waveform) * SMEARED / float(np.max(values["ring_radius"])) ** 2)
    if "nonuniformity" not in barred:
        for wave in (np.cos(GRID), np.sin(GRID)):
            rows.append(np.broadcast_to(RUN_OUT * wave, waveform.shape))
    rows.append(angle_slope(waveform) * (DELAY * points.omega)[:, None])
    half = HALF * np.sqrt(2.0 * deflection / float(np.max(values["free_radius"])))
    known = MISFIT.columns(waveform, half, points, GRID)
    relative = (points.omega / np.mean(data.points.omega) - 1.0)[None, :, None]
    return np.concatenate([np.array(rows), known, BY_SPEED * known[: MISFIT.knots] * relative])


def _departures(
    values: Values, points: Operating, barred: Collection[str]
) -> list[tuple[Values, list[tuple[str, Change]]]]:
    """Return values and changes of known departures, one trial step each."""
    found: list[tuple[Values, list[tuple[str, Change]]]] = []
    for name, (constant, deviation) in CONSTANTS.items():
        if name in barred:
            continue
        old, step = values[constant], STEP * deviation
        new = 1.0 / (1.0 / old + step) if constant == "shear_stiffness" else old + step
        found.append(({**values, constant: new}, []))
    if "tread_load" not in barred:
        power = (points.load / REFERENCE_LOAD) ** (STEP * TREAD_POWER)
        found.append(({**values, "tread_stiffness": values["tread_stiffness"] * power}, []))
    for name, deviation in ACTING.items():
        if name not in barred:
            found.append((values, [CATALOGUE[name].at(STEP * deviation)]))
    return found


def _smearing(waveform: FloatArray) -> FloatArray:
    """Return the change of waveforms by the square of the angle that they are averaged over."""
    n = waveform.shape[1]
    order = np.fft.rfftfreq(n, 1.0 / n)
    out: FloatArray = np.fft.irfft(-(order**2) / 24.0 * np.fft.rfft(waveform, axis=1), n=n, axis=1)
    return out
