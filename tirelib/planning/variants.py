"""Tires that are like the user's but not the fitted model: what planted effects are tried on.

A null ensemble that draws thresholds (`tirelib.diagnose.ensemble`) must not be tried on its own
draws, so these differ from it in kind: large displacements are solved at the variant's own
constants, the tread stiffens in proportion to load, the smooth misfit is a Fourier series in the
angle over the half contact angle that scales the waveform and shifts its features, and errors of
the set points, gains, timing and noise are drawn anew.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.identify.random_effects import angle_slope
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Correction, large_displacements, predict
from tirelib.model.chain import Changes
from tirelib.model.state import Operating
from tirelib.waveforms import GRID

REFERENCE_LOAD = 4000.0
CONSTANTS: Mapping[str, float] = {
    "bending_stiffness": 0.12,
    "radial_stiffness": 0.06,
    "tangential_stiffness": 0.12,
    "extension_stiffness": 0.15,
    "mass": 0.05,
}
"""Relative standard deviation by which constants differ from the fitted ones."""
TERMS = 6
"""Waves of the smooth misfit between the ends of its reach."""
REACH = 4.0
"""Half contact angles over which the smooth misfit reaches to each side."""
SCALED, SHIFTED = 0.01, 0.006
"""Misfit of the size one: relative in strain, and of angle in half contact angles."""
RUN_OUT = 20e-6
"""Largest once-per-turn strain of another part, [-]."""
TIMING = 6e-5
"""Largest common delay between trigger and gages, [s]."""


@dataclass(frozen=True, slots=True)
class Variants:
    """Some tires; every array has one row per tire.

    Attributes
    ----------
    factors : mapping of name to array (n,)
        Of the fitted constants.
    given : mapping of name to array (n,)
        Constants that the fitted model does not have.
    tread_by_load : shape (n,), [-]
        Relative growth of the tread stiffness per relative load.
    misfit : shape (n, 2, 3, 2 TERMS)
        Coefficients of scaling and shift: constant, by load, by speed.
    run_out : shape (n, 2), [-]
    delay : shape (n,), [s]
        Between trigger and gages: it belongs to the rig and stays.
    """

    factors: Mapping[str, FloatArray]
    given: Mapping[str, FloatArray]
    tread_by_load: FloatArray
    misfit: FloatArray
    run_out: FloatArray
    delay: FloatArray

    def __len__(self) -> int:
        return int(self.tread_by_load.size)


def draw_variants(count: int, size: float, random: np.random.Generator) -> Variants:
    """Return tires whose smooth misfit has a size (1: the variants of a diagnosis)."""
    spectrum = 1.0 / np.sqrt(1.0 + np.tile(np.arange(TERMS), 2))
    weight = np.array([1.0, 0.5, 0.25])[:, None] * spectrum / np.sqrt(np.sum(spectrum**2) / 2.0)
    return Variants(
        {name: np.exp(s * random.standard_normal(count)) for name, s in CONSTANTS.items()},
        {
            "shear_stiffness": 1e3 / random.uniform(0.001, 0.03, count),
            "tread_hardening": random.uniform(0.0, 3.0, count),
            "rotary_inertia": random.uniform(0.0, 3e-4, count),
        },
        random.uniform(0.0, 0.35, count),
        size * weight * random.standard_normal((count, 2, 3, 2 * TERMS)),
        RUN_OUT / np.sqrt(3.0) * random.uniform(-1.0, 1.0, (count, 2)),
        TIMING * random.uniform(-1.0, 1.0, count),
    )


@dataclass(frozen=True, slots=True)
class Track:
    """Variants on a day at the rig, ready for effects to be planted; rows are variants.

    Attributes
    ----------
    variants : Variants
    values : mapping of name to array (n_variants * n_points,)
    really : Operating
        Conditions with their set-point errors, variant after variant.
    shown : Operating
        Conditions as the rig tells them, once.
    correction : Correction
        For large displacements, at `values` and `really`.
    gain, zero : shape (n_variants, n_points), [-], [rad]
    noise : shape (n_variants, n_points, n_phi), [-]
    """

    variants: Variants
    values: Mapping[str, float | FloatArray]
    really: Operating
    shown: Operating
    correction: Correction
    gain: FloatArray
    zero: FloatArray
    noise: FloatArray

    @classmethod
    def of(
        cls,
        variants: Variants,
        model: Refit,
        data: Data,
        shown: Operating,
        *,
        noise: float,
        random: np.random.Generator,
    ) -> "Track":
        """Return variants of a model at points, with the errors of the rig that made the data.

        Raises
        ------
        TirelibError
            If one of the tires has no solution.
        """
        tolerance, shape = data.tolerance, (len(variants), len(shown))
        repeated = shown.tiled(len(variants))
        drawn = random.standard_normal((4, *shape))
        really = replace(
            repeated,
            load=repeated.load * (1.0 + tolerance.load * drawn[0].ravel()),
            pressure=repeated.pressure * (1.0 + tolerance.pressure * drawn[1].ravel()),
        )
        values = _values(variants, model, shown)
        angle = min(float(np.mean(data.angle_std)), 0.01)
        return cls(
            variants,
            values,
            really,
            shown,
            large_displacements(values, really, low_pass=data.low_pass),
            1.0 + tolerance.gain * drawn[2],
            angle * drawn[3] + variants.delay[:, None] * shown.omega,
            noise * random.standard_normal((*shape, GRID.size)),
        )

    def measured(self, changes: Changes, data: Data) -> FloatArray:
        """Return the waveforms that the gages show with changes, (n_variants, n_points, n_phi).

        Raises
        ------
        TirelibError
            If one of the tires has no solution with the changes.
        """
        state = predict(
            self.values, self.really, changes, low_pass=data.low_pass, correction=self.correction
        )
        count = len(self.variants)
        wave = self._misfitting(
            state.wave.reshape(count, len(self.shown), -1), state.deflection.reshape(count, -1)
        )
        once = self.variants.run_out @ np.stack([np.cos(GRID), np.sin(GRID)])
        wave = (wave + once[:, None]) * self.gain[..., None]
        wave = wave - angle_slope(wave) * self.zero[..., None]
        out: FloatArray = wave - wave.mean(axis=2, keepdims=True) + self.noise
        return out

    def _misfitting(self, wave: FloatArray, deflection: FloatArray) -> FloatArray:
        """Return waveforms scaled and shifted by the smooth misfit."""
        shown = self.shown
        half = 0.6 * np.sqrt(2.0 * deflection / float(np.max(self.values["free_radius"])))
        place = GRID / half[..., None]
        window = np.exp(-((place / REACH) ** 4))
        order = np.pi * np.arange(1, TERMS + 1) / REACH
        angle = place[..., None] * order
        series = np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
        speed = shown.omega / np.mean(shown.omega) - 1.0
        by = np.stack([np.ones(len(shown)), np.log(shown.load / REFERENCE_LOAD), speed], axis=1)
        terms = np.einsum("vckt,pk->vpct", self.variants.misfit, by)
        both = np.einsum("vpct,vpnt->vpcn", terms, series) * window[:, :, None]
        scale, shift = SCALED * both[:, :, 0], SHIFTED * half[..., None] * both[:, :, 1]
        out: FloatArray = wave * (1.0 + scale) - angle_slope(wave) * shift
        return out


def _values(variants: Variants, model: Refit, shown: Operating) -> dict[str, float | FloatArray]:
    """Return the constants of every variant at every point."""
    points = len(shown)
    values = dict(model.values)
    for name, factor in variants.factors.items():
        values[name] = np.repeat(float(np.max(values[name])) * factor, points)
    for name, given in variants.given.items():
        values[name] = np.repeat(given, points)
    load = np.tile(shown.load / REFERENCE_LOAD - 1.0, len(variants))
    by_load = 1.0 + np.repeat(variants.tread_by_load, points) * load
    values["tread_stiffness"] = float(np.max(values["tread_stiffness"])) * by_load
    return values
