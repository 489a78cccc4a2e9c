"""What a campaign must hold for a fit, and what is said when it does not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import LOADS, made_waves
from tirelib.core.errors import CalibrationError
from tirelib.inference.identify.campaign_data import STRUCTURE, straight_runs, working_gages
from tirelib.measured.waveforms import Waveforms


@pytest.fixture(scope="module")
def waves() -> Waveforms:
    return made_waves(pressures=(2.1e5,), repeats=1, seed=1)


def with_condition(waves: Waveforms, name: str, values: np.ndarray) -> Waveforms:
    return replace(waves, conditions={**waves.conditions, name: values})


def test_runs_with_slip_are_left_out(waves: Waveforms) -> None:
    angle = np.zeros(len(waves))
    angle[[0, 3]] = np.deg2rad([2.0, -1.0])
    runs = straight_runs(with_condition(waves, "slip_angle", angle))
    assert runs.waves.run.tolist() == [1, 2, 4, 5]


def test_the_strain_is_the_mean_of_symmetric_gages(waves: Waveforms) -> None:
    runs = straight_runs(waves)
    assert runs.gages == (0, 1, 2, 3, 4)
    assert runs.strain == pytest.approx(waves.strain.mean(axis=1))
    assert runs.deflection == pytest.approx(
        waves.header.tire.free_radius - waves.conditions["loaded_radius"]
    )


def test_data_hold_noise_and_the_white_part_of_structure(waves: Waveforms) -> None:
    runs = straight_runs(waves)
    data = runs.data()
    typical = float(np.sqrt(np.mean(runs.strain**2)))
    assert data.noise == pytest.approx(np.hypot(runs.noise.std, STRUCTURE * typical))
    assert data.with_deflection
    assert not runs.data(with_deflection=False).with_deflection
    assert data.points.load == pytest.approx(waves.conditions["Fz"])


def test_without_repeats_the_noise_is_unknown_and_data_still_work() -> None:
    runs = straight_runs(made_waves(pressures=(2.1e5,), repeats=0))
    assert np.isnan(runs.noise.std)
    assert np.isfinite(runs.data().noise)


def test_a_gage_that_fell_off_takes_its_twin_along(waves: Waveforms) -> None:
    strain = waves.strain.copy()
    strain[2, 1] = 0.0
    assert working_gages(replace(waves, strain=strain)) == (0, 2, 4)
    strain[2, 1] = np.nan
    assert working_gages(replace(waves, strain=strain)) == (0, 2, 4)


def test_too_few_runs_are_named(waves: Waveforms) -> None:
    with pytest.raises(CalibrationError, match=r"synthetic: 3 straight runs.*at least 4"):
        straight_runs(waves.take(np.arange(3)))


def test_runs_without_load_do_not_count(waves: Waveforms) -> None:
    load = waves.conditions["Fz"].copy()
    load[1:] = np.nan
    with pytest.raises(CalibrationError, match="1 straight runs with strain and load"):
        straight_runs(with_condition(waves, "Fz", load))


def test_one_load_is_refused_with_the_loads() -> None:
    with pytest.raises(CalibrationError, match=r"loads from 4000 to 4000 N.*add a run"):
        straight_runs(made_waves(loads=(4000.0,), repeats=2))


def test_gages_fallen_off_are_named_with_run_and_place(waves: Waveforms) -> None:
    strain = waves.strain.copy()
    for gage, run in enumerate((0, 1, 2, 3, 4)):
        strain[run, gage] = 0.0
    with pytest.raises(CalibrationError, match=r"run 0: gage 1 at \+60 mm shows 0 microstrain"):
        straight_runs(replace(waves, strain=strain))


def test_a_loaded_radius_above_the_free_one_is_named(waves: Waveforms) -> None:
    radius = waves.conditions["loaded_radius"].copy()
    radius[4] = 0.3181
    with pytest.raises(CalibrationError, match=r"run 4: loaded radius 318.1 mm.*free_radius_m"):
        straight_runs(with_condition(waves, "loaded_radius", radius))


def test_a_deflection_of_a_third_is_a_wrong_unit(waves: Waveforms) -> None:
    radius = waves.conditions["loaded_radius"].copy()
    radius[2] *= 0.6
    with pytest.raises(CalibrationError, match="run 2: loaded radius"):
        straight_runs(with_condition(waves, "loaded_radius", radius))


def test_all_five_loads_are_there(waves: Waveforms) -> None:
    assert set(straight_runs(waves).waves.conditions["Fz"]) == set(LOADS)
