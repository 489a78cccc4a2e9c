"""Contact and deflection in words: told where off, by how much and which way; offsets stated."""

import re

import numpy as np
import pytest

from tests.unit.inference.compare.compare_synthetic import ANGLE, model_file, waveforms
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.strain import compare_strain
from tirelib.inference.compare.tracks import (
    Track,
    contact_edges,
    pooled,
    track_fit,
    track_sentences,
)
from tirelib.measured.waveforms import GRID

LOADS = np.repeat([1500.0, 3000.0, 4500.0, 6000.0], 6)
LEVEL = np.repeat(np.arange(4), 6)
EVERY = np.ones(LOADS.size, dtype=np.bool_)
FACTOR = Factor("load", LEVEL, np.array([1500.0, 3000.0, 4500.0, 6000.0]))
NOISE = 1e-4


def track(name: str, difference: np.ndarray, seed: int = 0) -> Track:
    rng = np.random.default_rng(seed)
    measured = 0.02 * LOADS / 1000.0
    model = measured + difference + NOISE * rng.standard_normal(LOADS.size)
    noise, freedom = pooled(model - measured, LEVEL)
    return Track(name, "mm", 1e3, measured, model, np.zeros(LOADS.size), noise, freedom)


def said(one: Track) -> tuple[str, ...]:
    return track_sentences([one], EVERY, [FACTOR])


def test_a_contact_that_is_too_short_at_high_load_is_told_with_range_and_size() -> None:
    (text,) = said(track("contact length", -2e-3 * (LOADS >= 4500.0)))
    assert text.startswith("Contact length, at 4,500 N and above: the model's is 2 mm too short")
    assert "12 runs" in text
    (text,) = said(track("contact exit", np.full(LOADS.size, 2e-3)))
    assert text.startswith("Contact exit, in all runs: the model's is 2 mm too late")


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_is_not_told(seed: int) -> None:
    assert said(track("contact length", np.zeros(LOADS.size), seed)) == ()


def test_a_constant_of_the_deflection_is_told_only_beside_what_changes() -> None:
    constant = np.full(LOADS.size, 1.5e-3)
    assert said(track("deflection", constant)) == ()
    # the same of a contact length is no zero of the rig
    assert len(said(track("contact length", constant))) == 1
    (text,) = said(track("deflection", constant + 1e-3 * (LOADS > 5000.0)))
    # of 1 mm at a quarter of the runs, a quarter goes to the constant: 0.75 and 1.75 mm
    size = re.search(r"at 6,000 N and above: the model's is ([0-9.]+) mm too large", text)
    constant_part = re.search(r"apart from a constant ([0-9.]+) mm in all runs", text)
    assert size is not None
    assert constant_part is not None
    assert float(size[1]) == pytest.approx(0.75, abs=0.1)
    assert float(constant_part[1]) == pytest.approx(1.75, abs=0.1)


def test_numbers_are_not_corrected_for_the_constant() -> None:
    fit = track_fit(track("deflection", np.full(LOADS.size, 1.5e-3)), EVERY)
    # 24 runs with a noise of 0.1 mm
    assert fit.mean == pytest.approx(1.5e-3, abs=1e-4)
    assert fit.std == pytest.approx(NOISE / np.sqrt(LOADS.size), rel=0.4)
    assert fit.rms == pytest.approx(1.5e-3, rel=0.1)
    assert fit.rms_beside == pytest.approx(NOISE, rel=0.4)
    nothing = track_fit(track("deflection", np.full(LOADS.size, np.nan)), EVERY)
    assert nothing.runs == 0
    assert np.isnan(nothing.rms)


def test_without_repeats_nothing_is_told() -> None:
    one = track("contact length", np.full(LOADS.size, 2e-3))
    bare = Track(
        one.name,
        one.unit,
        one.scale,
        one.measured,
        one.model,
        one.model_std,
        *pooled(one.difference, np.arange(LOADS.size)),
    )
    assert said(bare) == ()


def test_a_zero_of_the_trigger_is_within_the_band_of_entry_and_exit() -> None:
    found = compare_strain(waveforms(seed=1), model_of(model_file()))
    _, _, entry, leaving = found.tracks
    for one in (entry, leaving):
        assert (one.model_std >= ANGLE).all()
        fit = track_fit(one, found.chosen.straight)
        # 28 runs whose zero is off by the stated tolerance, beside load, pressure and noise
        assert abs(fit.mean) < 4.0 * fit.std
    assert found.sentences == ()


def test_entry_and_exit_are_where_strain_is_steepest() -> None:
    wave = np.tanh((GRID + 0.21) / 0.03) - np.tanh((GRID - 0.17) / 0.03)
    # the grid has steps of 0.017 rad
    np.testing.assert_allclose(contact_edges(wave[None])[0], [-0.21, 0.17], atol=2e-3)
