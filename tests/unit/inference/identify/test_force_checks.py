"""Slips that stand still, dead forces and wrong signs are refused before the brush is fitted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.inference.force_campaigns import steady_runs, write_forces
from tests.unit.inference.identify.test_brush_fit import WIDE, make
from tirelib.core.errors import CalibrationError
from tirelib.inference.identify.brush_advice import LARGEST_ANGLE, candidates
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_study import study_of
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.forces import identify_forces


@pytest.fixture(scope="module")
def data() -> ForceData:
    return make(WIDE, noise=20.0)


def test_one_slip_angle_is_named(data: ForceData) -> None:
    at = np.flatnonzero(np.isclose(data.slip_angle, data.slip_angle.max()))
    angle = float(np.rad2deg(data.slip_angle.max()))
    still = replace(data.take(at), slip_ratio=np.zeros(at.size))
    with pytest.raises(CalibrationError, match=f"the only slip angle is {angle:.2f} deg"):
        fit_brush(still)


def test_a_dead_force_is_named(data: ForceData) -> None:
    with pytest.raises(CalibrationError, match=r"Fy over Fz stays within.*the channel is dead"):
        fit_brush(replace(data, Fy=np.zeros(len(data))))


@pytest.mark.parametrize("name", ["Fy", "Fx"])
def test_a_force_of_the_wrong_sign_is_named(data: ForceData, name: str) -> None:
    n = len(data)
    ratio = np.tile([-0.1, 0.1], n // 2 + 1)[:n]
    both = replace(data, slip_ratio=ratio, Fx=2e4 * ratio)
    with pytest.raises(CalibrationError, match=f"{name} follows the slip.*wrong sign.*import map"):
        fit_brush(replace(both, **{name: -getattr(both, name)}))


def test_advice_asks_for_no_slip_angle_that_no_rig_has(data: ForceData) -> None:
    """Where friction is open, full sliding lies anywhere."""
    study = study_of(fit_brush(data))
    stiff = replace(study, stiffness={k: 0.05 * v for k, v in study.stiffness.items()})
    assert np.rad2deg(stiff.slide["slip_angle"]) > LARGEST_ANGLE
    largest = max(float(np.abs(each.data.slip_angle).max()) for each in candidates(stiff))
    assert np.rad2deg(largest) == pytest.approx(LARGEST_ANGLE)


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_an_aligning_moment_of_the_wrong_sign_is_not_used(turn: float, tmp_path: Path) -> None:
    runs = [
        replace(run, rig={**run.rig, "Mz": turn * run.rig["Mz"]})
        for run in steady_runs(repeats=1, moment=True)
    ]
    found = identify_forces(write_forces(tmp_path / "c", runs, "c"))
    said = [note for note in found.notes if note.startswith("Mz is not used (R2 -")]
    assert ("Mz" in found.fit.rmse) == (turn > 0.0) == (not said)
    assert all("it has the wrong sign for axes = 'iso'" in note for note in said)
    assert found.fit.values["lateral_stiffness"] > 0.0
