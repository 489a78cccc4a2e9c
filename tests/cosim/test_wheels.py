"""Four wheels of a third-party vehicle, open loop: what the strain tires say is what is so."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("vehiclemodels", reason="commonroad-vehicle-models is not installed")

from cosim.calibrate import CALIBRATION
from cosim.drill import AFTER, BEFORE, CASES
from cosim.manoeuvres import Driver, Manoeuvre, ramp
from cosim.recording import TIME_STEP, VEHICLE, Recording, build_fmus, follow, record
from cosim.run import reached, series
from cosim.score import LIMITS, in_range, score, turns_of
from cosim.vehicle import Controls, G, Motion, Vehicle
from cosim.water import WaterTable
from cosim.wheels import NAMES, OWN_FRICTION, WHEELS, FourWheels, WheelStates
from pages.cosim import write_cosim

from tests.fmu import live, virtual_host
from tirelib.core.errors import ParameterError
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD


def _steer(side: float) -> Manoeuvre:
    def begin(_: Vehicle) -> Driver:
        def drive(t: float, motion: Motion) -> Controls:
            angle = side * np.radians(1.2) * ramp(t, 0.1, 0.4)
            return Controls((angle - motion.steer) / 0.05)

        return drive

    return Manoeuvre("steer", "a short step steer", 20.0, 1.0, begin)


def _brake() -> Manoeuvre:
    def begin(_: Vehicle) -> Driver:
        def drive(t: float, _: Motion) -> Controls:
            force = -ramp(t, 0.2, 0.4)
            return Controls(torque=(500.0 * force, 500.0 * force, 280.0 * force, 280.0 * force))

        return drive

    return Manoeuvre("brake", "short braking", 22.0, 0.9, begin)


@pytest.fixture(scope="module")
def fmus() -> tuple[Path, Path]:
    folder = live.folder() / "open_loop"
    folder.mkdir(exist_ok=True)
    return build_fmus(folder, CALIBRATION)


@pytest.fixture(scope="module")
def wheels(fmus: tuple[Path, Path]) -> Iterator[FourWheels]:
    """Wheels without noise whose gages start alike left and right, so that mirrors are exact."""
    with FourWheels(
        *fmus, noise=0.0, start_angles=(-3.1, -3.1, 0.6, 0.6), speed_sensors=True
    ) as found:
        yield found


@pytest.fixture(scope="module")
def left(wheels: FourWheels) -> Recording:
    return record(_steer(1.0), wheels)


@pytest.fixture(scope="module")
def braked(wheels: FourWheels) -> Recording:
    return record(_brake(), wheels)


REACHED = {**LIMITS, "Fz": 4.5}
"""As the goals, but Fz: straight ahead this calibration reads up to 4 % of the load too little."""


def assert_reached(recording: Recording) -> None:
    told = score(recording)["all"]
    assert told["steady"]["turns"] >= 12
    for name, limit in REACHED.items():
        assert told["steady"][name] <= limit, name
    assert told["false_alarms"] == 0.0
    assert told["over_deg"] <= 0.0


@pytest.mark.parametrize("which", ["left", "braked"])
def test_the_figures_are_reached_in_steady_turns(
    which: str, request: pytest.FixtureRequest
) -> None:
    assert_reached(request.getfixturevalue(which))


def last(recording: Recording, name: str) -> np.ndarray:
    """Mean of the estimates over the last tenth of a second."""
    return np.asarray(recording.told[name][-100:].mean(axis=0))


@pytest.mark.parametrize("which", ["left", "braked"])
def test_the_estimated_loads_add_up_to_the_weight(
    which: str, request: pytest.FixtureRequest
) -> None:
    recording = request.getfixturevalue(which)
    weight = Vehicle(VEHICLE, 20.0).mass * G
    assert last(recording, "Fz").sum() == pytest.approx(weight, rel=0.045)


def test_in_a_left_turn_the_estimates_say_so(left: Recording) -> None:
    load, alpha = last(left, "Fz"), last(left, "alpha")
    assert load[1] > 1.2 * load[0]
    assert load[3] > 1.2 * load[2]
    assert np.all(alpha < -np.radians(0.4))
    assert np.all(last(left, "Fy")[[1, 3]] > 0.0)
    truth = np.stack([left.truth[name][-100:].mean(axis=0) for name in ("Fz", "alpha")])
    np.testing.assert_allclose(load, truth[0], atol=0.05 * left.static.max())
    np.testing.assert_allclose(alpha, truth[1], atol=np.radians(0.25))


def test_the_mirrored_steer_has_the_mirrored_estimates(left: Recording, wheels: FourWheels) -> None:
    """To half of what the figures allow, Fy to all of it: the calibration is of gages that are not
    quite alike, and the vehicle's tire is shifted a little."""
    right = record(_steer(-1.0), wheels)
    swap = [1, 0, 3, 2]
    size = {
        "Fz": 0.015 * left.static.max(),
        "alpha": np.radians(0.125),
        "kappa": 0.005,
        "Fy": 0.05 * np.nanmax(np.abs(left.told["tire_fy"])),
    }
    for name, most in size.items():
        side = -1.0 if name in ("alpha", "Fy") else 1.0
        here, there = left.told[name], side * right.told[name][:, swap]
        both = (left.told["turn"] > 1) & (right.told["turn"][:, swap] == left.told["turn"])
        assert both.mean() > 0.7
        off = np.sqrt(np.mean((here - there)[both] ** 2))
        assert off < most, name
        assert np.ptp(here[both]) > 5.0 * most or name == "kappa"


def test_under_braking_slip_is_negative_and_the_load_goes_to_the_front(braked: Recording) -> None:
    kappa, load = last(braked, "kappa"), last(braked, "Fz")
    truth = braked.truth["kappa"][-100:].mean(axis=0)
    assert np.all(truth < -0.005)
    np.testing.assert_allclose(kappa, truth, atol=2e-3)
    assert np.all(load[:2] > load[2:] + 800.0)


def test_an_estimate_is_of_its_contact_and_comes_in_time(left: Recording) -> None:
    for wheel in range(len(WHEELS)):
        turns = turns_of(left, wheel)
        angle = left.told["tire_angle"][:, wheel]
        at = (turns.contact / TIME_STEP).astype(int)
        np.testing.assert_allclose(angle[at], 0.0, atol=np.radians(4.0))  # gages over the road
        assert np.all(turns.lag > 0.0)
        assert np.all(turns.lag <= turns.allowed)


def test_an_estimate_is_held_against_the_truth_at_its_contact(braked: Recording) -> None:
    """The slip ratio too, and not against its mean over the turn before."""
    for wheel in range(len(WHEELS)):
        turns = turns_of(braked, wheel)
        at = (turns.contact / TIME_STEP).astype(int)
        for name in ("Fz", "alpha", "kappa"):
            np.testing.assert_array_equal(turns.truth[name], braked.truth[name][at, wheel])
        assert np.ptp(turns.truth["kappa"]) > 0.005


def test_all_is_in_range_and_told_so(left: Recording) -> None:
    good, bad = in_range(left, 0)
    assert good[-1]
    assert not bad.any()
    assert np.all(left.told["tire_valid"] == 1.0)
    slippery = 0.5 * left.truth["friction"]
    good, bad = in_range(replace(left, truth=left.truth | {"friction": slippery}), 0)
    assert not good.any()
    assert not bad.any()


def test_out_of_range_valid_drops_within_two_turns(fmus: tuple[Path, Path]) -> None:
    """One of each kind: within the virtual tire's range, out of it, locked, and none."""
    cases = [CASES[0], CASES[3], CASES[5]]
    size = len(WHEELS)
    steady = WheelStates(*(np.full(size, x) for x in (4000.0, 0.02, 0.0, 0.0, 20.0)))
    out = steady
    for at, (_, name, value) in enumerate(cases):
        changed = getattr(out, name).copy()
        changed[at] = value
        out = replace(out, **{name: changed})
    before, after = round(0.6 * BEFORE / TIME_STEP), round(0.35 * AFTER / TIME_STEP)
    with FourWheels(*fmus) as wheels:
        told = follow([steady] * before + [out] * after, wheels)
    assert np.all(told["valid"][before - 1] == 1.0)
    two_turns = round(4.0 * np.pi / told["tire_omega"][before - 1, 0] / TIME_STEP)
    assert not told["valid"][before + two_turns :, :3].any()
    assert told["valid"][before:, 3].all()


def test_every_wheel_has_the_friction_of_the_road_under_it(wheels: FourWheels) -> None:
    """At a slip angle where the tire slides the lateral force is what the friction leaves."""
    size, factor = len(WHEELS), np.array([0.5, 1.0, 0.4, 0.8])
    state = WheelStates(
        *(np.full(size, x) for x in (4000.0, 0.13, -0.01, 0.0, 20.0)),
        friction=OWN_FRICTION * factor,
    )
    wheels.start(state)
    told = wheels.step(0.0, TIME_STEP, state)
    left_out = virtual_host.friction().about["left_out"]["friction 0.3 .. 0.5"]["Fy_N_rms"]
    np.testing.assert_allclose(
        -told.tire_fy, 0.97 * OWN_FRICTION * factor * 4000.0, rtol=0.05, atol=left_out
    )


def test_a_slippery_road_is_refused_by_a_virtual_tire_that_knows_one_friction(
    fmus: tuple[Path, Path],
) -> None:
    state = WheelStates(*(np.full(len(WHEELS), x) for x in (4000.0, 0.0, 0.0, 0.0, 20.0)))
    with FourWheels(virtual_host.file(10), fmus[1]) as wheels:
        wheels.start(state)
        wheels.step(0.0, TIME_STEP, state)
        slippery = replace(state, friction=np.array([OWN_FRICTION, 0.5, 0.5, 0.5]))
        with pytest.raises(ParameterError, match=r"tire_FR: friction = 0.5, .*allowed is 0.95"):
            wheels.step(TIME_STEP, TIME_STEP, slippery)


def test_a_wheel_speed_sensor_tells_the_turn_rate_of_the_tire_that_is_seen(
    wheels: FourWheels, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless the vehicle tells another, as vehicles do that have the same tire."""
    seen: list[np.ndarray] = []
    monkeypatch.setattr(wheels, "_estimate", lambda *given: seen.append(given[3]))
    state = WheelStates(*(np.full(len(WHEELS), x) for x in (4000.0, 0.0, 0.0, 0.0, 20.0)))
    state = replace(state, omega=np.array([np.nan, 50.0, np.nan, np.nan]))
    wheels.start(state)
    own = wheels.step(0.0, TIME_STEP, state).tire_omega
    told = np.array(seen)[:, HELD.index("omega")]
    np.testing.assert_array_equal(told, [own[0], 50.0, own[2], own[3]])


def test_water_is_refused_without_a_table_and_added_with_one(wheels: FourWheels) -> None:
    size = len(WHEELS)
    dry = WheelStates(*(np.full(size, x) for x in (4000.0, 0.0, 0.0, 0.0, 20.0)))
    wet = replace(dry, wedge=np.array([0.0, 1e5, 0.0, 0.0]))
    wheels.start(dry)
    with pytest.raises(ParameterError, match=r"wedge = 100000 Pa, .*cosim.water.water_table"):
        wheels.step(0.0, TIME_STEP, wet)
    angle = np.linspace(-np.pi, np.pi, 9)[:-1]
    change = np.zeros((2, 2, 8, 5))
    change[:, 1] = angle[:, None]
    wheels._water = WaterTable(np.array([3e3, 5e3]), np.array([0.0, 1e5]), change)
    added = wheels._wet(4000.0, 1e5, [50.0, 0.4], 10)
    wheels._water = None
    # the last sample is that of the wheel's angle, a sample is 0.005 rad
    np.testing.assert_allclose(added[:, 2], 0.4 - 0.005 * np.arange(9.0, -1.0, -1.0), atol=1e-12)


def test_the_vehicle_tells_the_friction_under_its_wheels() -> None:
    factor = (0.5, 1.0, 0.4, 0.8)
    told = Vehicle(VEHICLE, 20.0).step(TIME_STEP, Controls(friction=factor)).wheels
    np.testing.assert_allclose(told.friction, OWN_FRICTION * np.array(factor))


def test_on_a_slippery_road_the_interval_of_the_slip_angle_binds(braked: Recording) -> None:
    one = score(braked)
    assert one["least_friction"] == 1.0
    assert reached([one], []) == []
    part = one["all"]["interval"]["alpha"]
    part["covered"], one["all"]["steady"]["alpha"] = 0.5, 1.0
    assert reached([one], []) == ["brake: alpha 1 > 0.25"]
    one["least_friction"] = 0.4
    (missed,) = reached([one], [])
    assert "the interval of alpha holds 50 % of the turns < 90 %" in missed
    part["covered"] = 0.9
    assert reached([one], []) == []


def test_the_interval_holds_what_its_standard_deviation_allows(braked: Recording) -> None:
    wide = {f"{name}_std": np.full_like(braked.told[name], np.inf) for name in LIMITS}
    narrow = {name: 1e-9 * np.ones_like(values) for name, values in wide.items()}
    for told, share in ((wide, 1.0), (narrow, 0.0)):
        interval = score(replace(braked, told=braked.told | told))["all"]["interval"]
        for name in LIMITS:
            assert interval[name]["covered"] == share, name


def test_the_page_names_what_is_not_reached(braked: Recording, tmp_path: Path) -> None:
    drawn = replace(braked, name="mu_split")
    scores = [score(drawn)]
    checks = [{"case": "x", "valid_before": True, "turns": 3.0, "stays": True, "passed": False}]
    strict = dict.fromkeys(LIMITS, 1e-09)
    document = {
        "vehicle": "one",
        "step_s": TIME_STEP,
        "limits": strict,
        "manoeuvres": scores,
        "range": checks,
        "missed": reached(scores, checks),
    }
    assert "range: x" in document["missed"]
    page = write_cosim(document, [series(drawn)], tmp_path).read_text(encoding="utf-8")
    for words in ("Not reached: range: x.", "MISSED", "tracks-mu_split", "front left", " *"):
        assert words in page, words


def test_a_frame_that_does_not_come_is_missing_not_repeated(fmus: tuple[Path, Path]) -> None:
    steady = WheelStates(*(np.full(len(WHEELS), x) for x in (4000.0, 0.02, 0.0, 0.0, 20.0)))
    with FourWheels(*fmus, parameters={"dropped_frames": 0.03}) as wheels:
        told = follow([steady] * 350, wheels)
    assert 0.0 < 1.0 - told["tire_valid"].mean() < 0.1
    assert (told["flags"][-1].astype(int) & int(TurnFlag.GAP)).any()


def test_what_cannot_be_stepped_is_refused(wheels: FourWheels) -> None:
    for step in (0.0, 5e-5, 2e-3):
        with pytest.raises(ParameterError, match=r"allowed are 1 \.\. 10 whole samples"):
            wheels.step(0.0, step, WheelStates(*(np.ones(4),) * 5))
    assert "Fz" in NAMES


def test_strain_tires_are_told_the_tread_and_the_friction_only_where_asked(
    fmus: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    state = WheelStates(*(np.full(len(WHEELS), x) for x in (4000.0, 0.0, 0.0, 0.0, 20.0)))
    for asked, friction in ((False, np.nan), (True, OWN_FRICTION)):
        seen: list[np.ndarray] = []
        with FourWheels(*fmus, tells_friction=asked) as wheels:
            monkeypatch.setattr(wheels, "_estimate", lambda *given, to=seen: to.append(given[3]))
            wheels.start(state)
            wheels.step(0.0, TIME_STEP, state)
        told = np.array(seen)
        np.testing.assert_array_equal(told[:, HELD.index("friction")], friction)
        np.testing.assert_array_equal(told[:, HELD.index("tread_depth")], 0.008)
