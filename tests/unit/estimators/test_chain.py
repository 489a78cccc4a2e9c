"""What a calibration may promise: accuracy on another day, honest intervals, symmetry, ranges."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import LATERAL, cornering_runs, header, synthetic_run, write
from tirelib.campaign import Campaign, read_campaign
from tirelib.core.errors import CalibrationError
from tirelib.core.flags import TurnFlag
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.contact_length import contact_lengths
from tirelib.estimators.dissertation import fit_all
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.result import estimate_document
from tirelib.estimators.train import Trained, take, train
from tirelib.measured.features import Features
from tirelib.measured.observations import Observations, measure_run, observe, same_tire


def features_of(**options: float) -> Features:
    run = synthetic_run(0, **options)
    return measure_run(run, header())[0]


def estimate(trained: Trained, **options: float) -> Estimates:
    return trained.calibration.estimate(features_of(**options))


def test_another_day_is_estimated_within_the_stated_intervals(
    trained: Trained, another_day: Campaign
) -> None:
    day = observe([another_day])
    summary = estimate_document(
        day, trained.calibration.estimate(day.features), trained.calibration
    )["summary"]
    assert summary["Fz"]["rmse"] < 0.005 * 7500.0
    assert summary["alpha"]["rmse"] < 0.12
    assert summary["Fy"]["rmse"] < 0.01 * 6000.0
    assert summary["kappa"]["rmse"] < 5e-4
    for quantity in ("Fz", "alpha", "Fy", "kappa"):
        assert summary[quantity]["coverage_95"] >= 0.85, quantity
        assert summary[quantity]["n"] == 35


def test_a_load_between_the_calibrated_ones_is_estimated_as_well(trained: Trained) -> None:
    for load in (2200.0, 3700.0, 5200.0, 6800.0):
        found = estimate(trained, load=load, slip_angle=np.deg2rad(2.0))
        good = found.turn_valid
        assert good.sum() >= 3
        assert abs(np.mean(found.value["Fz"][good]) - load) < 0.01 * 7500.0
        assert abs(np.rad2deg(np.mean(found.value["alpha"][good])) - 2.0) < 0.2


def test_mirrored_gages_give_the_mirrored_estimate(trained: Trained) -> None:
    left = features_of(slip_angle=np.deg2rad(3.0), noise=0.0)
    right = features_of(slip_angle=np.deg2rad(-3.0), noise=0.0)
    a, b = trained.calibration.estimate(left), trained.calibration.estimate(right)
    np.testing.assert_allclose(a.value["Fz"][1:3], b.value["Fz"][1:3], rtol=2e-3)
    np.testing.assert_allclose(a.value["Fy"][1:3], -b.value["Fy"][1:3], rtol=0.02)
    np.testing.assert_allclose(a.value["alpha"][1:3], -b.value["alpha"][1:3], rtol=0.03)


def test_signs_are_those_of_iso(trained: Trained) -> None:
    found = estimate(trained, slip_angle=np.deg2rad(3.0))
    assert (found.value["alpha"][1:] > 0).all()
    assert (found.value["Fy"][1:] < 0).all()
    assert (found.value["Fz"][1:] > 0).all()


def test_a_common_gain_of_all_gages_changes_no_estimate(trained: Trained) -> None:
    """Regressors are ratios and angles: bridge supply and temperature drop out."""
    features = features_of(slip_angle=np.deg2rad(2.0))
    louder = {
        name: getattr(features, name) * 1.03
        for name in ("cp1", "cp2", "tp", "rate_lead", "rate_trail", "e_vertical", "mean", "offset")
    }
    a = trained.calibration.estimate(features)
    b = trained.calibration.estimate(replace(features, **louder))
    for quantity in ("Fz", "Fy", "alpha", "kappa"):
        np.testing.assert_allclose(a.value[quantity], b.value[quantity], rtol=1e-9)


@pytest.mark.parametrize("gage", [0, 1, 3, 4])
def test_with_one_gage_dead_the_other_four_estimate_and_say_so(trained: Trained, gage: int) -> None:
    run = synthetic_run(0, load=5000.0, slip_angle=np.deg2rad(2.0))
    assert run.strain is not None
    run.strain[gage] = 1e-3
    found = trained.calibration.estimate(measure_run(run, header())[0])
    good = found.turn_valid
    assert good.sum() >= 3
    assert (found.flags[good] & TurnFlag.REDUCED_GAGES > 0).all()
    assert abs(np.mean(found.value["Fz"][good]) - 5000.0) < 100.0
    assert abs(np.rad2deg(np.mean(found.value["alpha"][good])) - 2.0) < 0.4


def test_without_the_centre_gage_there_is_no_estimate(trained: Trained) -> None:
    features = features_of()
    flags = features.gage_flags.copy()
    flags[:, 2] |= int(TurnFlag.GAP)
    found = trained.calibration.estimate(replace(features, gage_flags=flags))
    assert not found.turn_valid.any()
    assert np.isnan(found.value["Fz"]).all()
    assert (found.flags & TurnFlag.TOO_FEW_GAGES > 0).all()


@pytest.mark.parametrize(
    "outside",
    [
        {"load": 9500.0},
        {"load": 600.0},
        {"slip_ratio": -0.3},
        {"camber": 0.06},
        {"pressure": 1.0e5},
        {"pressure": 3.2e5},
    ],
)
def test_outside_the_calibrated_range_is_flagged(
    trained: Trained, outside: dict[str, float]
) -> None:
    found = estimate(trained, **outside)
    assert not found.turn_valid.any()
    assert (found.flags[1:] & TurnFlag.OUT_OF_RANGE > 0).all()
    assert all("Fz_out_of_range" in notes for notes in found.notes[1:])


def test_the_standard_deviation_grows_towards_and_beyond_the_border(trained: Trained) -> None:
    std = [estimate(trained, load=load).std["Fz"][1] for load in (4500.0, 7500.0, 9500.0)]
    assert std[0] < std[1] < std[2]


def test_a_pressure_that_was_not_varied_widens_the_interval(trained: Trained) -> None:
    at, off = estimate(trained), estimate(trained, pressure=1.9e5)
    assert (off.std["Fz"][1:] > 3 * at.std["Fz"][1:]).all()
    assert all("condition_extrapolated" in notes for notes in off.notes[1:])
    assert not (off.flags[1:] & TurnFlag.OUT_OF_RANGE).any()


def test_the_pressure_law_adds_the_inflation_over_the_contact_area(trained: Trained) -> None:
    laws = trained.calibration.chains[-1].laws
    values = {"contact_angle": np.array([0.3]), "pressure": np.array([1.9e5])}
    change, _ = laws.load_correction(values)
    reference = laws.reference_pressure
    assert change[0] == pytest.approx((1.9e5 - reference) * 0.165 * 0.302 * 0.3)
    assert laws.load_correction({**values, "pressure": np.array([reference])})[0][0] == 0.0


def test_pressure_becomes_an_input_when_it_was_varied(
    cornering: Campaign, pressures: Campaign, trained: Trained
) -> None:
    both = train(observe([cornering, pressures]))
    assert both.calibration.chains[-1].laws.pressure_fitted
    for pressure in (1.8e5, 2.5e5):
        found = estimate(both, load=4500.0, pressure=pressure)
        good = found.turn_valid
        assert good.any()
        assert abs(np.mean(found.value["Fz"][good]) - 4500.0) < 0.01 * 7500.0
    unknown = replace(features_of(), pressure=np.full(len(features_of()), np.nan))
    refused = both.calibration.estimate(unknown)
    assert not refused.turn_valid.any()
    assert (refused.flags[1:] & TurnFlag.NO_CONDITION > 0).all()
    assert both.calibration.needed == ("pressure",)
    assert trained.calibration.needed == ()
    assert trained.calibration.estimate(unknown).turn_valid[1:].all()


@pytest.fixture(scope="module")
def both(cornering: Campaign, braking: Campaign) -> Trained:
    return train(observe([cornering, braking]))


@pytest.fixture(scope="module")
def braked(braking: Campaign) -> Trained:
    return train(observe([braking]))


def test_slip_ratio_and_rolling_condition(both: Trained) -> None:
    for kappa, word in ((-0.1, "braking"), (0.0, "free"), (0.1, "driving")):
        found = estimate(both, load=4500.0, slip_ratio=kappa)
        assert abs(np.nanmean(found.value["kappa"]) - kappa) < 2e-3
        assert set(found.rolling[1:]) == {word}
        assert found.valid["kappa"][1:].all()
    beyond = estimate(both, load=4500.0, slip_ratio=-0.4)
    assert abs(np.nanmean(beyond.value["kappa"]) + 0.4) < 5e-3
    assert not beyond.valid["kappa"].any()


def test_without_speed_there_is_no_slip_ratio_but_a_load(trained: Trained) -> None:
    features = features_of(load=5000.0)
    unknown = replace(features, speed=np.full(len(features), np.nan))
    found = trained.calibration.estimate(unknown)
    assert np.isnan(found.value["kappa"]).all()
    assert not found.valid["kappa"].any()
    assert abs(np.nanmean(found.value["Fz"]) - 5000.0) < 75.0


def test_a_contact_length_is_the_corrected_angle_times_the_rolling_radius(
    trained: Trained,
) -> None:
    features = features_of()
    found = trained.calibration.estimate(features)
    length, std = contact_lengths(features.contact_angle, found.radius, features.angle_std)
    np.testing.assert_array_equal(found.contact_length, length)
    np.testing.assert_array_equal(found.contact_length_std, std)
    read = features.contact_angle[1:] * found.radius[1:, None]
    short = found.contact_length[1:] / read - 1.0
    assert ((short > 0.07) & (short < 0.25)).all()
    np.testing.assert_allclose(found.radius[1:], 0.312 - 1e-6 * 4000.0, atol=1e-4)


def test_a_file_gives_the_same_estimates_to_the_last_digit(
    trained: Trained, tmp_path: Path
) -> None:
    write_calibration(trained.calibration, tmp_path / "cal.toml")
    again = read_calibration(tmp_path / "cal.toml")
    features = features_of(slip_angle=0.03)
    a, b = trained.calibration.estimate(features), again.estimate(features)
    for quantity in ("Fz", "Fy", "alpha", "kappa"):
        np.testing.assert_array_equal(a.value[quantity], b.value[quantity])
        np.testing.assert_array_equal(a.std[quantity], b.std[quantity])
        np.testing.assert_array_equal(a.valid[quantity], b.valid[quantity])
    assert a.notes == b.notes
    assert again.lateral == pytest.approx(LATERAL)


def test_another_tire_or_layout_is_refused(trained: Trained) -> None:
    calibration = trained.calibration
    calibration.check_layout("made-up tire", LATERAL, "here")
    with pytest.raises(CalibrationError, match="here: the tire is 'other', the calibration is of"):
        calibration.check_layout("other", LATERAL, "here")
    with pytest.raises(CalibrationError, match=r"gages lie at \+50, \+30, \+0, -30, -60 mm"):
        calibration.check_layout("made-up tire", (0.05, *LATERAL[1:]), "here")
    with pytest.raises(CalibrationError, match="calibrate with this layout"):
        calibration.check_layout("made-up tire", LATERAL[:4], "here")


def test_campaigns_of_different_tires_are_not_mixed() -> None:
    with pytest.raises(CalibrationError, match="a calibration holds for one tire"):
        same_tire([header(), header(tire="another")])
    shifted = replace(header(), gage_lateral=(0.05, 0.03, 0.0, -0.03, -0.06))
    with pytest.raises(CalibrationError, match="one calibration needs one layout"):
        same_tire([header(), shifted])


def test_too_few_conditions_are_refused(observed: Observations) -> None:
    few = take(observed, observed.group < 4)
    with pytest.raises(CalibrationError, match=r"usable turns at 4 conditions; .* at least 5"):
        train(few)


def test_what_was_not_varied_is_not_calibrated_and_says_why(braked: Trained) -> None:
    assert "measure several loads" in braked.links.refused["Fz"]
    assert "measure slip angles" in braked.links.refused["Fy"]
    assert "alpha" in braked.links.refused
    assert braked.calibration.chains[-1].has("kappa")


def test_sweeps_count_turn_by_turn(tmp_path: Path) -> None:
    runs = [replace(run, plan=replace(run.plan, kind="sweep")) for run in cornering_runs()[:10]]
    ramp = np.linspace(1000.0, 3000.0, runs[3].rig["Fz"].size)
    runs[3] = replace(runs[3], rig={**runs[3].rig, "Fz": ramp})
    swept = observe([read_campaign(write(tmp_path / "sweep", runs))])
    assert swept.sweep.all()
    assert np.unique(swept.unit).size == len(swept)
    steady, rising = (swept.usable & (swept.run == run) for run in (2, 3))
    np.testing.assert_allclose(swept.truth["Fz"][steady], 1500.0, atol=60.0)
    expected = 1000.0 + 2000.0 * swept.features.time[rising] / (ramp.size / 100.0)
    np.testing.assert_allclose(swept.truth["Fz"][rising], expected, atol=60.0)


def test_a_regressor_without_variation_is_named(braked: Trained) -> None:
    skipped = braked.skipped
    assert "3 conditions for 3 coefficients" in skipped["load from centre contact length"]
    assert "at least" in skipped["Fy from six regressors"]


def test_a_regression_on_a_regressor_that_stands_still_is_refused(trained: Trained) -> None:
    still = replace(trained.means, rate_slope=np.full_like(trained.means.rate_slope, 3.2))
    _, skipped = fit_all(still)
    assert "regressor slope is 3.2 in every run" in skipped["slip angle from slope of peak rates"]


def test_a_campaign_without_measured_load_gives_what_it_can(observed: Observations) -> None:
    blind = replace(observed, truth={**observed.truth, "Fz": np.full(len(observed), np.nan)})
    trained = train(blind)
    assert "no Fz" in trained.links.refused["Fz"]
    assert "no Fz" in trained.links.refused["alpha"]
    assert trained.calibration.chains[-1].has("Fy")
    assert trained.calibration.chains[-1].has("kappa")
    found = trained.calibration.estimate(features_of(slip_angle=np.deg2rad(2.0)))
    assert np.isnan(found.value["Fz"]).all()
    assert (found.value["Fy"][1:] < 0).all()


@pytest.mark.parametrize("factor", [1e6, 1e-6, 2.0])
def test_strain_in_a_wrong_unit_is_out_of_range(trained: Trained, factor: float) -> None:
    run = synthetic_run(0)
    assert run.strain is not None
    found = trained.calibration.estimate(
        measure_run(replace(run, strain=factor * run.strain), header())[0]
    )
    assert not found.turn_valid.any()


def test_combinations_that_were_never_measured_are_out_of_range(both: Trained) -> None:
    straight = estimate(both, load=4500.0, slip_ratio=-0.1)
    corner = estimate(both, load=4500.0, slip_angle=np.deg2rad(4.0))
    mixed = estimate(both, load=4500.0, slip_angle=np.deg2rad(4.0), slip_ratio=-0.1)
    assert straight.turn_valid[1:].all()
    assert corner.turn_valid[1:].all()
    assert not mixed.turn_valid.any()


def test_adding_a_campaign_does_not_spoil_the_first(
    trained: Trained, both: Trained, another_day: Campaign
) -> None:
    day = observe([another_day])

    def load_error(known: Trained) -> float:
        summary = estimate_document(
            day, known.calibration.estimate(day.features), known.calibration
        )["summary"]
        return float(summary["Fz"]["rmse"])

    assert load_error(both) < 2.0 * load_error(trained) + 5.0


def test_lateral_force_grows_with_a_pressure_that_was_not_varied(trained: Trained) -> None:
    laws = trained.calibration.chains[-1].force_laws
    reference = laws.reference_pressure
    pressure = reference * np.array([0.6, 1.0, 1.2, np.nan])
    factor, doubt = laws.force_factor({"pressure": pressure})
    np.testing.assert_allclose(factor, [0.6**0.8, 1.0, 1.2**0.8, 1.0])
    assert doubt[1] == 0.0
    assert doubt[0] > doubt[2] > 0.0
    assert doubt[3] == 0.15


@pytest.mark.parametrize("name", ["pressure", "camber"])
def test_a_condition_that_nobody_measures_widens_the_interval(trained: Trained, name: str) -> None:
    features = features_of(slip_angle=np.deg2rad(3.0))
    unknown = replace(features, **{name: np.full(len(features), np.nan)})
    known = trained.calibration.estimate(features)
    blind = trained.calibration.estimate(unknown)
    for quantity in ("Fy", "alpha") if name == "camber" else ("Fz", "Fy", "alpha"):
        assert (blind.std[quantity][1:] > 2.5 * known.std[quantity][1:]).all(), quantity


def test_a_set_point_stands_in_for_a_channel_that_is_missing() -> None:
    run = synthetic_run(0, pressure=2.0e5)
    rig = {name: x for name, x in run.rig.items() if name != "pressure"}
    features, _ = measure_run(replace(run, rig=rig), header())
    np.testing.assert_allclose(features.pressure[1:], 2.0e5)


def test_a_rig_that_stopped_recording_says_nothing_of_later_turns() -> None:
    run = synthetic_run(0, kind="sweep")
    assert run.rig_time is not None
    half = run.rig_time.size // 2
    short = replace(
        run, rig={name: x[:half] for name, x in run.rig.items()}, rig_time=run.rig_time[:half]
    )
    features, truth = measure_run(short, header())
    assert np.isfinite(truth["Fz"][1])
    assert np.isnan(truth["Fz"][-1])
    assert np.isnan(features.speed[-1])


def test_a_missing_rig_sample_does_not_erase_later_ones() -> None:
    run = synthetic_run(0, kind="sweep")
    force = run.rig["Fz"].copy()
    force[5] = np.nan
    _, truth = measure_run(replace(run, rig={**run.rig, "Fz": force}), header())
    np.testing.assert_allclose(truth["Fz"][1:], 4000.0, atol=40.0)
