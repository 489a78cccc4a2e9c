"""Laws of the running FMU: it is the library, and no fault reaches the importer as a crash."""

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu import live
from tests.fmu.player import CONDITIONS, held, play, play_from_start, same, strain
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag, flag_names
from tirelib.core.held import HELD
from tirelib.fmu.run import LoadedFmu
from tirelib.stream import StreamEstimator

QUANTITIES = ("Fz", "alpha", "kappa", "Fy")


def test_after_every_step_the_outputs_are_those_of_the_library(fmu: LoadedFmu) -> None:
    samples = strain()
    samples[1, 700:1500] = np.nan
    estimator = StreamEstimator(live.calibration(), live.RATE)
    fmu.start(live.RATE)
    for step, values in enumerate(play(fmu, samples)):
        part = slice(step * fmu.samples, (step + 1) * fmu.samples)
        estimator.push(samples[:, part], speed=live.SPEED, pressure=live.PRESSURE, camber=0.0)
        latest = estimator.latest
        assert values["valid"] == estimator.valid
        assert values["flags"] == estimator.flags
        assert values["turn"] == estimator.turns
        np.testing.assert_allclose(values["age"], estimator.age, rtol=1e-9)
        if latest is None:
            continue
        for quantity in QUANTITIES:
            wanted = (latest.value(quantity), latest.std(quantity))
            given = (values[quantity], values[f"{quantity}_std"])
            np.testing.assert_allclose(given, wanted, rtol=1e-9)
            assert values[f"{quantity}_valid"] == estimator.is_valid(quantity)
        np.testing.assert_allclose(
            [values[f"contact_length_{gage}"] for gage in range(1, 6)],
            latest.estimates.contact_length[0],
            rtol=1e-9,
        )
        np.testing.assert_allclose(
            [values[f"contact_length_std_{gage}"] for gage in range(1, 6)],
            latest.estimates.contact_length_std[0],
            rtol=1e-9,
        )
        np.testing.assert_allclose(values["contact_time"], latest.time, rtol=1e-9)
        assert values["rolling"] == latest.estimates.rolling[0]
    assert "reduced_gages" in values["status"]


def test_road_and_tread_reach_the_estimate_as_in_the_library(ten: LoadedFmu) -> None:
    samples, road = strain(), {"friction": 0.6, "tread_depth": 0.005, "tread_temperature": 300.0}
    estimator = StreamEstimator(live.calibration(), live.RATE)
    known = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    latest = estimator.push(samples, **known, **road)[-1]
    silent = StreamEstimator(live.calibration(), live.RATE).push(samples, **known)[-1]
    ten.start(live.RATE)
    told = play(ten, samples, held(**road))[-1]
    for quantity in ("Fz", "alpha", "Fy"):
        given = (told[quantity], told[f"{quantity}_std"])
        np.testing.assert_allclose(given, (latest.value(quantity), latest.std(quantity)), rtol=1e-9)
    assert latest.std("Fz") < silent.std("Fz")
    assert latest.value("Fz") > silent.value("Fz") + 20.0  # a worn tread hides load


def test_a_step_shorter_than_the_frame_takes_its_first_samples(ten: LoadedFmu) -> None:
    samples = strain()
    ten.start(live.RATE)
    whole = play(ten, samples)[-1]
    ten.start(live.RATE)
    at = 0
    for n in (3, 7, 10) * (samples.shape[1] // 20):
        ten.step(samples[:, at : at + n], CONDITIONS)
        at += n
    assert ten.count == samples.shape[1] // 20 * 20
    ten.step(samples[:, at:], CONDITIONS) if at < samples.shape[1] else None
    parts = ten.read()
    assert parts["turn"] == whole["turn"]
    for name in QUANTITIES:
        np.testing.assert_allclose(parts[name], whole[name], rtol=1e-12)


def test_samples_missing_between_frames_are_a_gap(ten: LoadedFmu) -> None:
    samples = strain()
    ten.start(live.RATE)
    estimator = StreamEstimator(live.calibration(), live.RATE)
    names = [f"strain_{sample}_{gage}" for sample in range(1, 11) for gage in range(1, 6)]
    names += HELD
    for first in range(0, samples.shape[1] - 20, 20):
        frame = samples[:, first : first + 10]
        values = np.concatenate((frame.T.ravel(), CONDITIONS)).tolist()
        ten.slave.setReal([ten.references[name] for name in names], values)
        ten.slave.doStep(first / live.RATE, 20 / live.RATE)
        holed = np.concatenate((frame, np.full((5, 10), np.nan)), axis=1)
        estimator.push(holed, speed=live.SPEED, pressure=live.PRESSURE, camber=0.0)
    last, latest = ten.read(), estimator.latest
    assert latest is not None
    assert last["contact_time"] == latest.time
    assert last["turn"] >= 3
    assert np.isnan(last["Fz"])
    assert {"gap", "too_few_gages"} <= set(flag_names(last["flags"]))


@pytest.mark.parametrize("step", [0.5, 1.5, 0.0, -1.0, np.nan])
def test_a_step_that_is_no_whole_number_of_samples_is_an_error_with_its_cause(
    ten: LoadedFmu, step: float
) -> None:
    ten.start(live.RATE)
    samples = strain()
    before = play(ten, samples[:, :1200])[-1]
    with pytest.raises(FMICallException, match="status 3"):
        ten.slave.doStep(ten.count / live.RATE, step / live.RATE)
    assert "a whole number of samples is needed" in ten.messages[-1]
    refused = ten.read()
    assert not any(refused[name] for name in refused if name.endswith("valid"))
    assert refused["status"].startswith("step_refused: communication step = ")
    assert [refused[name] for name in QUANTITIES] == [before[name] for name in QUANTITIES]
    wanted = play_from_start(ten, samples[:, :1210])
    ten.start(live.RATE)
    play(ten, samples[:, :1200])
    with pytest.raises(FMICallException, match="status 3"):
        ten.slave.doStep(ten.count / live.RATE, step / live.RATE)
    ten.step(samples[:, 1200:1210], CONDITIONS)
    assert same([ten.read()], [wanted])


def test_a_lost_frame_is_flagged_and_the_fmu_recovers(ten: LoadedFmu) -> None:
    samples = strain(turns=6.4)
    ten.start(live.RATE)
    seen = []
    for first in range(0, samples.shape[1], 10):
        lost = 1650 <= first < 1750
        ten.slave.setBoolean([ten.references["frame_valid"]], [not lost])
        ten.step(samples[:, first : first + 10], CONDITIONS)
        seen.append(ten.read())
    lost_turn = [v for v in seen if v["flags"] & TurnFlag.GAP]
    assert lost_turn
    assert not any(v["valid"] for v in lost_turn)
    assert all(np.isnan(v["Fz"]) for v in lost_turn)
    assert seen[-1]["valid"]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_none_are_missing_samples_and_the_fmu_recovers(
    ten: LoadedFmu, value: float
) -> None:
    samples = strain(turns=6.4)
    samples[:, 1600:1800] = value
    ten.start(live.RATE)
    seen = play(ten, samples)
    assert any(v["flags"] & TurnFlag.GAP for v in seen)
    assert seen[-1]["valid"]
    assert np.isfinite(seen[-1]["Fz"])


def test_a_dead_gage_is_told(ten: LoadedFmu) -> None:
    samples = strain()
    samples[3] = 0.0
    ten.start(live.RATE)
    last = play(ten, samples)[-1]
    assert {"dead_gage", "reduced_gages"} <= set(flag_names(last["flags"]))
    assert not last["valid"]
    assert all(last[f"{name}_valid"] for name in QUANTITIES)
    assert np.isnan(last["contact_length_4"])


def test_a_gage_that_lives_but_shows_no_contact_does_not_drop_validity(ten: LoadedFmu) -> None:
    samples = strain()
    samples[3] = 1e-3 + np.random.default_rng(1).normal(0.0, 4e-6, samples.shape[1])
    ten.start(live.RATE)
    last = play(ten, samples)[-1]
    assert {"dead_gage", "reduced_gages"} <= set(flag_names(last["flags"]))
    assert last["valid"]


def test_when_contacts_stay_away_validity_drops_and_values_are_held(ten: LoadedFmu) -> None:
    samples = strain(turns=3.0)
    ten.start(live.RATE)
    before = play(ten, samples)[-1]
    assert before["valid"]
    still = np.repeat(samples[:, -1:], 10 * 150, axis=1)
    last = play(ten, still)[-1]
    assert not any(last[f"{name}_valid"] for name in QUANTITIES)
    assert not last["valid"]
    assert last["flags"] == TurnFlag.NO_CONTACT
    assert last["status"] == "no_contact"
    assert last["Fz"] == before["Fz"]
    assert last["age"] > before["age"] + 0.2


@pytest.mark.parametrize(
    ("speed", "flag"), [(np.nan, "no_speed"), (0.0, "no_speed"), (-live.SPEED, "reversed")]
)
def test_a_speed_that_says_nothing_is_flagged(ten: LoadedFmu, speed: float, flag: str) -> None:
    ten.start(live.RATE)
    last = play(ten, strain(), held(speed=speed))[-1]
    assert flag in last["status"]
    assert np.isnan(last["kappa"])


@pytest.mark.parametrize("at", [3.1, 3.42, 3.5, 3.6, 3.95])
@pytest.mark.parametrize("height", [0.05, -0.03])
def test_a_burst_costs_the_turn_it_lies_in_and_at_most_one_more(
    ten: LoadedFmu, at: float, height: float
) -> None:
    """Three samples of the centre gage, higher than a contact; the contact is at 3.5 turns."""
    samples = strain(turns=9.4)
    first = int(at * 2.0 * np.pi * live.RADIUS / live.SPEED * live.RATE)
    samples[2, first : first + 3] = height
    ten.start(live.RATE)
    seen = play(ten, samples)
    turns = {v["turn"] for v in seen}
    valid = {v["turn"] for v in seen if v["valid"]}
    assert turns - valid <= {0, 1, 4, 5}
    burst = [v["status"] for v in seen if v["turn"] in {4, 5}]
    assert any("spike" in status for status in burst)
    assert not any(v["status"] == "first_turn" for v in seen if v["turn"] > 1)


ON_THE_SPOT = live.SPEED * 0.4 / (2.0 * np.pi)
"""Speed below which this wheel moves less in a turn than its contact, of 0.4 rad, is long."""


def beyond(note: str, **known: float) -> tuple[str, dict[str, float], set[str]]:
    slow = note == "speed" and known["speed"] < live.SPEED
    rolls = slow and known["speed"] > ON_THE_SPOT
    return f"{note}_out_of_range", known, {"kappa"} if rolls or note == "camber" else set()


@pytest.mark.parametrize(
    ("note", "known", "valid"),
    [
        beyond("pressure", pressure=2.3),
        beyond("pressure", pressure=0.0),
        beyond("pressure", pressure=33.0),
        beyond("pressure", pressure=-live.PRESSURE),
        beyond("speed", speed=65.0),
        beyond("speed", speed=1.2),
        beyond("speed", speed=1.1),
        beyond("speed", speed=1e-6),
        beyond("camber", camber=2.0),
        beyond("camber", camber=-0.5),
    ],
)
def test_a_condition_that_cannot_be_is_named_and_what_depends_on_it_is_not_valid(
    ten: LoadedFmu, note: str, known: dict[str, float], valid: set[str]
) -> None:
    ten.start(live.RATE)
    seen = [v for v in play(ten, strain(), held(**known)) if v["turn"] > 1]
    assert len(seen) > 1
    name = note.removesuffix("_out_of_range")
    (said,) = ten.messages
    assert said.startswith(f"{note}: {'gauge pressure' if name == 'pressure' else name} [")
    assert f"= {abs(known[name]) if name == 'speed' else known[name]:g}; the calibration" in said
    assert not any(v["valid"] for v in seen)
    for values in seen:
        assert {note, "out_of_range"} <= set(values["status"].split(";"))
        assert {name for name in QUANTITIES if values[f"{name}_valid"]} <= valid


@pytest.mark.parametrize("factor", [30.0 / np.pi, 0.5 / np.pi, -9.0, 1.6, -1.0])
def test_a_turn_rate_that_contradicts_the_contacts_is_named_and_nothing_is_valid(
    ten: LoadedFmu, factor: float
) -> None:
    rate = live.SPEED / live.RADIUS
    ten.start(live.RATE)
    last = play(ten, strain(), held(omega=factor * rate))[-1]
    assert last["status"] == "omega_mismatch"
    (said,) = ten.messages
    low, high = (f"{share * rate:.3g}" for share in (1.0 / 1.5, 1.5))
    found = re.fullmatch(
        r"omega_mismatch: omega \[rad/s\] = (\S+); .* is (\S+) \.\. (\S+); .*", said
    )
    assert found
    assert [f"{float(x):.3g}" for x in found.groups()] == [f"{factor * rate:.3g}", low, high]
    assert not any(last[f"{name}_valid"] for name in QUANTITIES)
    ten.start(live.RATE)
    assert play(ten, strain(), held(omega=1.2 * rate))[-1]["valid"]


def test_a_measured_standstill_drops_validity(ten: LoadedFmu) -> None:
    samples = strain(turns=3.0)
    ten.start(live.RATE)
    assert play(ten, samples)[-1]["valid"]
    ten.step(samples[:, -10:], held(omega=0.0))
    assert not ten.read()["valid"]


@pytest.mark.parametrize(
    ("axes", "signs"), [("sae", (-1, -1, 1, -1)), ("adapted_sae", (1, 1, 1, -1))]
)
def test_axes_turn_signs_and_the_side_of_the_gages(
    ten: LoadedFmu, axes: str, signs: tuple[int, ...]
) -> None:
    samples = strain(tilt=0.1)
    ten.start(live.RATE)
    plain = play(ten, samples)[-1]
    ten.start(live.RATE, axes=axes)
    turned = play(ten, samples[::-1])[-1]
    for name, sign in zip(QUANTITIES, signs, strict=True):
        np.testing.assert_allclose(turned[name], sign * plain[name], rtol=1e-12)
        np.testing.assert_allclose(turned[f"{name}_std"], plain[f"{name}_std"], rtol=1e-12)
    for gage in range(1, 6):
        np.testing.assert_allclose(
            turned[f"contact_length_{6 - gage}"], plain[f"contact_length_{gage}"], rtol=1e-12
        )


def test_parameters_out_of_range_are_fmi_errors_with_their_cause(
    ten: LoadedFmu, tmp_path: Path
) -> None:
    for rate in (5.0, 1e7, np.nan):
        with pytest.raises(FormatError, match=r"sample rate = .* allowed are 100 \.\. 100000 Hz"):
            ten.start(rate)
    with pytest.raises(FormatError, match="axes = 'up'; allowed are"):
        ten.start(live.RATE, axes="up")
    with pytest.raises(FormatError, match="cannot be read"):
        ten.start(live.RATE, calibration=str(tmp_path / "none.toml"))
    ten.start(live.RATE)
    assert play(ten, strain())[-1]["valid"]


def test_another_calibration_of_the_same_layout_is_taken_up(ten: LoadedFmu, tmp_path: Path) -> None:
    from dataclasses import replace

    given = live.calibration()
    chains = {
        missing: replace(
            chain, load=replace(chain.load, coefficients=1.1 * chain.load.coefficients)
        )
        for missing, chain in given.chains.items()
        if chain.load is not None
    }
    path = tmp_path / "other"
    other = live.write_other(replace(given, chains=chains), path, ten)
    ten.start(live.RATE)
    plain = play(ten, strain())[-1]["Fz"]
    ten.start(live.RATE, calibration=other)
    # the pressure law adds a little that is not scaled
    assert play(ten, strain())[-1]["Fz"] == pytest.approx(1.1 * plain, rel=1e-3)


def test_forbidden_calls_are_fmi_errors_again_and_again_and_the_importer_lives(
    ten: LoadedFmu,
) -> None:
    at = ten.references
    beyond = "IndexError" if live.is_python(ten) else "value reference = 9999; allowed are 0 .. "
    for _ in range(25):
        ten.start(live.RATE)
        for call, cause in (
            (lambda: ten.slave.setReal([at["Fz"]], [1.0]), "Fz: cannot be set now"),
            (lambda: ten.slave.setReal([at["sample_rate"]], [1e3]), "sample_rate: cannot be"),
            (lambda: ten.slave.setString([at["axes"]], ["sae"]), "axes: cannot be set now"),
            (lambda: ten.slave.getReal([at["turn"]]), "turn is not of type Real"),
            (lambda: ten.slave.getInteger([at["Fz"]]), "not of type Integer"),
            (lambda: ten.slave.getReal([9999]), beyond),
        ):
            ten.messages.clear()
            with pytest.raises(FMICallException):
                call()
            assert any(cause in text for text in ten.messages), ten.messages
    assert play(ten, strain())[-1]["valid"]


def test_an_unexpected_error_holds_the_values_invalid_and_the_fmu_recovers(
    python_ten: LoadedFmu, monkeypatch: pytest.MonkeyPatch
) -> None:
    ten = python_ten
    ten.start(live.RATE)
    samples = strain(turns=3.0)
    before = play(ten, samples)[-1]
    resources = Path(ten.slave.unzipDirectory) / "resources"
    package = next(resources.glob("tirelib_*")).name
    estimator = sys.modules[f"{package}.stream.reference"].NumpyEstimator
    good, calls = estimator.take, [0]

    def fails_once(*arguments: Any, **options: Any) -> Any:
        calls[0] += 1
        if calls[0] == 1:
            raise ZeroDivisionError("made by a test")
        return good(*arguments, **options)

    monkeypatch.setattr(estimator, "take", fails_once)
    ten.messages.clear()
    after = play(ten, samples[:, :20])
    assert ten.messages == ["ZeroDivisionError: made by a test"]
    assert not any(v["valid"] for v in after)
    assert all(v["flags"] & TurnFlag.FAULT for v in after)
    assert all(v["status"].endswith("fault: ZeroDivisionError: made by a test") for v in after)
    assert [v["Fz"] for v in after] == [before["Fz"]] * 2
    assert after[-1]["age"] > before["age"]
    recovered = play(ten, samples)[-1]
    assert recovered["valid"]
    assert recovered["turn"] > before["turn"]
    assert recovered["contact_time"] > before["contact_time"] + 0.2
