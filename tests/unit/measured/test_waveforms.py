"""Run mean waveforms of a campaign equal the closed form that made it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import synthetic_run, waveform, write
from tirelib.campaign import read_campaign
from tirelib.core.errors import CalibrationError
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID, N_PHI, Waveforms, measure_waveforms

LOADS = (2500.0, 4000.0, 5500.0)


@pytest.fixture(scope="module")
def waves(tmp_path_factory: pytest.TempPathFactory) -> Waveforms:
    runs = [synthetic_run(i, load=load, kind="free") for i, load in enumerate((*LOADS, LOADS[1]))]
    runs.append(synthetic_run(4, load=4000.0, slip_angle=0.05))
    return measure_waveforms(read_campaign(write(tmp_path_factory.mktemp("c") / "w", runs)))


def closed_form(load: float) -> np.ndarray:
    """The synthetic tire at 2.3 bar behind a Gaussian low-pass, its mean over the turn removed."""
    exact = waveform(GRID, half=0.04 + 2.6e-5 * load, dip=1e-3 + 3e-7 * load)
    order = np.arange(N_PHI // 2 + 1)
    gain = np.exp(-0.5 * (LowPass().sigma(1.0) * order) ** 2) * (order > 0)
    return np.asarray(np.fft.irfft(np.fft.rfft(exact) * gain, n=N_PHI))


def test_mean_waveforms_are_the_closed_form(waves: Waveforms) -> None:
    for i, load in enumerate(LOADS):
        for gage in range(5):
            # noise of 4 ustrain is averaged; the angle's zero is known to 1 mrad
            error = waves.strain[i, gage] - closed_form(load)
            assert np.sqrt(np.mean(error**2)) < 0.02 * np.std(closed_form(load))


def test_the_mean_over_the_turn_is_removed(waves: Waveforms) -> None:
    assert waves.strain.shape == (5, 5, N_PHI)
    assert waves.strain.mean(axis=2) == pytest.approx(0.0, abs=1e-12)


def test_the_angle_comes_from_the_trigger(waves: Waveforms) -> None:
    """An asymmetric waveform stays asymmetric: no centring on the contact."""
    for i, load in enumerate(LOADS):
        exact = closed_form(load)
        shifts = np.linspace(-0.02, 0.02, 41)
        errors = [
            np.sum((waves.strain[i, 2] - np.interp(GRID - s, GRID, exact, period=2 * np.pi)) ** 2)
            for s in shifts
        ]
        # the trigger resolves a sample, 6 mrad; four turns average it
        assert abs(shifts[int(np.argmin(errors))]) <= 0.004
    assert (waves.angle_std > 0).all()
    assert (waves.angle_std < 2e-3).all()


@pytest.mark.parametrize("samples", [-30, 30])
def test_a_trigger_that_comes_later_shows_everything_at_smaller_angles(
    samples: int, tmp_path: Path
) -> None:
    """The wheel turns toward larger angles: after a late zero it has come less far."""
    run = synthetic_run(0, load=4000.0)
    assert run.trigger is not None
    assert run.rig is not None
    turned = samples / run.rate * float(np.mean(run.rig["omega"]))
    late = replace(run, trigger=np.roll(run.trigger, samples))
    found = measure_waveforms(read_campaign(write(tmp_path / "w", [late]))).strain[0, 2]
    errors = [
        np.std(found - np.interp(GRID + angle, GRID, closed_form(4000.0), period=2.0 * np.pi))
        for angle in (-turned, 0.0, turned)
    ]
    assert errors[2] < 0.2 * min(errors[:2])


def test_a_turn_rate_that_no_rig_tells_is_that_of_the_contacts(tmp_path: Path) -> None:
    run = synthetic_run(0, load=4000.0)
    assert run.rig is not None
    told = float(np.mean(run.rig["omega"]))
    silent = replace(run, rig={k: v for k, v in run.rig.items() if k != "omega"})
    found = measure_waveforms(read_campaign(write(tmp_path / "w", [silent])))
    assert found.conditions["omega"] == pytest.approx([told], rel=1e-3)


def test_a_run_whose_contacts_cannot_be_found_is_left_out_with_the_gage_at_fault(
    tmp_path: Path,
) -> None:
    sound, broken = synthetic_run(0, load=4000.0), synthetic_run(1, load=5000.0)
    assert broken.strain is not None
    strain = broken.strain.copy()
    strain[2] = np.nan
    found = measure_waveforms(
        read_campaign(write(tmp_path / "w", [sound, replace(broken, strain=strain)]))
    )
    assert found.run.tolist() == [0]
    assert "100% of the samples of gage 3, which finds the contacts" in found.left_out[1]


def test_equal_set_points_are_a_group(waves: Waveforms) -> None:
    assert waves.group.tolist() == [0, 1, 2, 1, 3]


def test_conditions_are_measured_or_set(waves: Waveforms) -> None:
    assert waves.conditions["Fz"][:3] == pytest.approx(LOADS, rel=0.01)
    assert waves.conditions["pressure"] == pytest.approx(2.3e5, rel=0.01)
    assert np.isnan(waves.conditions["loaded_radius"]).all()
    assert waves.straight.tolist() == [True, True, True, True, False]
    assert waves.start == pytest.approx(12.0 * np.arange(5))


@pytest.mark.parametrize(
    ("name", "most"),
    [("slip_angle", np.deg2rad(0.25)), ("camber", np.deg2rad(0.25)), ("slip_ratio", 0.005)],
)
def test_a_run_is_straight_up_to_a_quarter_degree_and_half_a_percent(
    waves: Waveforms, name: str, most: float
) -> None:
    values = most * np.array([0.0, np.nan, 0.99, 1.01, -1.01])
    still = dict.fromkeys(("slip_angle", "camber", "slip_ratio"), np.zeros(5))
    given = replace(waves, conditions=dict(waves.conditions) | still | {name: values})
    assert given.straight.tolist() == [True, True, True, False, False]


def test_scatter_of_turns_is_the_noise(waves: Waveforms) -> None:
    assert (waves.scatter > 5e-7).all()
    assert (waves.scatter < 3e-5).all()
    assert (waves.turns >= 2).all()


def test_the_scatter_of_turns_does_not_fall_where_they_are_few(tmp_path: Path) -> None:
    runs = [synthetic_run(i, turns=4.6 if i < 6 else 14.6, noise=4e-5) for i in range(8)]
    found = measure_waveforms(read_campaign(write(tmp_path / "w", runs)))
    assert found.turns[:6].max() <= 3
    assert found.turns[6:].min() >= 11
    # five gages with two dozen free harmonics each: a run of two turns tells it within 5 %
    few = np.sqrt(np.mean(found.scatter[:6] ** 2))
    assert few == pytest.approx(np.sqrt(np.mean(found.scatter[6:] ** 2)), rel=0.1)


def test_taking_runs_takes_all_their_columns(waves: Waveforms) -> None:
    some = waves.take(np.array([3, 1]))
    assert len(some) == 2
    assert some.run.tolist() == [3, 1]
    assert some.conditions["Fz"] == pytest.approx(waves.conditions["Fz"][[3, 1]])
    assert some.header is waves.header


def test_sweeps_and_short_runs_are_left_out_with_the_reason(tmp_path: Path) -> None:
    runs = [synthetic_run(0), synthetic_run(1, kind="sweep"), synthetic_run(2, turns=1.5)]
    found = measure_waveforms(read_campaign(write(tmp_path / "w", runs)))
    assert found.run.tolist() == [0]
    assert "sweep" in found.left_out[1]
    assert "no whole turn" in found.left_out[2]


def test_a_campaign_of_sweeps_alone_is_refused(tmp_path: Path) -> None:
    runs = [synthetic_run(i, kind="sweep") for i in range(3)]
    campaign = read_campaign(write(tmp_path / "w", runs))
    with pytest.raises(CalibrationError, match=r"synthetic: no run .*run 0: is a sweep"):
        measure_waveforms(campaign)
