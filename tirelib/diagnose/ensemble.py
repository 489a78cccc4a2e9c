"""Structural variants of the user's own model, with no effect: what a fit leaves by itself.

A ring is not a tire, and what it lacks looks to some extent like one effect or another. There are
two kinds of it.

- Variants of the model: a belt that stretches and shears, a tread that hardens and gains width with
  load, sections with inertia, displacements whose large part is other than computed. The base model
  is fitted to each as it is to the data, and what that leaves is a sample of what structure does.
- What adds to a waveform in proportion: a smooth misfit that goes with strain, load, pressure and
  speed, sharper ends of the contact, shear of the tread that bends the flat piece, a sidewall that
  softens a little as it is pressed, blocks that turn with the sections, run-out, a late trigger,
  set points, gain and angle that are off in a run. Its covariance is known, so it needs no sample
  (`smooth_part`, `run_part`).

A measured variant has both, and noise.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.unlisted import gain_by_load, gain_by_pressure, gain_by_speed
from tirelib.diagnose.variant import variant
from tirelib.effects import CATALOGUE
from tirelib.effects.effect import State
from tirelib.effects.patch import along, balanced, beam_strain, held_shear
from tirelib.errors import ParameterError, TirelibError
from tirelib.identify.delay import STD, UNIT, by_delay
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.random_effects import random_tangents, scales
from tirelib.identify.span import span
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import coordinates, move, predict
from tirelib.waveforms import GRID

MEMBERS = 100
MISFIT = Discrepancy(inside=0.002, outside=0.001, by_speed=0.25)
"""What no variant shows either: some thousandths of the strain, at any angle."""
BACK_STEPS = 3
BENT = (0.0026, 0.017)
"""Standard deviations of the outward shear that bends the flat piece under the tread by itself, as
in `tread_friction`, and of the friction that does so in the contact's rear."""
WIDEST = 0.01
"""Largest standard deviation of the angle's zero that counts as structure, [rad]."""
ALIKE = {
    CATALOGUE["gage_length"]: 200.0,
    CATALOGUE["roughness"]: 0.03,
    CATALOGUE["gage_saturation"]: 1.2e-3,
    CATALOGUE["sidewall_load"]: 0.006,
    CATALOGUE["rotary_inertia"]: 5e-5,
    gain_by_load: 0.0075,
    gain_by_pressure: 0.01,
    gain_by_speed: 0.004,
}
"""Standard deviation, in their units, of what a tire's structure shows that looks like these
effects: the contact's ends are sharper or smoother than the ring's, contact begins gradually across
a crowned tread, strain is not quite in proportion to the belt's curvature, a sidewall is not quite
linear (plain tires of finite elements and of the rig show up to 0.025), blocks and cords turn with
the belt's sections (plain tires of finite elements show 1.5e-4 to 3e-4 kg m), and what changes the
contact most (load, pressure, speed) changes its strain by a little more or less than the ring's."""
RUN_OUT, ONCE = 1e-4, 3e-6
"""Standard deviation of a tire's run-out, [m], and of strain once per turn beside it, [-]."""


@dataclass(frozen=True, slots=True)
class Variants:
    """What is left of variants of a model.

    Attributes
    ----------
    rests : shape (n, n_runs * n_phi)
        Whitened residuals of the variants as they are.
    noise : float, [-]
        Of a run's waveform, from repeats, with which they would be measured.
    """

    rests: FloatArray
    noise: float


def structural_ensemble(
    data: Data,
    model: Refit,
    *,
    noise: float,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> FloatArray:
    """Return whitened residuals of measured variants of a model, (n, n_runs * n_phi).

    Parameters
    ----------
    noise : float, [-]
        Of a run's waveform, from repeats.
    members, seed : int
    progress : callable, optional
        Called after each member.
    """
    found = Variants(variants(data, model, members=members, seed=seed, progress=progress), noise)
    return measured(data, model, found, smooth_part(data, model), run_part(data, model))


def variants(
    data: Data,
    model: Refit,
    *,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> FloatArray:
    """Return whitened residuals of variants of a model at the plan, (n, n_runs * n_phi).

    Parameters
    ----------
    members, seed : int
    progress : callable, optional
        Called after each variant.

    Raises
    ------
    ParameterError
        If none has a solution.
    """
    random = np.random.default_rng(seed)
    k = len(coordinates(model.values))
    rows = model.whiten(model.slopes[:k]).reshape(k, -1)
    normal = rows @ rows.T + 1e-6 * np.eye(k)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    rests: list[FloatArray] = []
    attempts = 0
    while len(rests) < members and attempts < 3 * members:
        attempts += 1
        try:
            wave = variant(data, model, random)
            rest = np.subtract(wave, _refitted(data, model, wave, rows, inverse))
        except TirelibError:
            continue  # the draw is no tire
        rests.append(model.whiten(rest).ravel())
        if progress is not None:
            progress(f"variant {len(rests)}")
    if not rests:
        raise ParameterError(
            f"structure: none of {attempts} variants of the model has a solution at these runs; "
            "identify the model from them first, or correct its numbers"
        )
    return np.array(rests)


def smooth_part(data: Data, model: Refit) -> FloatArray:
    """Return what one standard deviation of each additive part changes, (n, n_runs, n_phi)."""
    half = 0.6 * np.sqrt(2.0 * model.deflection / float(np.max(model.values["free_radius"])))
    swing = _by_load(data, model)
    turns = np.stack([np.cos(GRID), np.sin(GRID)])[:, None]
    late = by_delay(model.waveform, data.points.omega)
    return np.concatenate(
        [
            MISFIT.columns(model.waveform, half, data.points, GRID),
            _alike(data, model),
            _bent(data, model),
            RUN_OUT * turns * swing,
            ONCE * turns * np.ones_like(swing),
            (STD / UNIT) * late[None],
        ]
    )


def run_part(data: Data, model: Refit) -> FloatArray:
    """Return what one standard deviation of a run's load, pressure, gain and angle changes.

    Of shape (n_runs, 4, n_phi).
    """
    tangents = random_tangents(model.waveform, model.values, data.points, data.low_pass)
    sizes = scales(data.tolerance, np.minimum(data.angle_std, WIDEST))
    return np.asarray((tangents * sizes[:, None, :]).swapaxes(1, 2))


def measured(
    data: Data,
    model: Refit,
    found: Variants,
    smooth: FloatArray,
    runs: FloatArray,
) -> FloatArray:
    """Return whitened residuals of variants as a campaign would measure them.

    Parameters
    ----------
    found : Variants
    smooth : shape (k, n_runs, n_phi)
        `smooth_part`.
    runs : shape (n_runs, 4, n_phi)
        `run_part`.
    """
    random = np.random.default_rng(len(found.rests))
    k = len(coordinates(model.values))
    free = model.whiten(model.slopes[:k]).reshape(k, -1)
    basis = span(free.T)
    rests = []
    for rest in found.rests:
        wave = np.tensordot(random.standard_normal(len(smooth)), smooth, axes=1)
        wave = wave + np.einsum("rk,rkn->rn", random.standard_normal(runs.shape[:2]), runs)
        white = model.whiten(wave + found.noise * random.standard_normal(wave.shape)).ravel()
        rests.append(rest + white - basis @ (basis.T @ white))
    return np.array(rests).reshape(found.rests.shape)


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
    for effect, size in ALIKE.items():
        state = predict(
            model.values,
            data.points,
            [*model.changes, effect.at(effect.step)],
            low_pass=data.low_pass,
            correction=model.correction,
        )
        rows.append((state.wave - model.waveform) * (size / effect.step))
    return np.array(rows)


def _bent(data: Data, model: Refit) -> FloatArray:
    """Return what `BENT` changes, (2, n_runs, n_phi)."""

    def held(state: State) -> State:
        bent = beam_strain(state, balanced(state.contact, held_shear(state)))
        return state.but(strain=state.strain + BENT[0] * bent)

    def rear(state: State) -> State:
        c = state.contact
        pull = 0.5 * c.pressure * (1.0 + np.tanh((along(c) - 0.5) / 0.2))
        return state.but(strain=state.strain + BENT[1] * beam_strain(state, balanced(c, pull)))

    waves = [
        predict(
            model.values,
            data.points,
            [*model.changes, ("strain", change)],
            low_pass=data.low_pass,
            correction=model.correction,
        ).wave
        for change in (held, rear)
    ]
    return np.stack(waves) - model.waveform


def _refitted(
    data: Data, model: Refit, wave: FloatArray, rows: FloatArray, inverse: FloatArray
) -> FloatArray:
    """Return the base model brought near a waveform by a few chord steps."""
    free = coordinates(model.values)
    z = np.zeros(len(free))
    fitted = model.waveform
    for _ in range(BACK_STEPS):
        step = inverse @ (rows @ model.whiten(wave - fitted).ravel())
        z = z + np.clip(step, -0.4, 0.4)
        state = predict(
            move(model.values, z, free),
            data.points,
            model.changes,
            low_pass=data.low_pass,
            correction=model.correction.moved(z),
        )
        fitted = state.wave
    return fitted
