"""Laws of ``VirtualTire.fmu``, through FMPy: it is the surface, and the surface is the rig."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from hypothesis import given
from hypothesis import strategies as st

from tests.fmu import live
from tests.fmu.virtual_host import (
    RATE,
    TYPICAL,
    Host,
    calibration_file,
    file,
    hold_against_rig,
    hold_mirrored,
    surface,
)
from tirelib.core.errors import FormatError, ParameterError
from tirelib.fmu.build import build_fmu
from tirelib.fmu.check import check_fmu
from tirelib.fmu.virtual.coordinates import INPUTS
from tirelib.fmu.virtual.faults import Faults
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.spec import build_virtual, default_surface
from tirelib.fmu.virtual.surface import read_surface, write_surface
from tirelib.fmu.virtual.wheel import VirtualWheel


@pytest.fixture(scope="module")
def ten() -> Iterator[Host]:
    host = Host(file(10))
    yield host
    host.close()


def steady(inputs: dict[str, float], angle: np.ndarray) -> np.ndarray:
    given = np.array([[inputs[name] for name in INPUTS]])
    return surface().strain(surface().answers(given), angle)


def test_the_fmu_is_valid_and_gives_its_reference_signals() -> None:
    assert validate_fmu(str(file(10))) == []
    document = check_fmu(file(10))
    assert document["passed"], document["parts"]
    assert document["compared"]


def test_the_surface_is_the_rig_within_its_stated_error() -> None:
    condition = (2200.0, 0.04, 0.02, -0.02, 25.0, 2.2e5)
    part = "Fz 2 .. 6 kN"
    state, apart = hold_against_rig(surface(), condition, part)
    told = surface().about["left_out"][part]
    assert abs(apart.fx) < 3.0 * told["Fx_N_rms"]
    assert abs(apart.fy) < 3.0 * told["Fy_N_rms"]
    load, _, _, _, speed, pressure = condition
    radius = surface().rolling_radius(load, speed, pressure)
    assert abs(radius - state.free_radius) < 4.0 * told["R_e_m_rms"] + 1e-6


def test_the_stated_error_is_small_against_the_strain() -> None:
    about = surface().about
    assert about["solutions"] >= 150
    assert about["left_out"]["all"]["strain_ustrain_rms"] < 0.04 * about["strain_spread_ustrain"]
    assert default_surface().stat().st_size < 2e6


@given(
    share=st.lists(st.floats(0.02, 0.98), min_size=6, max_size=6), angle=st.floats(-np.pi, np.pi)
)
def test_the_mirror_image_of_a_condition_has_the_mirror_image_of_its_strain(
    share: list[float], angle: float
) -> None:
    known = surface()
    inputs = (known.low + (known.high - known.low) * np.array(share))[None]
    at = np.array([angle])
    hold_mirrored(known, inputs, at)
    here = known.answers(inputs)
    np.testing.assert_allclose(
        known.strain(here, at + 2.0 * np.pi), known.strain(here, at), atol=1e-12
    )


def test_in_steady_rolling_every_sample_is_that_of_the_surface(ten: Host) -> None:
    ten.start()
    radius = surface().rolling_radius(4000.0, 20.0, 2.3e5)
    omega = 20.0 * 0.99 / radius
    found = ten.play(150)
    angle = -np.pi + omega * np.arange(1, 1501) / RATE
    np.testing.assert_allclose(found, steady(TYPICAL, angle), atol=1e-11)
    assert ten.get("omega") == pytest.approx(omega, rel=1e-12)
    turned = (angle[-1] + np.pi) % (2.0 * np.pi) - np.pi
    assert ten.get("wheel_angle") == pytest.approx(turned, abs=1e-9)
    assert (ten.get("frame_valid"), ten.get("status"), ten.get("samples")) == (True, "ok", 10)


def changing(host: Host, steps: list[float], **parameters: float) -> np.ndarray:
    """Samples while slip and load change at 40 and 80 ms, whatever the steps."""
    host.start(**parameters)
    found = [host.frame()[:1]]
    for step in steps:
        at = round(host.time, 9)
        host.put(alpha=0.03 if at < 0.04 else -0.05, Fz=4000.0 if at < 0.08 else 5500.0)
        host.step(step)
        found.append(host.frame()[: host.get("samples")])
    return np.concatenate(found)


def test_frames_of_any_length_hold_the_same_samples(ten: Host) -> None:
    noisy = {"noise_std": 4e-6, "seed": 5}
    wanted = changing(ten, [1e-3] * 120, **noisy)
    uneven = changing(ten, [4e-4, 6e-4, 2.5e-4, 7.5e-4, 1e-3, 1e-3] * 30, **noisy)
    np.testing.assert_allclose(uneven, wanted, rtol=0, atol=1e-11)
    for samples in (1, 100):
        other = Host(file(samples))
        try:
            found = changing(other, [samples / RATE] * (1200 // samples), **noisy)
        finally:
            other.close()
        same = 401 if samples == 100 else 1201  # inputs at 80 ms fall on a step of 100 samples too
        np.testing.assert_allclose(found[:same], wanted[:same], rtol=0, atol=1e-11)


@pytest.mark.parametrize("length", [0.2, 0.6])
def test_slip_is_felt_after_the_relaxation_length(ten: Host, length: float) -> None:
    ten.start(relaxation_length=length, relaxation_length_kappa=0.1)
    ten.put(alpha=-0.05, kappa=0.03)
    ten.play(int(length / 20.0 / 1e-3))
    left = (ten.get("alpha_relaxed") + 0.05) / 0.08
    assert left == pytest.approx(np.exp(-1.0), rel=1e-9)
    along = (ten.get("kappa_relaxed") - 0.03) / -0.04
    assert along == pytest.approx(np.exp(-length / 0.1), rel=1e-9)
    felt = np.array(
        [[4000.0, ten.get("alpha_relaxed"), ten.get("kappa_relaxed"), 0.01, 20.0, 2.3e5]]
    )
    now = surface().strain(surface().answers(felt), np.array([ten.get("wheel_angle")]))
    np.testing.assert_allclose(ten.frame()[-1:], now, atol=1e-11)
    assert ten.get("Fy_rig") == pytest.approx(surface().forces_of(surface().answers(felt))[0, 1])


@pytest.mark.parametrize("alpha", [TYPICAL["alpha"], -0.05])
def test_a_state_is_taken_up_bit_by_bit(ten: Host, alpha: float) -> None:
    options = {"noise_std": 4e-6, "dropped_frames": 0.2, "seed": 3}
    ten.start(**options)
    ten.put(alpha=alpha)
    ten.play(1)
    state = ten.slave.getFMUState()
    text, time = ten.slave.serializeFMUState(state), ten.time
    wanted = ten.play(40)
    for again in ("same", "after a reset"):
        if again == "after a reset":
            ten.start(**options)
            ten.slave.setFMUState(ten.slave.deSerializeFMUstate(text))
        else:
            ten.slave.setFMUState(state)
        ten.time = time
        assert ten.play(40).tobytes() == wanted.tobytes()
    ten.slave.freeFMUState(state)


def test_noise_has_its_size_and_its_seed(ten: Host) -> None:
    ten.start()
    clean = ten.play(200)
    ten.start(noise_std=5e-6, seed=1)
    one = ten.play(200) - clean
    ten.start(noise_std=5e-6, seed=2)
    two = ten.play(200) - clean
    # 2000 samples: the standard deviation of a standard deviation is 1.6 %
    np.testing.assert_allclose([one.std(axis=0), two.std(axis=0)], 5e-6, rtol=0.08)
    mixed = np.corrcoef(np.hstack((one, two)).T) - np.eye(10)
    assert np.abs(mixed).max() < 0.1
    assert abs(np.corrcoef(one[1:, 0], one[:-1, 0])[0, 1]) < 0.1


def test_faults_come_when_they_are_asked_for(ten: Host) -> None:
    ten.start()
    clean = ten.play(150)
    times = np.arange(1, 1501) / RATE
    ten.start(dead_gage=2, saturation=4e-3, drift=1e-3, fault_start=0.05)
    found = ten.play(150)
    before, after = times < 0.05 - 1e-9, times > 0.05 + 1e-9
    np.testing.assert_array_equal(found[before], clean[before])
    assert np.all(found[after, 1] == 0.0)
    others = [0, 2, 3, 4]
    drifted = clean[:, others] + 1e-3 * (times[:, None] - 0.05)
    np.testing.assert_allclose(
        found[after][:, others], np.clip(drifted[after], -4e-3, 4e-3), atol=1e-12
    )
    assert np.abs(drifted[after]).max() > 4e-3
    assert ten.get("status") == "fault_dead_gage;fault_saturation;fault_drift"
    assert ten.get("frame_valid") is True


def test_dropped_frames_are_marked_and_hold_the_last_one(ten: Host) -> None:
    ten.start(dropped_frames=0.3, seed=4)
    lost, last = 0, ten.frame()
    for _ in range(400):
        ten.step()
        if not ten.get("frame_valid"):
            lost += 1
            assert ten.get("status") == "frame_dropped"
            np.testing.assert_array_equal(ten.frame(), last)
        last = ten.frame()
    assert 90 <= lost <= 150  # 120 expected, standard deviation 9


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("Fz", 500.0),
        ("Fz", -1.0),
        ("alpha", 0.2),
        ("kappa", -0.2),
        ("camber", -0.1),
        ("speed", 2.0),
        ("speed", -20.0),
        ("pressure", 4e5),
        ("Fz", np.nan),
        ("alpha", np.inf),
        ("speed", np.nan),
    ],
)
def test_out_of_range_nothing_is_extrapolated_and_the_input_is_named(
    ten: Host, name: str, value: float
) -> None:
    ten.start(relaxation_length=0.05, relaxation_length_kappa=0.05)
    ten.play(3)
    held = ten.frame()
    ten.put(**{name: value})
    ten.play(2)
    assert ten.get("frame_valid") is False
    assert ten.get("status") == f"out_of_range: {name}"
    np.testing.assert_array_equal(ten.frame(), held)
    assert np.isfinite(ten.get("omega"))
    ten.put(**{name: TYPICAL[name]})
    ten.play(40)
    assert ten.get("status") == "ok"
    assert ten.get("frame_valid") is True


@pytest.mark.parametrize(
    ("why", "inputs"),
    [
        ("standstill", {"speed": 0.0, "kappa": np.nan, "alpha": 1.0}),
        ("locked", {"kappa": -1.0}),
        ("locked", {"kappa": -1.0, "speed": 2.0}),
    ],
)
def test_a_wheel_that_does_not_turn_keeps_the_strain_of_its_angle(
    ten: Host, why: str, inputs: dict[str, float]
) -> None:
    ten.start(relaxation_length_kappa=0.05)
    ten.play(47)
    ten.step(4.3e-4)  # ends between two samples, close to the contact
    angle = ten.get("wheel_angle")
    assert abs(angle) < 0.5
    assert ten.get("moving") is True
    ten.put(**inputs)
    found = np.concatenate((ten.play(2), ten.play(1)))
    np.testing.assert_allclose(
        found, np.tile(steady(TYPICAL, np.array([angle])), (30, 1)), atol=1e-11
    )
    told = [ten.get(name) for name in ("moving", "omega", "wheel_angle", "frame_valid", "status")]
    assert told == [False, 0.0, angle, True, why]
    ten.put(Fz=np.nan)
    ten.step()
    assert (ten.get("frame_valid"), ten.get("status")) == (False, "out_of_range: Fz")
    ten.put(**TYPICAL)
    ten.play(60)
    assert (ten.get("moving"), ten.get("status")) == (True, "ok")
    felt = {**TYPICAL, "kappa": ten.get("kappa_relaxed")}
    since = ten.get("omega") * 0.3 / RATE  # the last sample was 0.3 samples before the step's end
    now = steady(felt, np.array([ten.get("wheel_angle") - since]))
    np.testing.assert_allclose(ten.frame()[-1:], now, atol=1e-9)


def test_a_wheel_that_stands_at_the_start_has_no_strain_yet_and_then_starts(ten: Host) -> None:
    ten.start({**TYPICAL, "speed": 0.0})
    ten.step()
    assert [ten.get(n) for n in ("moving", "frame_valid", "status")] == [False, False, "standstill"]
    ten.put(speed=20.0)
    ten.step()
    assert [ten.get(n) for n in ("moving", "frame_valid", "status")] == [True, True, "ok"]


def test_a_state_of_a_standing_wheel_is_taken_up_bit_by_bit(ten: Host) -> None:
    ten.start(noise_std=4e-6)
    ten.play(47)
    ten.put(speed=0.0)
    ten.step()
    state = ten.slave.getFMUState()
    wanted = ten.play(3)
    ten.start()
    ten.slave.setFMUState(state)
    ten.put(speed=0.0)
    assert ten.play(3).tobytes() == wanted.tobytes()
    ten.slave.freeFMUState(state)


def test_slip_that_is_still_out_of_range_is_named_until_it_is_back(ten: Host) -> None:
    ten.start(relaxation_length=0.4)
    ten.put(alpha=0.3)
    ten.play(60)
    ten.put(alpha=0.0)
    ten.step()
    assert ten.get("status") == "out_of_range: alpha"
    ten.play(60)
    assert abs(ten.get("alpha_relaxed")) < 0.1
    assert ten.get("status") == "ok"


@pytest.mark.parametrize("step", [0.0, -1e-3, np.nan, np.inf, 1.1e-3])
def test_a_step_that_cannot_be_done_is_an_error(ten: Host, step: float) -> None:
    ten.start()
    ten.play(2)
    with pytest.raises(FMICallException, match="status 3"):
        ten.slave.doStep(ten.time, step)
    assert ten.get("frame_valid") is False
    assert ten.get("status").startswith("step_refused: communication step = ")
    ten.step()
    assert ten.get("status") == "ok"


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("sample_rate", lambda: Options(rate=1.0)),
        ("noise_std", lambda: Options(noise=-1.0)),
        ("relaxation_length", lambda: Options(relaxation=(np.nan, 0.1))),
        ("seed", lambda: Options(seed=-1)),
        ("dropped_frames", lambda: Faults(dropped=1.5)),
        ("saturation", lambda: Faults(saturation=-1.0)),
        ("fault_start", lambda: Faults(start=np.inf)),
        ("dead_gage", lambda: VirtualWheel(surface(), Options(faults=Faults(dead_gage=6)), 10)),
    ],
)
def test_a_parameter_out_of_range_is_refused_by_name(name: str, make: Callable[[], Any]) -> None:
    with pytest.raises(ParameterError, match=f"^{name} = "):
        make()


def test_a_refused_parameter_is_an_error_of_the_importer_not_its_end(ten: Host) -> None:
    with pytest.raises(FMICallException):
        ten.start(noise_std=-1.0)
    ten.start()
    ten.step()
    assert ten.get("frame_valid") is True


def test_a_damaged_surface_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    path.write_bytes(default_surface().read_bytes()[:5000])
    with pytest.raises(FormatError, match="is not the response surface of a virtual tire"):
        build_virtual(tmp_path / "x.fmu", surface=path)
    with pytest.raises(ParameterError, match="samples per step = 0"):
        build_virtual(tmp_path / "x.fmu", samples_per_step=0)
    write_surface(surface(), path)
    np.testing.assert_array_equal(read_surface(path).basis, surface().basis)


def test_the_estimator_finds_the_load_and_slip_angle_of_the_virtual_tire() -> None:
    strain_tire = build_fmu(
        calibration_file(), live.folder() / "StrainOfVirtual.fmu", samples_per_step=100
    )
    virtual, estimator = Host(file(100)), Host(strain_tire)
    try:
        inputs = {**TYPICAL, "Fz": 4300.0, "alpha": 0.025, "kappa": 0.0, "camber": 0.0}
        virtual.start(inputs, noise_std=4e-6, seed=9)
        estimator.slave.setupExperiment(startTime=0.0)
        estimator.put(speed=20.0, pressure=2.3e5, camber=0.0)
        estimator.slave.enterInitializationMode()
        estimator.slave.exitInitializationMode()
        for _ in range(45):
            virtual.step()
            estimator.slave.setReal(estimator.strains, virtual.frame().ravel().tolist())
            estimator.step()
        assert estimator.get("turn") >= 3
        assert estimator.get("valid")
        assert estimator.get("Fz") == pytest.approx(4300.0, rel=0.03)
        assert estimator.get("alpha") == pytest.approx(0.025, abs=np.radians(0.25))
        assert estimator.get("Fy") == pytest.approx(virtual.get("Fy_rig"), rel=0.1)
        assert estimator.get("turn_rate") == pytest.approx(virtual.get("omega"), rel=1e-3)
    finally:
        virtual.close()
        estimator.close()
