"""The structure that a fitted model has by itself at a plan: its parts put together.

The law of an effect that the model has is right but roughly, so what it may be off by is a part.
"""

from dataclasses import replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.ensemble import Variants, measured, run_part, smooth_part
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.structure import FORM, Structure, spread_of
from tirelib.identify.random_effects import angle_slope
from tirelib.identify.waveform_fit import Data

SMALL, LEAST = 0.3, 0.5
"""Size of an effect in a run, over the typical one, below which its shape there is not trusted,
and least size that another law may have there."""


def structure_of(data: Data, model: Refit, rests: Variants, noise: float) -> Structure:
    """Return the structure that a model has by itself at a plan.

    Parameters
    ----------
    rests : Variants
    noise : float, [-]
        Of a whitened sample.
    """
    smooth, runs = smooth_part(data, model), run_part(data, model)
    spread = spread_of(noise, len(data.points))
    seen = measured(data, model, replace(rests, noise=spread * model.whiten.noise), smooth, runs)
    free = model.whiten(model.own_slopes).reshape(len(model.own_slopes), -1)
    parts = model.whiten(smooth).reshape(len(smooth), -1)
    each = [model.whiten(runs.swapaxes(0, 1)).swapaxes(0, 1), form_part(model)]
    return Structure(rests.rests, seen, spread, free, parts, np.concatenate(each, axis=1))


def form_part(model: Refit) -> FloatArray:
    """Return how a model's effects may be off in each run, (n_runs, 3 * n_effects, n_phi).

    By a factor; by a power of the harmonics' order, for another law acts on other wavelengths; and
    by its place on the wheel.
    """
    runs, samples = model.waveform.shape
    rows: list[FloatArray] = [np.zeros((runs, 0, samples))]
    first = len(model.slopes) - sum(effect.components for effect in model.effects)
    for effect, strength in zip(model.effects, model.strengths, strict=True):
        slopes = model.slopes[first : first + effect.components]
        first += effect.components
        change = model.whiten(np.tensordot(strength / effect.scale, slopes, axes=1))
        change = filled(change)
        rows.append(FORM * np.stack([change, finer(change), moved(change)], axis=1))
    return np.concatenate(rows, axis=1)


def moved(change: FloatArray) -> FloatArray:
    """Return the slope of changes (n_runs, n_phi) by their place on the wheel, as large."""
    slope = angle_slope(change)
    size, norm = (np.linalg.norm(x, axis=1, keepdims=True) for x in (change, slope))
    out: FloatArray = slope * size / np.maximum(norm, 1e-300)
    return out


def filled(change: FloatArray) -> FloatArray:
    """Return an effect's change per run, nowhere much smaller than it typically is.

    Where the law gives little, another may give half of what it gives elsewhere, in that shape.
    """
    size = np.sqrt(np.sum(change**2, axis=1, keepdims=True))
    typical = float(np.sqrt(np.mean(size**2)))
    if typical == 0.0:
        return change
    shape = change / np.maximum(size, SMALL * typical)
    trusted = size[:, 0] > SMALL * typical
    shape[~trusted] = shape[trusted].mean(axis=0)
    out: FloatArray = shape * np.maximum(size, LEAST * typical)
    return out


def finer(change: FloatArray) -> FloatArray:
    """Return the slope of changes (n_runs, n_phi) by a power of the harmonics' order, as large."""
    spectrum = np.fft.rfft(change)
    power = np.abs(spectrum) ** 2
    order = np.log(np.maximum(np.arange(spectrum.shape[1]), 1.0))
    mean = np.sum(power * order, axis=1, keepdims=True) / np.maximum(
        np.sum(power, axis=1, keepdims=True), 1e-300
    )
    slope = np.fft.irfft(spectrum * (order - mean), n=change.shape[1])
    size, norm = (np.linalg.norm(x, axis=1, keepdims=True) for x in (change, slope))
    out: FloatArray = slope * size / np.maximum(norm, 1e-300)
    return out
