"""Structural variants of the user's own model, with no effect: what a fit leaves by itself.

A ring is not a tire, and what it lacks looks to some extent like one effect or another. So the
residual of the data is held against those of waveforms that variants of the model make: a belt that
stretches and shears, a tread that hardens and gains width with load, sections with inertia,
traction that is not as assumed, displacements whose large part is other than computed, a smooth
misfit that goes with strain, load and pressure, run-out; measured at the user's plan with the rig's
tolerances, delay and noise. The base model is fitted to each as it is to the data.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.effects import CATALOGUE
from tirelib.errors import TirelibError
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.identify import FITTED
from tirelib.identify.random_effects import angle_slope
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Correction, move, predict
from tirelib.waveforms import GRID

MEMBERS = 100
REFERENCE_LOAD = 4000.0
MISFIT = Discrepancy(inside=0.01, outside=0.005, by_speed=0.25)
BACK_STEPS = 3
TRACTION = {"trailing_sliding": 0.3, "tread_friction": 0.03}
"""Share of the range by which the traction of a rolling tire may differ from the ring's."""
TIMING = 1e-4
"""Common delay between trigger and gages that a rig may have, [s]: a sample at 10 kHz."""


LARGE = 0.3
"""Relative standard deviation of the part that large displacements add."""
ALIKE = {"gage_length": 600.0, "roughness": 0.2, "gage_saturation": 4e-3}
"""Standard deviation, in their units, of what a tire's structure shows that looks like these
effects: the contact's ends are sharper or smoother than the ring's, contact begins gradually across
a crowned tread, and strain is not quite in proportion to the belt's curvature."""
SECTIONS = 8e-5
"""Largest inertia of the belt's sections, [kg m]: twice that of 12.5 mm of belt and tread."""
MASS = 0.15
"""Relative standard deviation of the belt's mass, which no fit of straight runs tells."""
RUN_OUT, ONCE = 1.5e-4, 5e-6
"""Largest run-out of a tire, [m], and largest strain once per turn beside it, [-]."""


def structural_ensemble(
    data: Data,
    model: Refit,
    *,
    noise: float,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> FloatArray:
    """Return whitened residuals of variants of a model at the plan, (n, n_runs * n_phi).

    Parameters
    ----------
    noise : float, [-]
        Of a run's waveform, from repeats.
    members, seed : int
    progress : callable, optional
        Called after each member.
    """
    random = np.random.default_rng(seed)
    rows = model.whiten(model.slopes[: len(FITTED)]).reshape(len(FITTED), -1)
    normal = rows @ rows.T + 1e-6 * np.eye(len(FITTED))
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    half = 0.6 * np.sqrt(2.0 * model.deflection / float(np.max(model.values["free_radius"])))
    misfit = MISFIT.columns(model.waveform, half, data.points, GRID)
    misfit = np.concatenate([misfit, _alike(data, model)])
    swing = _by_load(data, model)
    rests: list[FloatArray] = []
    attempts = 0
    while len(rests) < members and attempts < 3 * members:
        attempts += 1
        try:
            wave = _variant(data, model, misfit, swing, noise, random)
            rest = np.subtract(wave, _refitted(data, model, wave, rows, inverse))
        except TirelibError:
            continue  # the draw is no tire
        rests.append(model.whiten(rest).ravel())
        if progress is not None:
            progress(f"variant {len(rests)}")
    return np.array(rests)


def _by_load(data: Data, model: Refit) -> FloatArray:
    """Return the change of the waveforms by deflection, (n_runs, n_phi), [1/m]."""
    share = 1e-3
    more = replace(data.points, load=data.points.load * (1.0 + share))
    state = predict(
        model.values, more, model.changes, low_pass=data.low_pass, correction=model.correction
    )
    deeper = state.deflection - model.deflection
    slope: FloatArray = (state.wave - model.waveform) / deeper[:, None]
    return slope


def _alike(data: Data, model: Refit) -> FloatArray:
    """Return what one standard deviation of `ALIKE` changes, (n, n_runs, n_phi)."""
    rows = []
    for name, size in ALIKE.items():
        effect = CATALOGUE[name]
        state = predict(
            model.values, data.points, [*model.changes, effect.at(effect.step)],
            low_pass=data.low_pass, correction=model.correction,
        )  # fmt: skip
        rows.append((state.wave - model.waveform) * (size / effect.step))
    return np.array(rows)


def _variant(
    data: Data,
    model: Refit,
    misfit: FloatArray,
    swing: FloatArray,
    noise: float,
    random: np.random.Generator,
) -> FloatArray:
    """Return the waveforms of one variant, measured."""
    points, tolerance = data.points, data.tolerance
    n = len(points)
    values = dict(model.values)
    for name in (
        "bending_stiffness", "radial_stiffness", "tangential_stiffness", "extension_stiffness",
    ):  # fmt: skip
        values[name] = values[name] * float(np.exp(0.1 * random.standard_normal()))
    values["mass"] = values["mass"] * float(np.exp(MASS * random.standard_normal()))
    values["shear_stiffness"] = 1e3 / random.uniform(0.001, 0.03)
    values["tread_hardening"] = random.uniform(0.0, 3.0)
    values["rotary_inertia"] = random.uniform(0.0, SECTIONS)
    values["tread_stiffness"] = values["tread_stiffness"] * (
        points.load / REFERENCE_LOAD
    ) ** random.uniform(-0.1, 0.2)
    really = replace(
        points,
        load=points.load * (1.0 + tolerance.load * random.standard_normal(n)),
        pressure=points.pressure * (1.0 + tolerance.pressure * random.standard_normal(n)),
    )
    rolling = [
        CATALOGUE[name].at(share * CATALOGUE[name].scale * random.uniform(-1.0, 1.0))
        for name, share in TRACTION.items()
        if name not in {effect.name for effect in model.effects}
    ]
    large = 1.0 + LARGE * float(random.standard_normal())
    correction = Correction(large * model.correction.waveform, large * model.correction.deflection)
    wave = predict(
        values, really, [*model.changes, *rolling], low_pass=data.low_pass, correction=correction
    ).wave
    wave = wave + np.tensordot(random.standard_normal(len(misfit)), misfit, axes=1)
    turn = np.cos(GRID - random.uniform(-np.pi, np.pi))
    wave = wave + random.uniform(0.0, RUN_OUT) * turn * swing
    wave = wave + random.uniform(0.0, ONCE) * np.cos(GRID - random.uniform(-np.pi, np.pi))
    wave = wave * (1.0 + tolerance.gain * random.standard_normal(n))[:, None]
    zero = np.minimum(data.angle_std, 0.01) * random.standard_normal(n)
    zero = zero + TIMING * random.uniform(-1.0, 1.0) * points.omega
    wave = wave - angle_slope(wave) * zero[:, None]
    wave = wave - wave.mean(axis=1, keepdims=True)
    measured: FloatArray = wave + noise * random.standard_normal(wave.shape)
    return measured


def _refitted(
    data: Data, model: Refit, wave: FloatArray, rows: FloatArray, inverse: FloatArray
) -> FloatArray:
    """Return the base model brought near a waveform by a few chord steps."""
    z = np.zeros(len(FITTED))
    fitted = model.waveform
    for _ in range(BACK_STEPS):
        step = inverse @ (rows @ model.whiten(wave - fitted).ravel())
        z = z + np.clip(step, -0.4, 0.4)
        state = predict(
            move(model.values, z, FITTED), data.points, model.changes, low_pass=data.low_pass,
            correction=model.correction,
        )  # fmt: skip
        fitted = state.wave
    return fitted
