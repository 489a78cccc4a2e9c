"""What is out of range is logged once, in numbers and with a remedy, alike by both kinds of FMU."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

from tests.fmu import live
from tests.fmu.player import held, play
from tirebench.page.feed import FLAG_LENGTH
from tirelib.fmu.remarks import TEXTS
from tirelib.fmu.run import LoadedFmu

CASES = {
    "friction": (4e3, 0.0, {"friction": 3.0}),
    "tread depth": (4e3, 0.0, {"tread_depth": 8.0}),
    "tread temperature": (4e3, 0.0, {"tread_temperature": 20.0}),
    "pressure": (4e3, 0.0, {"pressure": 2.3}),
    "two conditions": (4e3, 0.0, {"pressure": 2.3, "friction": 0.0}),
    "speed": (4e3, 0.0, {"speed": 65.0}),
    "camber": (4e3, 0.0, {"camber": 2.0}),
    "turn rate": (4e3, 0.0, {"omega": 600.0}),
    "load": (9e3, 0.0, {}),
    "side force": (4e3, 0.6, {}),
    "strain in another unit": (4e3, 0.0, {}),
    "strain in microstrain": (4e3, 0.0, {}),
    "a gage out": (9e3, 0.1, {}),
    "long steps": (4e3, 0.1, {}),
    "nothing": (4e3, 0.1, {}),
}
WANTED = {
    "friction": [r"friction_implausible: friction \[1\] = 3; allowed are 0.05 .. 1.8; .*"],
    "tread depth": [r"tread_depth_implausible: tread_depth \[m\] = 8; allowed are .*"],
    "tread temperature": [r"tread_temperature_implausible: .* = 20; allowed are 230 .. 400; .*"],
    "pressure": [
        r"pressure_out_of_range: gauge pressure \[Pa\] = 2.3; .* for 114957 .. 287561; .*"
    ],
    "two conditions": [r"friction_implausible: .*", r"pressure_out_of_range: .*"],
    "speed": [r"speed_out_of_range: speed \[m/s\] = 65; .* for 2.5 .. 60; .*"],
    "camber": [r"camber_out_of_range: camber \[rad\] = 2; .*"],
    "turn rate": [
        r"omega_mismatch: omega \[rad/s\] = 600; by the contacts .* 39.* .. 88.* sample_rate"
    ],
    "load": [r"Fz_out_of_range: Fz \[N\] = 901\S+; calibrated are 297\S+ .. 502\S+; .*"],
    "side force": [r"Fy_out_of_range: Fy \[N\] = -?7\S+; calibrated are -3\S+ .. 3\S+; .*"],
    "strain in microstrain": [r"strain_implausible: strain \[1\] = -?\d+\S*; allowed are -1 .*"],
    "strain in another unit": [r"strain_out_of_range: tension = \S+; calibrated .*"],
    "a gage out": [r"Fz_out_of_range: .*"],
    "long steps": [
        r"step_too_long: samples of a step \[1\] = 12; a frame holds 1 .. 10; .* "
        r"--samples-per-step 12, or .*"
    ],
    "nothing": [],
}


@pytest.fixture(scope="module")
def native() -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(10)) as loaded:
        yield loaded


@pytest.fixture(scope="module")
def python() -> Iterator[LoadedFmu]:
    with LoadedFmu(live.fmu_file(10, python=True)) as loaded:
        yield loaded


def said(fmu: LoadedFmu, case: str, axes: str) -> list[str]:
    load, tilt, known = CASES[case]
    samples = live.strain_of(load, tilt, turns=5.4)[0]
    if case == "a gage out":
        samples[1, 900:] = np.nan
    if case == "strain in another unit":
        samples *= 3.0
    if case == "strain in microstrain":
        samples *= 1e6
    fmu.start(live.RATE, axes=axes)
    if case == "long steps":
        for step in range(20):
            fmu.slave.doStep(step, 12 / live.RATE)
    else:
        assert sum(v["turn"] > 1 for v in play(fmu, samples, held(**known))) > 1
    return list(fmu.messages)


@pytest.mark.parametrize("case", CASES)
def test_value_range_and_remedy_are_logged_once(native: LoadedFmu, case: str) -> None:
    messages = said(native, case, "iso")
    assert len(messages) == len(WANTED[case])
    for message, wanted in zip(messages, WANTED[case], strict=True):
        assert re.fullmatch(wanted, message)
        assert len(message) <= FLAG_LENGTH


@pytest.mark.parametrize("axes", ["iso", "sae"])
@pytest.mark.parametrize("case", CASES)
def test_both_kinds_of_fmu_log_the_same(
    native: LoadedFmu, python: LoadedFmu, case: str, axes: str
) -> None:
    assert said(native, case, axes) == said(python, case, axes)


def test_a_reset_lets_it_be_logged_again(native: LoadedFmu) -> None:
    assert said(native, "load", "iso") == said(native, "load", "iso") != []


def test_every_text_names_its_value_and_what_is_allowed() -> None:
    for kind, text in TEXTS.items():
        if kind not in ("combination_out_of_range", "other_tire"):
            assert all(word in text for word in ("{value}", "{low}", "{high}"))
