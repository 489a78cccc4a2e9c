"""The measuring chain on a made-up state: no solver is needed here."""

from dataclasses import replace

import numpy as np
import pytest

from tirelib.rig.measure import MeasuringChain, Recording, Stage, gages, record, settle
from tirelib.rig.mesh import mesh
from tirelib.rig.observe import Forces, Trace
from tirelib.rig.solve import RigState
from tirelib.rig.tire import Condition, RigTire

CONDITION = Condition(4800.0, 2.3e5, 18.0)
QUIET = MeasuringChain(
    gage_gain=0.0, gage_offset=0.0, gage_drift=0.0, gain_repeatability=0.0, run_out=0.0
)


def made_up() -> tuple[RigState, Trace, Forces]:
    grid = mesh()
    zero = np.zeros((grid.n, 16))
    state = RigState(
        RigTire(), CONDITION, grid, zero, 0.292, 0.308, 0.308, zero, stiffness=2e5, steps=0
    )
    phi = np.linspace(-np.pi, np.pi, 7200, endpoint=False)
    bump = np.exp(-((phi / 0.2) ** 2))
    strain = 2.5e-3 + 9e-3 * np.outer(bump, np.ones(5))
    flat = np.zeros_like(strain)
    return state, Trace(phi, strain, flat, flat + 1e-6), Forces(0.0, 0.0, 4800.0, 0.0, 0.0, 0.0)


def measure(chain: MeasuringChain, seed: int = 0, run: int = 0) -> Recording:
    state, trace, force = made_up()
    return record([Stage(state, trace, force)], chain, seed, run)


def test_a_seed_gives_the_same_recording_and_another_gives_another() -> None:
    one, same, other = (
        measure(MeasuringChain(), 3, 5),
        measure(MeasuringChain(), 3, 5),
        measure(MeasuringChain(), 4, 5),
    )
    np.testing.assert_array_equal(one.strain, same.strain)
    np.testing.assert_array_equal(one.rig["Fz"], same.rig["Fz"])
    n = min(one.strain.shape[1], other.strain.shape[1])
    assert np.any(one.strain[:, :n] != other.strain[:, :n])
    assert np.any(measure(MeasuringChain(), 3, 6).strain[:, :n] != one.strain[:, :n])


def test_gages_belong_to_the_tire_and_not_to_the_day() -> None:
    chain = MeasuringChain()
    np.testing.assert_array_equal(gages(RigTire(), chain).gain, gages(RigTire(), chain).gain)
    other = gages(RigTire(name="another"), chain)
    assert np.all(other.gain != gages(RigTire(), chain).gain)
    chain = replace(QUIET, gage_gain=0.01, gage_noise=0.0)
    one, two = measure(chain, 1), measure(chain, 2)
    ratio = one.strain.max(axis=1) / two.strain.max(axis=1)
    np.testing.assert_allclose(ratio, 1.0, atol=1e-3)  # the day's start angle and quantisation


def test_gage_noise_is_white_and_of_the_stated_size() -> None:
    chain = replace(QUIET, gage_noise=4e-5)
    state, trace, force = made_up()
    flat = replace(trace, strain=np.full_like(trace.strain, 2e-3))
    strain = record([Stage(state, flat, force)], chain, 0, 0).strain - 2e-3
    assert strain.std() == pytest.approx(4e-5, rel=0.03)  # 27,000 samples: 0.4 % one sigma
    following = np.mean(strain[:, 1:] * strain[:, :-1]) / strain.var()
    assert abs(following) < 0.03


def test_gain_repeatability_is_of_the_stated_size() -> None:
    chain = replace(QUIET, gain_repeatability=0.003, gage_noise=0.0)
    peaks = np.array([measure(chain, 0, run).strain.max(axis=1) for run in range(40)])
    # 200 draws: 5 % one sigma
    assert np.std(peaks / peaks.mean(axis=0)) == pytest.approx(0.003, rel=0.2)


def test_strain_is_quantised_to_14_bits() -> None:
    strain = measure(MeasuringChain()).strain
    step = 0.04 / 2**14
    np.testing.assert_allclose(strain / step, np.round(strain / step), atol=1e-6)


def test_range_saturates() -> None:
    state, trace, force = made_up()
    huge = replace(trace, strain=10.0 * trace.strain)
    strain = record([Stage(state, huge, force)], MeasuringChain(), 0, 0).strain
    assert strain.max() == pytest.approx(0.02, rel=1e-3)


def test_trigger_marks_the_top_and_five_contacts_follow() -> None:
    recording = measure(replace(QUIET, gage_noise=0.0))
    top = np.flatnonzero(recording.trigger)
    omega = 18.0 / 0.308
    turn = 2.0 * np.pi / omega * 1e4
    assert len(top) >= 5
    assert np.all(np.abs(np.diff(top) - turn) <= 1.0)
    peak = recording.strain[2] > 11e-3
    contacts = np.flatnonzero(np.diff(peak.astype(int)) == 1)
    assert len(contacts) == 5
    centre = top[0] + int(np.argmax(recording.strain[2, top[0] : top[1]]))
    # half a sample of trigger, and the strain step at the flat top of the bump
    assert centre - top[0] == pytest.approx(0.5 * turn, abs=4.0)


def test_run_out_swings_the_load_once_per_turn() -> None:
    quiet = replace(QUIET, force_noise=0.0, run_out=1e-4)
    fz = measure(quiet).rig["Fz"]
    assert np.ptp(fz) == pytest.approx(2.0 * 2e5 * 1e-4, rel=0.05)


def test_set_points_scatter_as_stated_and_the_rest_is_kept() -> None:
    chain = MeasuringChain()
    true = [settle(CONDITION, chain, 0, run) for run in range(400)]
    load = np.array([c.load for c in true]) / 4800.0 - 1.0
    speed = np.array([c.speed for c in true]) / 18.0 - 1.0
    assert load.std() == pytest.approx(0.005, rel=0.15)
    assert speed.std() == pytest.approx(0.001, rel=0.15)
    assert abs(load.mean()) < 0.001
    assert all(c.slip_ratio is None for c in true)
    assert settle(CONDITION, chain, 1, 0) != true[0]


def test_group_two_reports_the_truth_with_sensor_noise() -> None:
    samples = np.concatenate([measure(MeasuringChain(), 0, run).rig["Fz"] for run in range(20)])
    assert samples.mean() == pytest.approx(4800.0, abs=5.0)
    # 30 N noise with the run-out's 20 N / sqrt(2)
    assert samples.std() == pytest.approx(np.hypot(30.0, 14.1), rel=0.1)
