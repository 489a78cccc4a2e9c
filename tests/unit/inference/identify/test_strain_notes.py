"""No run and no gage is left out silently, and lengths, signs and units are looked at first."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import synthetic_run, write
from tests.unit.inference.identify.model_waves import made_waves
from tirelib.campaign import Campaign, RunPlan, read_campaign
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.identify import _contradictions, _with_run, start_file
from tirelib.inference.identify.strain_notes import (
    broken_gages,
    gage_notes,
    is_straight,
    ring_expected,
    run_notes,
)
from tirelib.measured.waveforms import Waveforms


@pytest.fixture(scope="module")
def waves() -> Waveforms:
    return made_waves(pressures=(2.1e5,), repeats=1, seed=1)


def plan(run: int, load: float = 4000.0, kind: str = "free", **values: float) -> RunPlan:
    given = RunPlan(run, f"runs/{run}.mf4", kind, load, 2.1e5, 18.0, 0.0, 0.0, 0.0)
    return replace(given, **values)


def with_condition(waves: Waveforms, name: str, values: np.ndarray) -> Waveforms:
    return replace(waves, conditions={**waves.conditions, name: values})


def test_a_gage_that_fell_off_is_named_with_its_runs_and_so_is_its_twin(waves: Waveforms) -> None:
    strain = waves.strain.copy()
    strain[[2, 3], 1] = 0.0
    runs = straight_runs(replace(waves, strain=strain))
    first, second = gage_notes(runs.waves, runs.gages)
    assert first.startswith("gage 2 at +30 mm: 0 microstrain rms in 2 runs (2, 3), where the")
    assert second.startswith("gage 4 at -30 mm: works, but its twin")
    assert gage_notes(waves, straight_runs(waves).gages) == ()


def test_a_gage_without_numbers_is_named_as_such(waves: Waveforms) -> None:
    strain = waves.strain.copy()
    strain[3, 1] = np.nan
    runs = straight_runs(replace(waves, strain=strain))
    assert gage_notes(runs.waves, runs.gages)[0].startswith(
        "gage 2 at +30 mm: samples that are no numbers (NaN) in run 3"
    )


def test_a_straight_run_without_waveform_is_named_with_its_reason(waves: Waveforms) -> None:
    lost = replace(waves, left_out={20: "holds no whole turn", 21: "holds no whole turn"})
    plans = [plan(20), plan(21, slip_angle=0.05)]
    assert run_notes(lost, plans) == ("run 20: holds no whole turn; left out of the ring",)


def test_a_run_with_gaps_in_every_gage_is_left_out_and_named(waves: Waveforms) -> None:
    strain = waves.strain.copy()
    strain[4, :, 50] = np.nan
    broken = replace(waves, strain=strain)
    assert 4 not in straight_runs(broken).waves.run
    assert run_notes(broken, [])[0].startswith("run 4: no gage gives a whole waveform")
    strain[:, :, 50] = np.nan
    with pytest.raises(CalibrationError, match=r"no gage gives a whole.*noise in gage 3 at \+0 mm"):
        straight_runs(replace(waves, strain=strain))


def test_what_stands_in_for_a_measurement_is_said(waves: Waveforms) -> None:
    load = waves.conditions["Fz"]
    plans = [plan(int(run), load=float(load[k])) for k, run in enumerate(waves.run[:2])]
    assert run_notes(waves, plans)[0].startswith("2 runs (0, 1): load is exactly the set point")
    pressure = waves.conditions["pressure"].copy()
    pressure[3] = np.nan
    without = with_condition(waves, "pressure", pressure)
    assert run_notes(without, []) == (
        "run 3: no inflation pressure is known; left out of the ring",
    )
    assert 3 not in straight_runs(without).waves.run


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("Fz", -4000.0, "run 2: Fz is -4000 N; at least 10 N"),
        ("pressure", 0.0, "run 2: pressure is 0 bar; at least 0.1 bar"),
        ("omega", 0.0, "run 2: omega is 0 rad/s"),
    ],
)
def test_a_condition_that_no_rolling_tire_has_is_named(
    waves: Waveforms, name: str, value: float, words: str
) -> None:
    values = waves.conditions[name].copy()
    values[2] = value
    with pytest.raises(CalibrationError, match=words):
        straight_runs(with_condition(waves, name, values))


def test_a_tread_that_does_not_fit_outside_the_belt_is_refused(waves: Waveforms) -> None:
    def of(thickness: float) -> Waveforms:
        tire = replace(waves.header.tire, tread_thickness=thickness)
        return replace(waves, header=replace(waves.header, tire=tire))

    with pytest.raises(CalibrationError, match=r"tread_thickness_m = 0.02 m.*leave 0.0135 m"):
        straight_runs(of(0.02))
    assert straight_runs(of(0.0135)).waves.run.size


def test_gages_of_the_wrong_sign_or_unit_are_named(waves: Waveforms) -> None:
    with pytest.raises(CalibrationError, match=r"run 0: -\d+ microstrain below the axle.*sign of"):
        straight_runs(replace(waves, strain=-waves.strain))
    with pytest.raises(CalibrationError, match=r"run 0: .*microstrain rms; at most 50000.*unit"):
        straight_runs(replace(waves, strain=1e3 * waves.strain))


def test_a_measured_length_that_the_strain_contradicts_is_said(waves: Waveforms) -> None:
    start = start_file(waves.header, straight_runs(waves), None)
    estimate = Estimate("innerliner_offset", -3.2e-3, 1e-4, -3.4e-3, -3e-3, 1e-4, ("at_boundary",))
    (said,) = _contradictions(start, (estimate,))
    assert "the strain says -3.2 mm" in said
    assert "campaign.toml says -3.3 mm" in said
    assert _contradictions(start, (replace(estimate, flags=()),)) == ()


def test_messages_of_the_model_name_the_run(waves: Waveforms) -> None:
    runs = straight_runs(waves.take(np.array([5, 4, 3, 2, 1, 0])))
    error = ParameterError("contact: point 1 at 9 N", point=1)
    assert _with_run(error, runs).endswith("contact: run 4 at 9 N")
    assert _with_run(ParameterError("point 1 of nothing"), runs).endswith(": point 1 of nothing")


def campaign_of(plans: list[RunPlan], waves: Waveforms) -> Campaign:
    return Campaign(Path(), waves.header, tuple(plans))


def test_a_ring_is_expected_of_straight_runs_at_several_loads(waves: Waveforms) -> None:
    straight = [plan(i, load) for i, load in enumerate((2000.0, 3000.0, 4000.0, 5000.0))]
    assert ring_expected(campaign_of(straight, waves))
    assert not ring_expected(campaign_of(straight[:3], waves))
    assert not ring_expected(campaign_of([plan(i) for i in range(6)], waves))
    assert not ring_expected(campaign_of([replace(p, slip_angle=0.02) for p in straight], waves))
    bare = replace(waves, header=replace(waves.header, gage_lateral=()))
    assert not ring_expected(campaign_of(straight, bare))
    assert not is_straight(plan(1, kind="sweep"))


def test_the_gage_that_finds_the_contacts_is_named_when_it_is_dead(tmp_path: Path) -> None:
    runs = [synthetic_run(i, kind="free") for i in range(2)]
    for run in runs:
        assert run.strain is not None
        run.strain[2] = 2.7e-3
    (said,) = broken_gages(read_campaign(write(tmp_path / "dead", runs)))
    assert said.startswith(
        "gage 3 at +0 mm hardly shows strain in 2 runs (0, 1), and it is the one"
    )
    flat = [replace(r, strain=1e-3 * np.asarray(r.strain)) for r in runs]
    (said,) = broken_gages(read_campaign(write(tmp_path / "flat", flat)))
    assert said == "all gages of 2 runs (0, 1) range below 200 microstrain, check their unit"
