"""Every kind of bad input has its defined answer, and the importer lives."""

import math
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.fmu import live
from tests.fmu.player import held
from tests.synthetic import LATERAL
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag
from tirelib.fmu import export
from tirelib.fmu.build import build_fmu
from tirelib.fmu.run import LoadedFmu

GOOD = held()
TURN = int(2.0 * math.pi * live.RADIUS / live.SPEED * live.RATE)
ONSET = int(3.1 * TURN) // 10 * 10
"""Sample at which a fault begins; the last good contact has just been read (3 of them)."""


@pytest.fixture(scope="module")
def fmu(ten: LoadedFmu) -> LoadedFmu:
    return ten


@pytest.fixture(scope="module")
def strain() -> np.ndarray:
    found = live.strain_of(4e3, 0.05, turns=7.0)[0]
    return found[:, : found.shape[1] // 10 * 10]


def play(fmu: LoadedFmu, strain: np.ndarray, conditions: np.ndarray = GOOD) -> list[Any]:
    seen = []
    for first in range(0, strain.shape[1], 10):
        fmu.step(strain[:, first : first + 10], conditions)
        seen.append(fmu.read())
    return seen


def set_all(value: float, gages: tuple[int, ...] = (0, 1, 2, 3, 4)) -> Callable[..., None]:
    def change(strain: np.ndarray) -> None:
        strain[list(gages), ONSET:] = value

    return change


def freeze(*gages: int) -> Callable[..., None]:
    def change(strain: np.ndarray) -> None:
        strain[list(gages), ONSET:] = strain[list(gages), ONSET][:, None]

    return change


def load(value: float) -> Callable[..., None]:
    def change(strain: np.ndarray) -> None:
        other = live.strain_of(value, 0.05, turns=7.0)[0]
        strain[:, ONSET:] = other[:, ONSET : strain.shape[1]]

    return change


def tilt(strain: np.ndarray) -> None:
    strain[:, ONSET:] = live.strain_of(4e3, 0.7, turns=7.0)[0][:, ONSET : strain.shape[1]]


def nothing(strain: np.ndarray) -> None:
    pass


FAULTS = {
    "NaN": (set_all(np.nan), GOOD, "no_contact"),
    "infinity": (set_all(np.inf), GOOD, "no_contact"),
    "a number beyond all measure": (set_all(1e308), GOOD, "no_contact"),
    "frozen gages, wheel locked or cable cut": (freeze(0, 1, 2, 3, 4), GOOD, "no_contact"),
    "centre gage frozen": (freeze(2), GOOD, "no_contact"),
    "two gages frozen": (freeze(0, 3), GOOD, "too_few_gages"),
    "a gage frozen": (freeze(3), GOOD, "reduced_gages"),
    "a gage NaN": (set_all(np.nan, (1,)), GOOD, "reduced_gages"),
    "a gage infinite": (set_all(-np.inf, (4,)), GOOD, "reduced_gages"),
    "speed zero while the wheel turns": (nothing, held(speed=0.0), "no_speed"),
    "speed lost": (nothing, held(speed=np.nan), "no_speed"),
    "speed infinite": (nothing, held(speed=np.inf), "no_speed"),
    "two gages NaN": (set_all(np.nan, (0, 3)), GOOD, "too_few_gages"),
    "reverse": (nothing, held(speed=-live.SPEED), "reversed"),
    "load above the calibrated": (load(9e3), GOOD, "out_of_range"),
    "load below the calibrated": (load(1e2), GOOD, "out_of_range"),
    "slip angle beyond the calibrated": (tilt, GOOD, "out_of_range"),
    "pressure beyond the calibrated": (nothing, held(pressure=9e5), "out_of_range"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_valid_drops_within_two_turns(fmu: LoadedFmu, strain: np.ndarray, name: str) -> None:
    change, conditions, word = FAULTS[name]
    faulty = strain.copy()
    change(faulty)
    fmu.start(live.RATE)
    assert play(fmu, faulty[:, :ONSET])[-1]["valid"]
    after = play(fmu, faulty[:, ONSET : ONSET + 2 * TURN + 20], conditions)
    first = next((n for n, values in enumerate(after) if not values["valid"]), None)
    assert first is not None, name
    assert (first + 1) * 10 <= 2 * TURN
    assert word in after[-1]["status"].split(";")
    assert not after[-1]["valid"]


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.375, 0.4, 0.45, 0.7])
def test_a_single_frozen_gage_is_told_within_two_turns_and_the_others_go_on(
    fmu: LoadedFmu, strain: np.ndarray, phase: float
) -> None:
    faulty = strain.copy()
    onset = ONSET + int(phase * TURN) // 10 * 10
    faulty[1, onset:] = faulty[1, onset]
    fmu.start(live.RATE)
    before = play(fmu, faulty[:, :onset])[-1]
    last = play(fmu, faulty[:, onset : onset + 2 * TURN])[-1]
    assert before["valid"]
    assert not last["valid"]
    assert last["Fz_valid"]
    assert last["flags"] & TurnFlag.REDUCED_GAGES
    assert last["flags"] & TurnFlag.DEAD_GAGE
    assert np.isnan(last["contact_length_2"])
    assert last["Fz"] == pytest.approx(before["Fz"], abs=4 * last["Fz_std"])


@pytest.mark.parametrize("speed", [0.0, np.nan, np.inf, -np.inf])
def test_without_a_usable_speed_the_slip_ratio_alone_is_invalid(
    fmu: LoadedFmu, strain: np.ndarray, speed: float
) -> None:
    fmu.start(live.RATE)
    last = play(fmu, strain[:, :ONSET], held(speed=speed))[-1]
    assert np.isnan(last["kappa"])
    assert not last["kappa_valid"]
    assert last["Fz_valid"]
    assert "no_speed" in last["status"].split(";")


@pytest.mark.parametrize("place", [1, 2])
def test_an_infinite_condition_is_an_unknown_one(
    fmu: LoadedFmu, strain: np.ndarray, place: int
) -> None:
    told = []
    for value in (np.inf, np.nan):
        conditions = GOOD.copy()
        conditions[place] = value
        fmu.start(live.RATE)
        told.append(repr(play(fmu, strain[:, :ONSET], conditions)[-1]))
    assert told[0] == told[1]


def refused(fmu: LoadedFmu, step: float, cause: str) -> dict[str, Any]:
    fmu.messages.clear()
    with pytest.raises(FMICallException, match="status 3"):
        fmu.slave.doStep(0.0, step)
    assert any(cause in text for text in fmu.messages), fmu.messages
    values = fmu.read()
    assert not any(values[name] for name in values if name.endswith("valid"))
    assert values["status"].startswith("step_refused: ")
    assert cause.split(";")[0] in values["status"]
    return values


@pytest.mark.parametrize(
    ("step", "cause"),
    [
        (0.0, "a whole number of samples is needed"),
        (-0.002, "a whole number"),
        (np.nan, "a whole number"),
        (np.inf, "a whole number"),
        (-np.inf, "a whole number"),
        (3.2, "allowed is above 0 and up to 3 s"),
        (1e9, "allowed is above 0 and up to 3 s"),
    ],
)
def test_a_step_that_cannot_be_is_an_error_and_nothing_is_valid_until_a_good_one(
    fmu: LoadedFmu, strain: np.ndarray, step: float, cause: str
) -> None:
    fmu.start(live.RATE)
    before = play(fmu, strain[:, :ONSET])[-1]
    after = refused(fmu, step, cause)
    assert after["Fz"] == before["Fz"]
    assert play(fmu, strain[:, ONSET : ONSET + 10])[-1]["valid"]


def test_a_step_longer_than_a_turn_is_a_gap_and_drops_validity(
    fmu: LoadedFmu, strain: np.ndarray
) -> None:
    fmu.start(live.RATE)
    assert play(fmu, strain[:, :ONSET])[-1]["valid"]
    fmu.slave.doStep(0.0, 2 * TURN / live.RATE)
    late = fmu.read()
    assert not late["valid"]
    assert "no_contact" in late["status"].split(";")
    assert play(fmu, strain[:, 10:])[-1]["valid"]


def test_steps_before_the_start_and_after_the_end_are_refused(
    fmu: LoadedFmu, strain: np.ndarray
) -> None:
    fmu.slave.reset()
    refused(fmu, 0.002, "the FMU is not initialised")
    fmu.start(live.RATE)
    before = play(fmu, strain[:, :ONSET])[-1]
    fmu.slave.terminate()
    assert fmu.read()["Fz"] == before["Fz"]
    assert refused(fmu, 0.002, "the FMU is terminated")["Fz"] == before["Fz"]
    with pytest.raises(FMICallException):
        fmu.slave.terminate()
    fmu.start(live.RATE)
    assert play(fmu, strain[:, :ONSET])[-1]["valid"]


def test_it_is_initialised_once(fmu: LoadedFmu, strain: np.ndarray) -> None:
    fmu.start(live.RATE)
    before = play(fmu, strain[:, :ONSET])[-1]
    for act in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        with pytest.raises(FMICallException):
            getattr(fmu.slave, act)()
        assert any("reset it before you initialise it again" in said for said in fmu.messages)
        assert repr(fmu.read()) == repr(before)
    assert play(fmu, strain[:, ONSET : ONSET + 10])[-1]["valid"]


def test_a_state_knows_whether_it_was_refused_or_terminated(
    fmu: LoadedFmu, strain: np.ndarray
) -> None:
    fmu.start(live.RATE)
    good = play(fmu, strain[:, :ONSET])[-1]
    state = fmu.slave.getFMUState()
    refused(fmu, 0.0, "a whole number of samples")
    fmu.slave.terminate()
    fmu.slave.setFMUState(state)
    assert repr(fmu.read()) == repr(good)
    assert play(fmu, strain[:, ONSET : ONSET + 10])[-1]["valid"]
    fmu.slave.freeFMUState(state)


def test_a_wrong_parameter_fails_the_start_and_a_reset_heals_it(
    fmu: LoadedFmu, strain: np.ndarray
) -> None:
    at = fmu.references
    for name, value, cause in (
        ("sample_rate", 5.0, "allowed are 100"),
        ("sample_rate", np.nan, "allowed are 100"),
        ("filter_order", 30.0, "the calibration was made with 24 cycles per turn"),
        ("filter_order", -1.0, "made with 24 cycles"),
        ("filter_order", np.nan, "made with 24"),
    ):
        fmu.slave.reset()
        fmu.messages.clear()
        fmu.slave.setReal([at[name]], [value])
        fmu.slave.enterInitializationMode()
        with pytest.raises(FMICallException):
            fmu.slave.exitInitializationMode()
        assert any(cause in text for text in fmu.messages), fmu.messages
        refused(fmu, 0.002, "the FMU is not initialised")
    fmu.slave.reset()
    fmu.slave.setReal([at["filter_order"], at["sample_rate"]], [24.0, live.RATE])
    fmu.slave.enterInitializationMode()
    fmu.slave.exitInitializationMode()
    fmu.start(live.RATE)
    assert play(fmu, strain[:, :ONSET])[-1]["valid"]


def test_a_calibration_must_be_there_and_of_the_tire_on_the_wheel(
    fmu: LoadedFmu, strain: np.ndarray, tmp_path: Path
) -> None:
    known, junk = live.calibration(), tmp_path / "junk"
    other = live.write_other(replace(known, tire="winter tire"), tmp_path / "other", fmu)
    wider = replace(known, lateral=tuple(1.1 * y for y in LATERAL))
    layout = live.write_other(wider, tmp_path / "layout", fmu)
    junk.write_bytes(b"\xff\x00 no calibration")
    no_file = "is not TOML" if live.is_python(fmu) else "give a file made by `tirelib fmu table`"
    for texts, cause in (
        ({"calibration": str(tmp_path / "none.toml")}, "none.toml: cannot be read"),
        ({"calibration": str(tmp_path)}, "cannot be read"),
        ({"calibration": str(junk)}, no_file),
        ({"calibration": other}, "the tire is 'live tire', the calibration is of 'winter"),
        ({"tire": "winter tire"}, "the tire is 'winter tire', the calibration is of 'live tire'"),
        (
            {"calibration": layout},
            r"gages lie at \+60, \+30, \+0, -30, -60 mm \(ISO\), the calibration has them at "
            r"\+66, \+33, \+0, -33, -66 mm; calibrate with this layout",
        ),
    ):
        with pytest.raises(FormatError, match=cause):
            fmu.start(live.RATE, **texts)
    fmu.start(live.RATE, calibration=other, tire="winter tire")
    assert play(fmu, strain[:, :ONSET])[-1]["valid"]


def test_two_versions_in_one_process_each_run_their_own_code(
    python_ten: LoadedFmu, strain: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu, honest = python_ten, export.collect

    def doubled(slave: Path) -> dict[str, str]:
        sources = honest(slave)
        old = "s * latest.value(q) for"
        assert old in sources["fmu/wheel.py"]
        return {**sources, "fmu/wheel.py": sources["fmu/wheel.py"].replace(old, f"2.0 * {old}")}

    monkeypatch.setattr(export, "collect", doubled)
    second = build_fmu(
        live.calibration_file(),
        tmp_path / "second.fmu",
        samples_per_step=10,
        sample_rate=live.RATE,
        python=True,
    )
    with LoadedFmu(second) as other, LoadedFmu(live.fmu_file(10, python=True)) as third:
        for one in (fmu, other, third):
            one.start(live.RATE)
        for first in range(0, ONSET, 10):
            for one in (other, fmu, third):
                one.step(strain[:, first : first + 10], GOOD)
        loads = [one.read()["Fz"] for one in (fmu, other, third)]
    assert loads[1] == 2.0 * loads[0]
    assert loads[2] == loads[0]


def test_no_module_of_the_fmu_has_a_name_that_another_could_have() -> None:
    with zipfile.ZipFile(live.fmu_file(10, python=True)) as archive:
        modules = {n.split("/")[1] for n in archive.namelist() if n.endswith(".py")}
        digest = archive.read("resources/slavemodule.txt").decode()[-12:]
    assert len(modules) == 2
    assert all(name.removesuffix(".py").endswith(f"_0_1_0_{digest}") for name in modules)


def test_a_fault_at_every_step_is_logged_a_few_times_and_the_values_are_held(
    python_ten: LoadedFmu, strain: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu = python_ten
    fmu.start(live.RATE)
    before = play(fmu, strain[:, :ONSET])[-1]
    package = next((Path(fmu.slave.unzipDirectory) / "resources").glob("tirelib_*")).name
    estimator = sys.modules[f"{package}.stream.reference"].NumpyEstimator
    count = [0]

    def always(*_: Any, **__: Any) -> Any:
        count[0] += 1
        raise RuntimeError("each one differs" if count[0] <= 150 else f"number {count[0]}")

    monkeypatch.setattr(estimator, "take", always)
    fmu.messages.clear()
    for first in range(0, 3000, 10):
        fmu.step(strain[:, first : first + 10], GOOD)
    assert count[0] == 300
    assert fmu.messages[:3] == [
        "RuntimeError: each one differs",
        "RuntimeError: each one differs (10 times by now)",
        "RuntimeError: each one differs (100 times by now)",
    ]
    assert len(fmu.messages) == 3 + 49 + 1
    assert fmu.messages[-1].startswith("50 different causes were reported")
    last = fmu.read()
    assert last["Fz"] == before["Fz"]
    assert not last["valid"]
    assert last["status"].endswith("fault: RuntimeError: number 300")


@pytest.mark.parametrize(
    ("python", "file", "cause"),
    [(True, "guid.txt", "come from different builds"), (False, "StrainTire.core", "is cut off")],
)
def test_a_damaged_fmu_does_not_start_and_says_why(
    tmp_path: Path, python: bool, file: str, cause: str
) -> None:
    path, whole = tmp_path / "damaged.fmu", live.fmu_file(10, python=python)
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data[:-2] if name.endswith(file) else data)
    with pytest.raises(FormatError, match=rf"(?s)cannot be instantiated: .*{cause}"):
        LoadedFmu(path)
