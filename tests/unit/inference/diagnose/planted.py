"""Small campaigns that the model itself makes, with an effect planted."""

from functools import cache

import numpy as np

from tests.once import value_once
from tests.synthetic import LATERAL
from tests.unit.inference.identify.model_waves import TIRE, made_waves
from tirelib.core.parameters import Number, TireFile
from tirelib.effects import CATALOGUE, Effect
from tirelib.effects.effect import Strength
from tirelib.inference.compare.model import TireModel, model_of
from tirelib.inference.extend.extension import (
    Extension,
    StrainCase,
    extended,
    models_of,
    refuse,
)
from tirelib.inference.extend.model_file import extended_file
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.measured.waveforms import Waveforms
from tirelib.model.base import operating_points, values_of
from tirelib.model.solution import solved

LOADS = (2400.0, 4200.0, 6000.0)
PRESSURES = (1.7e5, 2.3e5)
EFFECT, STRENGTH = "sidewall_load", 0.3
NOISE = 2e-6
FEW = {name: CATALOGUE[name] for name in (EFFECT, "sidewall_damping", "temperature", "camber")}
"""The catalogue of tests that need no more: the planted effect, others, and one that is dead."""


@cache
def waves(effect: str = "", strength: Strength = 0.0, repeats: int = 2) -> Waveforms:
    """Return runs at two speeds, free of set-point errors; the model's own, with an effect."""
    plain = made_waves(
        loads=LOADS, pressures=PRESSURES, repeats=repeats, noise=NOISE, random=False, radius=False
    )
    speed = np.where(np.arange(len(plain)) % 2, 30.0, 15.0)
    speed[len(LOADS) * len(PRESSURES) :] = speed[:repeats]
    fixed = dict(plain.conditions) | {"speed": speed, "omega": speed / TIRE.ring_radius}
    fields = {name: getattr(plain, name) for name in plain.__dataclass_fields__}
    turning = Waveforms(**(fields | {"conditions": fixed}))
    points, values = operating_points(turning), values_of(TIRE)
    changes = [CATALOGUE[effect].at(strength)] if effect else []
    wave = solved(values, points, changes, low_pass=turning.low_pass).waveform
    random = np.random.default_rng(3)
    strain = wave[:, None] + NOISE * random.standard_normal((len(plain), len(LATERAL), 360))
    return Waveforms(**(fields | {"conditions": fixed, "strain": strain}))


def runs(effect: str = "", strength: Strength = 0.0, repeats: int = 2) -> StraightRuns:
    """Return the straight runs of `waves`."""
    return straight_runs(waves(effect, strength, repeats))


def model_file(*effects: tuple[str, float]) -> TireFile:
    """Return a model near the truth."""
    numbers = {
        name: Number(float(value), 0.05 * abs(float(value)), "fitted", "test")
        for name, value in values_of(TIRE).items()
        if np.isfinite(value)
    }
    numbers["bending_stiffness"] = Number(
        1.05 * TIRE.bending_stiffness, 0.2, "fitted", "test", {"interval_SI": [2.0, 3.0]}
    )
    listed = [{"effect": name, "strength": x, "unit": CATALOGUE[name].unit} for name, x in effects]
    return TireFile("made", numbers, {"effects": listed, "history": []})


def add_effect(measured: StraightRuns, model: TireModel, effect: Effect) -> Extension:
    """Return a model with one effect more, fitted to runs."""
    refuse(model, effect)
    case = StrainCase(measured, model)
    found = extended(models_of(case, [effect]), case, effect)
    assert isinstance(found, Extension)
    return found


@cache
def added() -> tuple[Extension, TireFile]:
    """Return the planted effect added to a model without it, and the file."""
    return value_once("planted_added", _added, tuple(CATALOGUE.values()))


def _added() -> tuple[Extension, TireFile]:
    file = model_file()
    done = add_effect(runs(EFFECT, STRENGTH), model_of(file), CATALOGUE[EFFECT])
    return done, extended_file(file, done, "hash")
