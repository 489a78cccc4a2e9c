"""Effects out of proportion: rows at the strength that a residual asks for, and exact fits."""

from functools import cache

import numpy as np
import pytest

from tests.unit.diagnose.planted import TIRE, runs
from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidate, candidates
from tirelib.diagnose.ensemble import Variants, variants
from tirelib.diagnose.noise import noise_in, white_noise
from tirelib.diagnose.refit import Refit, refit
from tirelib.diagnose.secants import with_secants
from tirelib.diagnose.shape import structure_of
from tirelib.diagnose.structure import Structure
from tirelib.effects import CATALOGUE
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import predict, values_of

SOME = [CATALOGUE[n] for n in ("gage_length", "gage_drift", "belt_shear", "nonuniformity")]


@cache
def case(effect: str, strength: float) -> tuple[Data, Refit, Structure]:
    """Return a campaign with an effect planted, the fitted base and what it leaves by itself."""
    straight = runs(effect, strength)
    data = straight.data(with_deflection=False)
    base = refit(data, values_of(TIRE))
    rests = Variants(variants(data, base, members=6), noise_in(straight))
    noise = white_noise(straight, base, data.strain)
    return data, base, structure_of(data, base, rests, noise.smooth)


def found(effect: str, strength: float, name: str) -> tuple[Candidate, Candidate]:
    """Return a candidate by its tangent, and as the residual asks for."""
    data, base, structure = case(effect, strength)
    plain = candidates(data, base, SOME)
    followed = with_secants(data, base, plain, structure)
    k = [c.effect.name for c in plain.living].index(name)
    return plain.living[k], followed.living[k]


def true_change(effect: str, strength: float) -> FloatArray:
    """Return what the base cannot mimic of an effect's whole change."""
    data, base, structure = case(effect, strength)
    wave = predict(
        base.values,
        data.points,
        [CATALOGUE[effect].at(strength)],
        low_pass=data.low_pass,
        correction=base.correction,
    ).wave
    return structure.projected(base.whiten(wave - base.waveform).ravel())


def cosine(a: FloatArray, b: FloatArray) -> float:
    return float(a.ravel() @ b.ravel() / np.linalg.norm(a) / np.linalg.norm(b))


def test_a_long_gage_is_seen_as_long_as_it_is() -> None:
    tangent, secant = found("gage_length", 3000.0, "gage_length")
    whole = true_change("gage_length", 3000.0)
    assert 1.0 - cosine(secant.own, whole) < (1.0 - cosine(tangent.own, whole)) / 3.0


@pytest.mark.parametrize(
    ("planted", "strength", "name"),
    [("gage_drift", 0.1, "gage_drift"), ("gage_length", 3000.0, "nonuniformity")],
)
def test_what_is_in_proportion_or_has_a_phase_stays(
    planted: str, strength: float, name: str
) -> None:
    tangent, secant = found(planted, strength, name)
    np.testing.assert_array_equal(tangent.own, secant.own)


def test_where_nothing_is_left_nothing_is_followed() -> None:
    for name in ("gage_length", "belt_shear"):
        tangent, same = found("", 0.0, name)
        assert same is tangent
