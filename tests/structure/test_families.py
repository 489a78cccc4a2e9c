"""Campaigns of three families: what is stored is what was made, and faults act as they say."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from structure.cases import NONE, case_file, load_case, save_case
from structure.day import day, measured
from structure.family import PHI, Frame
from structure.gages import GAGES
from structure.make import FAMILIES, plain_case
from structure.planted import planted_cases

SHORT = 2
"""A seed with 15 runs."""


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    ring = FAMILIES["ring"]
    today = day(ring.number, SHORT)
    return ring.frames(ring.draw(SHORT, NONE), today.settings, {}, today.angle)


def test_a_case_is_read_as_it_was_written(tmp_path: Path) -> None:
    case = plain_case(FAMILIES["ring"], SHORT)
    file = case_file(tmp_path, "ring", SHORT, NONE, 1.0)
    save_case(case, file)
    read = load_case(file)
    assert asdict(read.waves.header) == asdict(case.waves.header)
    np.testing.assert_allclose(read.waves.strain, case.waves.strain, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(read.floor_waves.strain, read.waves.strain, atol=1e-12)
    for name, values in case.waves.conditions.items():
        np.testing.assert_array_equal(read.waves.conditions[name], values)
    assert read.truth["numbers"] == case.truth["numbers"]


@pytest.mark.parametrize("name", GAGES)
def test_a_fault_without_strength_changes_nothing(name: str, frames: list[Frame]) -> None:
    tire = FAMILIES["ring"].draw(SHORT, NONE)
    for frame in frames[:3]:
        after = GAGES[name].shown(frame, tire, 0.4, 0.0)
        np.testing.assert_allclose(after.strain, frame.strain, atol=1e-15)
        np.testing.assert_allclose(after.by_load, frame.by_load, atol=1e-18)


def test_a_wheel_that_lacks_a_tooth_is_early_from_there_on(frames: list[Frame]) -> None:
    after = GAGES["missing_tooth"].shown(frames[0], None, 0.5, 0.1)
    early = np.interp(PHI + 0.1, PHI, frames[0].strain[:, 2])
    before, behind = PHI < 0.49, (PHI > 0.51) & (PHI < 3.0)
    np.testing.assert_allclose(after.strain[before], frames[0].strain[before], atol=1e-12)
    np.testing.assert_allclose(after.strain[behind, 2], early[behind], atol=1e-7)


def test_the_day_moves_and_scales_a_wave_by_its_delay_and_gains() -> None:
    ring = FAMILIES["ring"]
    tire, today = ring.draw(SHORT, NONE), day(ring.number, SHORT)
    lab = replace(today.lab, noise=0.0, gain_repeat=0.0, run_out=0.0)
    wave = np.repeat(1e-3 * np.cos(3.0 * PHI)[:, None], 5, axis=1)
    shown = [Frame(s, 50.0, 0.3, 2e5, np.zeros((5, 2)), wave, 0.0 * wave) for s in today.settings]
    waves = measured(replace(today, lab=lab, delay=1e-3), shown, ring.geometry(tire))
    harmonic = np.fft.rfft(waves.strain, axis=2)[:, :, 3]
    gain = np.abs(harmonic) / np.abs(harmonic).mean(axis=1, keepdims=True)
    np.testing.assert_allclose(gain, np.tile(lab.gain / lab.gain.mean(), (len(gain), 1)))
    # the wave starts at -pi, where cos 3 phi is -1
    late = -np.angle(-harmonic[:, 2]) / 3.0 / 50.0
    np.testing.assert_allclose(late, 1e-3, atol=5.0 * waves.angle_std.max() / 50.0)


def test_a_planted_fault_reaches_its_ratio() -> None:
    made = planted_cases(FAMILIES["ring"], SHORT, "low_pass", [1.5, 1.1])
    for ratio, case in made.items():
        assert min(case.ratio, case.white_ratio) == pytest.approx(ratio, abs=0.1 * (ratio - 1.0))
    assert made[1.1].strength["low_pass"] < made[1.5].strength["low_pass"]
